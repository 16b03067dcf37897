"""What the measured materials of a Blender file hold, as files for other programs."""

import csv
import io
import re
from collections.abc import Container, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from lobefit import blender
from lobefit.record import ERRORS, Fit, Record

TABLE = "parameters.csv"
KINDS = {
    "records": "NAME.json, the record of each material",
    "csv": f"{TABLE}, the parameters of all",
    "gltf": "NAME.glb, a sphere of the best-fit Principled BSDF",
    "usd": "NAME.usdc, the same",
}

_CHANNELS = ("red", "green", "blue")


def places_in(folder: Path, names: Iterable[str]) -> Iterator[tuple[str, Path]]:
    """Each name with a place in the folder, without a suffix, that no other name has."""
    taken: set[str] = set()
    for name in names:
        # Dots, too: what follows one would pass for a suffix.
        stem = base = re.sub(r'[/\\:*?"<>|.\x00-\x1f]+', "_", name)
        number = 1
        while stem.lower() in taken:
            number += 1
            stem = f"{base}-{number}"
        taken.add(stem.lower())
        yield name, folder / stem


def write_material(record: Record, name: str, stem: Path, kinds: Container[str]) -> Iterator[Path]:
    """Writes those of the files `kinds` that every material has its own of; yields their paths."""
    if "records" in kinds:
        path = stem.with_suffix(".json")
        record.save(path)
        yield path
    for kind, suffix in (("gltf", ".glb"), ("usd", ".usdc")):
        if kind in kinds:
            path = stem.with_suffix(suffix)
            blender.export_principled(path, name, record)
            yield path


def table(records: Mapping[str, Record]) -> str:
    """A line for every fit of every record, by the name of its material, as CSV.

    Numbers are exact when read back; a parameter that a model does not have is left empty.
    """
    rows = [row for name, record in records.items() for row in _rows(name, record)]
    text = io.StringIO()
    # Every row has the columns of every other.
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _rows(name: str, record: Record) -> Iterator[dict[str, Any]]:
    source = {"file": record.source["path"], "sha256": record.source["sha256"]}
    settings = {key: getattr(record, key) for key in ("norm", "schedule", "channels", "max_angle")}
    for model, fit in record.fits.items():
        yield {"material": name, **source, "model": model, **settings, **_fit(fit)}


def _fit(fit: Fit) -> dict[str, Any]:
    parameters = dict(fit.parameters)
    del parameters["model"]
    if not isinstance(parameters["exponent"], list):
        parameters["exponent"] = [parameters["exponent"]] * 3
    columns = dict(_columns("", parameters))
    columns |= {name: fit.error[name]["pooled"] for name in ERRORS}
    columns["converged"] = fit.converged
    return columns | dict(_columns("principled_", fit.principled))


def _columns(prefix: str, values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """A column for every number; three numbers are those of the channels."""
    for name, value in values.items():
        if isinstance(value, list):
            for channel, number in zip(_CHANNELS, value, strict=True):
                yield f"{prefix}{name}_{channel}", number
        else:
            yield f"{prefix}{name}", value
