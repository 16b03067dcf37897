"""Cheaper alterations of Phong's specular term: how far off, and how long they take.

The terms are those of native/preview/phong_terms.h, at the normals of a sphere that a distant light
at 45 degrees from a distant viewer falls on. All values lie between 0 and 1.
"""

import csv
import io
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lobefit import _native

TITLES = {
    "exact": "exact, by pow",
    "half-vector": "half vector, exponent 4 s",
    "dot": "1 - R.V",
    "difference": "|R - V|^2 / 2",
    "cross": "|R x V|^2 / 2",
}
# Those that are squared; the exponents are the powers of (1 - beta lambda).
SQUARED = ("dot", "difference", "cross")
GAMMAS = (4, 8, 16, 32)
EXPONENTS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
# What a picture of 8 bits a channel tells apart.
STEP = 1 / 255
# Normals that were interpolated over a coarse mesh and not made of unit length again.
SHORT = 0.99

_SIDE = 160  # of the picture of the sphere, in pixels
_ROUNDS = 7
_VIEWER, _LIGHT = (0.0, 0.0, 1.0), (0.5**0.5, 0.0, 0.5**0.5)


@dataclass(frozen=True)
class Alteration:
    """A term with an exponent and a gamma (None for those without).

    `worst` and `mean` are of the difference to the exact term in double precision, `short` is the
    worst for normals that are 1 % too short; `nanoseconds` are those of an evaluation, the least of
    some rounds, one by one and in lanes.
    """

    term: str
    gamma: int | None
    exponent: float
    worst: float
    mean: float
    short: float
    one_by_one: float
    in_lanes: float


def measure(exponents: Sequence[float] = EXPONENTS) -> list[Alteration]:
    """Every term with every gamma and exponent; it takes about a second."""
    normals = _sphere()
    return [
        _measured(term, gamma, exponent, normals)
        for exponent in exponents
        for term in TITLES
        for gamma in (GAMMAS if term in SQUARED else (None,))
    ]


def table(alterations: Sequence[Alteration]) -> str:
    """A line for each, as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = list(Alteration.__dataclass_fields__)
    writer.writerow(names)
    writer.writerows([getattr(each, name) for name in names] for each in alterations)
    return text.getvalue()


def _sphere() -> NDArray[np.float32]:
    place = (np.arange(_SIDE) + 0.5) / _SIDE * 2 - 1
    x, y = (each.ravel() for each in np.meshgrid(place, place))
    seen = x**2 + y**2 < 1
    x, y = x[seen], y[seen]
    return np.stack([x, y, np.sqrt(1 - x**2 - y**2)]).astype(np.float32)


def _exact(exponent: float, normals: NDArray[np.float32]) -> NDArray[np.float64]:
    n = normals.astype(float)
    n /= np.linalg.norm(n, axis=0)
    facing = np.array(_LIGHT) @ n
    cosine = 2 * facing * (np.array(_VIEWER) @ n) - np.dot(_LIGHT, _VIEWER)
    return np.where(facing > 0, np.maximum(cosine, 0) ** exponent, 0)


def _measured(
    term: str, gamma: int | None, exponent: float, normals: NDArray[np.float32]
) -> Alteration:
    def terms(at: NDArray[np.float32], lanes: bool) -> NDArray[np.float32]:
        return _native.phong_terms(term, exponent, gamma or GAMMAS[0], _LIGHT, _VIEWER, at, lanes)

    def nanoseconds(lanes: bool) -> float:
        least = min(_seconds(lambda: terms(normals, lanes)) for _ in range(_ROUNDS))
        return least * 1e9 / normals.shape[1]

    exact = _exact(exponent, normals)
    off = np.abs(terms(normals, True) - exact)
    short = np.abs(terms(np.float32(SHORT) * normals, True) - exact).max()
    return Alteration(
        term,
        gamma,
        exponent,
        float(off.max()),
        float(off.mean()),
        float(short),
        nanoseconds(False),
        nanoseconds(True),
    )


def _seconds(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began
