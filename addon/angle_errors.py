"""Errors by view angle of kinds for which a record tells only the error over all angles."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Directions of the light for a view angle: strata from the peak outward, and around it. What is
# isotropic is the same on both sides of the plane of incidence, so one side will do.
_OUTWARD, _AROUND = 32, 12
# Widths of the lobes that the light is drawn from, in those of the Principled BSDF, for peaks that
# are sharper.
_WIDTHS = (1.0, 0.25)
_NARROWEST = 1e-3


def errors_by_angle(record: Any, kind: str, entry: Any) -> NDArray[np.float64]:
    """The part of the light that a kind, `principled` or `live`, has off at an entry's view angles.

    It is the difference from the entry's closures, and their own error on top: more than the error
    against the measurement, where it is not the same.
    """
    from lobefit import _native

    angles = np.radians(entry["by_view"]["view_angle"])
    wi, wo, weights = _directions(angles, record.principled["roughness"] ** 2)
    flat = wi.reshape(-1, 3), wo.reshape(-1, 3)
    wanted = _native.evaluate_closures(entry, *flat)
    if kind == "principled":
        shown = _native.evaluate_principled(record.principled, *flat)
    else:
        shown = _native.evaluate_live(record.parameters, *flat)
    off = np.abs(shown - wanted).sum(-1).reshape(weights.shape)
    light = np.maximum(wanted.sum(-1).reshape(weights.shape), 0.0)
    total = np.maximum((light * weights).sum(1), 1e-12)
    return (off * weights).sum(1) / total + np.asarray(entry["by_view"]["relative_error"])


def _directions(
    angles: NDArray[np.float64], width: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Toward the light and the viewer, and what each direction counts: (angles, directions)."""
    u = (np.arange(_OUTWARD) + 0.5) / _OUTWARD
    phi = (np.arange(_AROUND) + 0.5) / _AROUND * np.pi
    u, phi = (grid.ravel() for grid in np.meshgrid(u, phi, indexing="ij"))
    wo = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], 1)[:, None]
    widths = [max(width * factor, _NARROWEST) for factor in _WIDTHS]
    wi = [np.broadcast_to(_spherical(np.sqrt(u), phi), (len(angles), len(u), 3))]
    wi += [_mirrored(wo, _spherical(np.sqrt(_sine2(u, w)), phi)) for w in widths]
    wi = np.concatenate(wi, 1)
    wo = np.broadcast_to(wo, wi.shape)
    density = np.maximum(wi[..., 2], 0.0) / np.pi
    for w in widths:
        density = density + _density(wi, wo, w)
    above = wi[..., 2] > 0
    weights = np.where(above, 1.0 / np.maximum(density, 1e-30), 0.0)
    # Directions below the horizon count for nothing; any above it stand in for them.
    return np.where(above[..., None], wi, [0.0, 0.0, 1.0]), wo, weights


def _sine2(u: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """Squared sine of the GGX half vector below which the part `u` of them lies."""
    tangent2 = width**2 * u / (1.0 - u)
    return tangent2 / (1.0 + tangent2)


def _spherical(sine: NDArray[np.float64], phi: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1.0 - sine**2)], -1)


def _mirrored(wo: NDArray[np.float64], half: NDArray[np.float64]) -> NDArray[np.float64]:
    return 2.0 * (wo * half).sum(-1, keepdims=True) * half - wo


def _density(wi: NDArray[np.float64], wo: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """How densely directions toward the light lie that mirror the viewer in GGX half vectors."""
    half = wi + wo
    half = half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-12)
    cosine = half[..., 2]
    spread = width**2 / (np.pi * (cosine**2 * (width**2 - 1.0) + 1.0) ** 2)
    return spread * cosine / np.maximum(4.0 * np.abs((wo * half).sum(-1)), 1e-12)
