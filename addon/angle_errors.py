"""How far apart two ways to show a material are, by view angle, as Cycles would show them."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Directions of the light for a view angle: strata from the peak outward, and around it. What is
# isotropic is the same on both sides of the plane of incidence, so one side will do.
_OUTWARD, _AROUND = 24, 8
# Widths of the lobes that the light is drawn from, in those of the Principled BSDF, for peaks that
# are sharper.
_WIDTHS = (1.0, 0.25)
_NARROWEST = 1e-3


class Comparison:
    """Compares ways to show a record with an entry of its closures, at the entry's view angles."""

    def __init__(self, record: Any, entry: Mapping[str, Any]) -> None:
        self.angles = np.asarray(entry["by_view"]["view_angle"], float)
        self._record, self._entry = record, entry
        self._wi, self._wo, self._weights = _directions(
            np.radians(self.angles), record.principled["roughness"] ** 2
        )
        self._wanted = self._evaluate(entry["target"], entry)
        light = np.maximum(self._wanted.sum(-1), 0.0) * self._weights
        self._light = np.maximum(light.sum(1), 1e-12)

    def distances(self, kind: str, entry: Mapping[str, Any] | None) -> NDArray[np.float64]:
        """The L1 distance of a kind (of an entry, where it is baked) in parts of the light."""
        if entry is self._entry:
            return np.zeros_like(self.angles)
        off = np.abs(self._evaluate(kind, entry) - self._wanted).sum(-1)
        return (off * self._weights).sum(1) / self._light

    def _evaluate(self, kind: str, entry: Mapping[str, Any] | None) -> NDArray[np.float64]:
        from lobefit import _native

        directions = self._wi.reshape(-1, 3), self._wo.reshape(-1, 3)
        if entry is not None:
            values = _native.evaluate_closures(entry, *directions)
        elif kind == "principled":
            values = _native.evaluate_principled(self._record.principled, *directions)
        else:
            values = _native.evaluate_live(self._record.parameters, *directions)
        return values.reshape(self._wi.shape)


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
