"""Records to test and fuzz with, and what must hold of any bytes that are taken for one."""

import dataclasses
import json

from lobefit import InputError, Record
from lobefit.command_line import _fit_lines
from lobefit.record import Fit

TRUTH = {
    "model": "interpolated",
    "diffuse": [0.2, 0.1, 0.05],
    "specular": [8.0, 7.0, 6.0],
    "exponent": 40.0,
    "interpolation": 0.6,
    "ior": 1.8,
}


def figures(value: float) -> dict:
    return {"pooled": value, "rgb": [value, value / 3, value / 7]}


def plain_record() -> Record:
    """A record as a fit would make it, with numbers that no short decimal can hold."""
    return Record(
        source={
            "path": "/measured/gold.binary",
            "sha256": "0123",
            "format": "MERL",
            "bins": {"valid": 9, "below_horizon": 3, "negative": 1, "non_finite": 0},
        },
        model="interpolated",
        parameters={**TRUTH, "diffuse": [1 / 3, 5e-324, 0.1 + 0.2], "exponent": 1e308 / 7},
        error={
            name: figures(1 / 3)
            for name in ("l1", "relative_l1", "relative_l1_80", "relative_l1_cosine")
        },
        stages=[{"name": "polish", "l1": 1 / 7, "seconds": 0.1, "iterations": 12}],
        seconds={"read": 0.01, "start": 0.02, "fit": 0.5, "total": 0.53},
        converged=True,
        certainty={"starts": 8, "agree": 7, "spread": 1e-3},
        albedo={
            "view_angle": [0.0, 80.0],
            "measured": [[0.1, 0.2, 1 / 3], [None, None, None]],
            "model": [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]],
        },
        warnings=["the interpolation is at its bound"],
        principled={
            "base_color": [0.1, 0.2, 0.3],
            "metallic": 1.0,
            "roughness": 0.25,
            "ior": 1.5,
            "specular_tint": [1.0, 1.0, 1.0],
            "error": 0.2,
        },
        schedule="polish",
        norm="l1",
        channels="shared",
        max_angle=90.0,
    )


CURVE = [[0.0, 1 / 3], [0.2, 5e-324], [1.0, 1e300 / 7]]


def closures(**changes):
    """An entry of a record's closures, with numbers that no short decimal can hold."""
    specular = {
        "distribution": "beckmann",
        "roughness": CURVE,
        "anisotropy": [[0.0, -1 / 7]],
        "bend": CURVE,
        "weight": [CURVE] * 3,
    }
    return {
        "target": "measured",
        "count": 1,
        "cap_albedo": False,
        "error": 1 / 3,
        "seconds": 2 / 3,
        "by_view": {
            "view_angle": [1 / 3],
            "target_albedo": [[0.1, 0.2, 1 / 3]],
            "closures_albedo": [[0.1, 0.2, 1 / 7]],
            "relative_error": [1 / 9],
        },
        "diffuse": [CURVE] * 3,
        "specular": [specular],
        **changes,
    }


def uncertainty(record):
    return {
        "confidence": 0.95,
        "blocks": 25,
        "seconds": 0.1,
        "low": {**record.parameters, "ior": 1 + 1 / 3},
        "high": {**record.parameters, "ior": 7 / 3},
        "undetermined": ["ior"],
        "variables": ["diffuse red", "ior"],
        "correlation": [[1.0, -1 / 3], [-1 / 3, 1.0]],
    }


BY_ANGLE = {
    "half_difference": {
        "theta_h": [0.0, 30.0, 90.0],
        "theta_d": [0.0, 90.0],
        "misfit": [[1 / 3], [0.0]],
        "measured": [[1 / 7], [6 / 7]],
    },
    "view": {"view_angle": [0.0, 90.0], "misfit": [1 / 3], "measured": [1.0]},
}


def whole_record() -> bytes:
    """A record with everything in it that a record can have."""
    record = plain_record()
    names = [field.name for field in dataclasses.fields(Fit)]
    record.closures = [closures()]
    record.uncertainty, record.error_by_angle = uncertainty(record), BY_ANGLE
    record.models = {"interpolated": Fit(**{name: getattr(record, name) for name in names})}
    return json.dumps(dataclasses.asdict(record), separators=(",", ":")).encode()


def complaint(data: bytes) -> str:
    """What is wrong with a record, in one sentence; empty when all that uses it finds its way."""
    try:
        record = Record.from_json(data, "damaged")
    except InputError as error:
        said = str(error)
        assert said.startswith("damaged: expected ") and said.endswith(".") and "\n" not in said
        return said
    for fit in record.fits.values():
        list(_fit_lines(fit))
    assert record.name is not None and record.command()
    assert Record.from_json(record.to_json()) == record
    return ""
