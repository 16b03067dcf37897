"""What Cycles shows of a record, as formulas: a pair of the way and of what it draws.

("live", parameters), ("principled", a record's `principled`) or ("closures", an entry of a record's
`closures`), as `_native.preview` takes them.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lobefit import _native

Shown = tuple[str, Mapping[str, Any]]
Directions = NDArray[np.float64]
Albedo = Sequence[float | None]  # of three channels

_EVALUATE: dict[str, Callable[..., NDArray[np.float64]]] = {
    "live": _native.evaluate_live,
    "principled": _native.evaluate_principled,
    "closures": _native.evaluate_closures,
}


def evaluate(shown: Shown, wi: Directions, wo: Directions) -> NDArray[np.float64]:
    """f cos(theta_i) as Cycles renders it, (N, 3), for unit vectors (N, 3) with n = +z."""
    kind, what = shown
    return _EVALUATE[kind](what, wi, wo)


def reflectance(shown: Shown, wi: Directions, wo: Directions) -> NDArray[np.float64]:
    """f in 1/sr, (N, 3); unknown (NaN) for light below the horizon."""
    cosine = wi[:, 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(cosine > 0, evaluate(shown, wi, wo) / cosine, np.nan)


def excess(
    view_angle: Sequence[float], measured: Sequence[Albedo], shown: Sequence[Albedo] = ()
) -> str:
    """Says where more light is reflected than arrives, as some measurements do; empty if nowhere.

    The albedos are three channels, None where they are not known, for each view angle in degrees;
    `shown` is empty where it is not known what Cycles shows.
    """
    most, angle = _largest(view_angle, measured)
    if most <= 1:
        return ""
    told = f"The measurement reflects {most:.1%} of the light seen at {angle:.0f} degrees"
    if not shown:
        return f"{told}."
    most, _ = _largest(view_angle, shown)
    # What is capped is so but for the last digits.
    return f"{told}, the material at most {min(most, 1.0) if most < 1.001 else most:.1%}."


def _largest(view_angle: Sequence[float], albedos: Sequence[Albedo]) -> tuple[float, float]:
    """The largest channel of all, and at which view angle it is."""
    known = [
        (value, angle)
        for angle, rgb in zip(view_angle, albedos, strict=True)
        for value in rgb
        if value is not None
    ]
    return max(known, default=(0.0, 0.0))
