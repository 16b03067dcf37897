"""The ways to show a record's measurement: what each costs, and how far off it is by view angle.

The nearest that a record has to its measurement is what the other ways are compared with.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .angle_errors import Comparison
from .nodes.baked import is_black
from .nodes.material import PRINCIPLED_COST
from .scene_view import DEGREES

# What kinds cost, in specular closures (README, "Error against run time").
DIFFUSE_COST, LIVE_COST = 0.25, 5.0

_ANGLES = np.arange(DEGREES) + 0.5


@dataclass(frozen=True, eq=False)
class Way:
    """A way to show a material: a kind and, for a baked one, the record's entry it shows.

    `cost` is in closures. `by_angle` is at most the part of the light that is off at each degree
    from the normal, and `added` how far the way is from the nearest one there.
    """

    kind: str
    closures: Mapping[str, Any] | None
    cost: float
    by_angle: NDArray[np.float64]
    added: NDArray[np.float64]

    @property
    def count(self) -> int:
        """By which count the record names the closures; 0 for kinds without."""
        return 0 if self.closures is None else self.closures["count"]


def ways_of(record: Any) -> tuple[Way, ...]:
    """All ways to show a record's measurement, as far as their error is known."""
    known = [source for source in _sources(record) if np.isfinite(source.error)]
    nearest = min(_measured(record), key=lambda entry: entry["error"], default=None)
    if nearest is None:
        least = min(source.error for source in known)
        return tuple(_even_way(source, least) for source in known)
    comparison = Comparison(record, nearest)
    return tuple(_compared_way(source, comparison, nearest) for source in known)


def albedo_of(record: Any) -> NDArray[np.float64]:
    """The part of the light that the measurement reflects, by degree of the view angle."""
    if measured := _measured(record):
        table = measured[0]["by_view"]
        angles, albedos = table["view_angle"], table["target_albedo"]
    else:
        angles, albedos = record.albedo["view_angle"], record.albedo["measured"]
    known = [
        (angle, np.mean(rgb)) for angle, rgb in zip(angles, albedos, strict=True) if None not in rgb
    ]
    return _at_angles(*zip(*known, strict=True)) if known else np.ones(DEGREES)


def _measured(record: Any) -> list[Mapping[str, Any]]:
    return [entry for entry in record.closures if entry["target"] == "measured"]


class _Source(NamedTuple):
    """What a record itself says of a way; `error` is that over all angles."""

    kind: str
    closures: Mapping[str, Any] | None
    cost: float
    error: float


def _sources(record: Any) -> list[_Source]:
    """All ways of a record; an error that is not known is infinite."""
    fit_error = _known(record.error["relative_l1_cosine"]["pooled"])
    # The error of closures made for the fitted lobe comes on top of the fit's own.
    beneath = {"measured": 0.0, "lobe": fit_error}
    baked = [
        _Source(entry["target"], entry, _cost(entry), entry["error"] + beneath[entry["target"]])
        for entry in record.closures
    ]
    return [
        *baked,
        _Source("principled", None, PRINCIPLED_COST, _known(record.principled["error"])),
        _Source("live", None, LIVE_COST, fit_error),
    ]


def _known(error: float | None) -> float:
    return np.inf if error is None else error


def _cost(entry: Mapping[str, Any]) -> float:
    drawn = sum(not is_black(specular["weight"]) for specular in entry["specular"])
    return drawn + DIFFUSE_COST * (not is_black(entry["diffuse"]))


def _compared_way(source: _Source, comparison: Comparison, nearest: Mapping[str, Any]) -> Way:
    """A way beside the nearest one, which is itself off from the measurement."""
    kind, entry, cost, _ = source
    added = comparison.distances(kind, entry)
    if kind == "measured":
        off = entry["by_view"]["relative_error"]
    else:
        off = added + nearest["by_view"]["relative_error"]
    angles = comparison.angles
    return Way(kind, entry, cost, _at_angles(angles, off), _at_angles(angles, added))


def _even_way(source: _Source, least: float) -> Way:
    """A way with nothing to compare it with: it is taken to be off by the same at every angle."""
    kind, entry, cost, error = source
    even = np.ones(DEGREES)
    return Way(kind, entry, cost, even * error, even * (error - least))


def _at_angles(angles: Sequence[float], values: Sequence[float]) -> NDArray[np.float64]:
    """Values between those at some view angles, and beyond them the outermost."""
    order = np.argsort(angles)
    return np.interp(_ANGLES, np.asarray(angles)[order], np.asarray(values, float)[order])
