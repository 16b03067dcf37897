"""What is told of one material by pictures: its error by angle, its lobe and its albedo."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from lobefit import _native
from lobefit._native import InputError, Measurement
from lobefit.angles import albedo_lines, albedo_plot, error_map, plane_lines, plane_plot
from lobefit.picture import Image
from lobefit.plot_image import drawn
from lobefit.record import Record
from lobefit.shown import Shown, reflectance

_HEIGHT = 400  # units: with its legend a plot is about square
_MEASURED, _SHOWN = "#e8e9eb", "#e5a03c"
_COLORS = {
    "measured": _MEASURED,
    "modified-phong": "#6f9fd8",
    "modified-blinn-phong": "#6f9fd8",
    "interpolated": "#6f9fd8",
    "cycles": _SHOWN,
}
# Steps of the error map, and samples of each step in each of theta_h, theta_d and phi_d.
_THETA_H = 90 * np.linspace(0, 1, 19) ** 2
_THETA_D = np.linspace(0, 90, 16)
_SAMPLES = (2, 2, 6)


def draw_error_map(record: Record, measurement: Measurement | None, shown: Shown) -> Image:
    """Where what Cycles shows is off, by half and difference angle, relative to each step.

    Without the measurement it is the map in the record, of the fitted lobe. Raises InputError where
    there is none either.
    """
    if measurement is not None:
        return drawn(error_map(_misfit(measurement, shown)))
    if record.error_by_angle is None:
        raise InputError(
            f"{record.name}: expected its measured file or errors by angle in its record, found "
            "neither."
        )
    return drawn(error_map(record.error_by_angle["half_difference"]))


def draw_lobe(
    record: Record, measurement: Measurement | None, shown: Shown, incidence: float = 45.0
) -> Image:
    """f in the plane of a light at `incidence` degrees: measured, fitted and as Cycles shows it."""
    curves: dict[str, Any] = {"measured": measurement.evaluate} if measurement else {}
    curves[record.model] = partial(_native.evaluate_model, record.parameters)
    curves["cycles"] = partial(reflectance, shown)
    lines = plane_lines(curves, incidence, _COLORS)
    return drawn(plane_plot(lines, incidence, height=_HEIGHT), lines)


def draw_albedo(albedo: Mapping[str, list[Any]]) -> Image:
    """The part of the light that is reflected, `measured` and `shown`, by `view_angle`."""
    names = {"measured": "measured", "shown": "as Cycles shows it"}
    rows = {label: albedo[name] for name, label in names.items() if albedo[name]}
    lines = albedo_lines(albedo["view_angle"], rows)
    return drawn(albedo_plot(lines, height=_HEIGHT), lines)


def _misfit(measurement: Measurement, shown: Shown) -> dict[str, Any]:
    """The sums that `error_by_angle` of a record has, of samples instead of bins."""
    counts = [len(_THETA_H) - 1, len(_THETA_D) - 1]
    theta_h, theta_d = (
        _middles(edges, samples)
        for edges, samples in zip((_THETA_H, _THETA_D), _SAMPLES, strict=False)
    )
    # Isotropic and reciprocal materials repeat themselves beyond a half turn.
    phi_d = (np.arange(_SAMPLES[2]) + 0.5) * np.pi / _SAMPLES[2]
    grid = np.meshgrid(np.radians(theta_h), np.radians(theta_d), phi_d, indexing="ij")
    wi, wo = _directions(*(angle.ravel() for angle in grid))
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    reference = np.full((len(wi), 3), np.nan)
    found = reference.copy()
    reference[above] = measurement.evaluate(wi[above], wo[above])
    found[above] = reflectance(shown, wi[above], wo[above])
    shape = (counts[0], _SAMPLES[0], counts[1], _SAMPLES[1], -1)
    known = np.isfinite(reference)
    misfit = np.where(known, np.abs(found - reference), 0).reshape(shape).sum((1, 3, 4))
    measured = np.where(known, reference, 0).reshape(shape).sum((1, 3, 4))
    return {
        "theta_h": _THETA_H.tolist(),
        "theta_d": _THETA_D.tolist(),
        "misfit": misfit.tolist(),
        "measured": measured.tolist(),
    }


def _middles(edges: np.ndarray, samples: int) -> np.ndarray:
    """Angles evenly within each step."""
    share = (np.arange(samples) + 0.5) / samples
    return (edges[:-1, None] + share * np.diff(edges)[:, None]).ravel()


def _directions(
    theta_h: np.ndarray, theta_d: np.ndarray, phi_d: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Directions toward light and viewer, (N, 3), of half and difference angles in radians.

    Rusinkiewicz 1998: the light is turned from the half vector's frame to that of n = +z.
    """
    x, y, z = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)
    cos_h, sin_h = np.cos(theta_h), np.sin(theta_h)
    light = np.stack([cos_h * x + sin_h * z, y, cos_h * z - sin_h * x], 1)
    half = np.stack([sin_h, np.zeros_like(sin_h), cos_h], 1)
    viewer = 2 * (half * light).sum(1, keepdims=True) * half - light
    return light, viewer
