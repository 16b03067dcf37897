"""What several tests share: a table whose truth is known, and a record without a fit."""

from pathlib import Path

import pytest
from lobefit import Measurement, Record, fit

TRUTH = {
    "model": "interpolated",
    "diffuse": [0.2, 0.1, 0.05],
    "specular": [8.0, 7.0, 6.0],
    "exponent": 40.0,
    "interpolation": 0.6,
    "ior": 1.8,
}


@pytest.fixture(scope="session")
def truth():
    return TRUTH


@pytest.fixture(scope="session")
def table(tmp_path_factory) -> Path:
    """A MERL file of the interpolated lobe with the parameters `truth`."""
    path = tmp_path_factory.mktemp("tables") / "truth.binary"
    Measurement.from_model(TRUTH).write(str(path))
    return path


@pytest.fixture(scope="session")
def all_models(table):
    """The record of every model fitted to `table`, and the progress that was told on the way."""
    seen = []
    record = fit(table, model="all", progress=lambda share, stage: seen.append((share, stage)))
    return record, seen


def figures(value: float) -> dict:
    return {"pooled": value, "rgb": [value, value / 3, value / 7]}


@pytest.fixture
def record() -> Record:
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
