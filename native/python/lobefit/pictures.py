"""What each way to show a material is worth: the error of its pictures against what they cost."""

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lobefit import blender
from lobefit._native import Measurement
from lobefit.fitting import closures
from lobefit.inputs import Progress
from lobefit.preview import measurement_of
from lobefit.record import Record
from lobefit.shown import evaluate

# The closures that a report compares, target and count.
COMPARED = (("measured", 1), ("measured", 2), ("measured", 3), ("lobe", 1), ("lobe", 2))
# What the others are compared with: the best Principled BSDF, and a surface of one closure.
LANDMARK, FLOOR = "principled", "diffuse"

_PHASES = np.radians(np.arange(10.0, 165.0, 10.0))
_SPHERE = 64  # pixels across; smaller spheres miss the highlights of polished metal
_LEAST_COSINE = 0.1  # of the view angle: the last pixels of the rim are left out

Evaluate = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Picture:
    """One way to show a material.

    `kind` is one of the add-on's or "diffuse", `count` the number of specular closures of a baked
    one, `error` the mean L1 difference of pictures of a sphere (None where it is not known), and
    `seconds` the processor time of a camera sample.
    """

    kind: str
    count: int | None
    error: float | None
    seconds: float


def with_closures(record: Record, progress: Progress | None = None) -> Record:
    """The record with all of `COMPARED`, or as it is where its measurement is no longer there."""
    if measurement_of(record) is None:
        return record
    held = {(entry["target"], entry["count"]) for entry in record.closures}
    for target, count in COMPARED:
        if (target, count) not in held:
            record = closures(record, target=target, count=count, progress=progress)
    return record


def measure(record: Record) -> list[Picture]:
    """Every way to show the record, rendered in this run to know its cost (with bpy)."""
    errors = _errors(record)
    return [
        Picture(kind, count, errors.get((kind, count)), seconds)
        for (kind, count), seconds in blender.costs(record).items()
    ]


def sphere_error(measurement: Measurement, evaluate: Evaluate) -> float:
    """How far pictures by `evaluate`, f cos(theta_i) of wi and wo, are off a measurement's.

    A sphere is seen under one light at angles of 10, 20 .. 160 degrees from the viewer; for each
    the sum of all differences is divided by the light, and the mean is taken. It is the `error` of
    closures in a record, up to how that is sampled.
    """
    return float(np.mean([_picture_error(measurement, evaluate, phase) for phase in _PHASES]))


def table(pictures: Mapping[str, Sequence[Picture]]) -> str:
    """A line for every picture of every material, as CSV; costs also in Principled BSDFs."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ["material", "kind", "closures", "sphere_error", "seconds_per_sample", "principled_costs"]
    )
    for name, ways in pictures.items():
        unit = next(way.seconds for way in ways if way.kind == LANDMARK)
        for way in ways:
            writer.writerow([name, way.kind, way.count, way.error, way.seconds, way.seconds / unit])
    return text.getvalue()


def _errors(record: Record) -> dict[tuple[str, int | None], float | None]:
    """Against the measurement; the record itself tells those of what was fitted to it."""
    errors: dict[tuple[str, int | None], float | None] = {
        (entry["target"], entry["count"]): entry["error"]
        for entry in record.closures
        if entry["target"] == "measured"
    }
    errors[LANDMARK, None] = record.principled["error"]
    measurement = measurement_of(record)
    if measurement is not None:
        live = partial(evaluate, ("live", record.parameters))
        errors["live", None] = sphere_error(measurement, live)
        for entry in record.closures:
            if entry["target"] == "lobe":
                lobe = partial(evaluate, ("closures", entry))
                errors["lobe", entry["count"]] = sphere_error(measurement, lobe)
    return errors


def _picture_error(measurement: Measurement, evaluate: Evaluate, phase: float) -> float:
    wi, wo = _lit_pixels(phase)
    reference = measurement.evaluate(wi, wo) * wi[:, 2:]
    difference = np.abs(evaluate(wi, wo) - reference)
    return float(np.nansum(difference) / np.nansum(reference).clip(1e-30))


def _lit_pixels(phase: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directions toward the light and the viewer for the pixels of a sphere, with n = +z."""
    side = (np.arange(_SPHERE) + 0.5) * 2 / _SPHERE - 1
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    facing = np.sqrt((1 - x**2 - y**2).clip(0))
    light = np.array([math.sin(phase), 0.0, math.cos(phase)])
    n = np.stack([x, y, facing], axis=1)[facing > _LEAST_COSINE]
    n = n[n @ light > 0]
    # Any frame will do for isotropic materials, as long as both directions are in the same.
    tangent = np.cross(n, [0.31, 0.57, 0.76])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = np.stack([tangent, np.cross(n, tangent), n], axis=1)
    return frame @ light, frame @ np.array([0.0, 0.0, 1.0])
