"""What Cycles shows of a record, as formulas: a pair of the way and of what it draws.

("live", parameters), ("principled", a record's `principled`) or ("closures", an entry of a record's
`closures`), as `_native.preview` takes them.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lobefit import _native

Shown = tuple[str, Mapping[str, Any]]
Directions = NDArray[np.float64]

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
