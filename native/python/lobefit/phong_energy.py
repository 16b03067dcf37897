"""How much the lobes of Phong and modified Phong reflect, in closed form, and what normalises them.

The integrals are those of Mallett and Yuksel, "Constant-time energy-normalization for the Phong
specular BRDFs", 2020, for real exponents (native/reflectance/phong_energy.h).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lobefit import _native
from lobefit._native import InputError

LOBES = ("phong", "modified-phong")
MOST_EXPONENT = 1e12


@dataclass(frozen=True)
class Energy:
    """What a lobe reflects at a view angle: numbers, or arrays of the arguments' common shape.

    `integral` is that of (wr.wo)^n over the hemisphere of lights for the lobe `phong`, and of
    (wr.wo)^n cos(theta_i) for `modified-phong`. `by_exponent` and `by_angle` (per radian) are its
    derivatives. A lobe times `conserving` reflects all light at normal incidence and never more;
    times `normalising`, all light at this angle.
    """

    integral: Any
    by_exponent: Any
    by_angle: Any
    conserving: Any

    @property
    def normalising(self) -> Any:
        """The factor by which the lobe reflects all light at this angle."""
        return 1 / self.integral


def energy(lobe: str, exponent: ArrayLike, angle: ArrayLike) -> Energy:
    """The energy of a lobe of LOBES, exponents from 0 to 1e12 and view angles in degrees.

    Within 1e-13 of the exact integral. Raises InputError for what is out of range.
    """
    if lobe not in LOBES:
        raise InputError(f"lobe: expected {' or '.join(LOBES)}, found {lobe!r}.")
    exponents = _within("exponent", exponent, MOST_EXPONENT)
    angles = _within("angle", angle, 90)
    exponents, angles = np.broadcast_arrays(exponents, angles)
    modified = lobe == "modified-phong"
    columns = _native.phong_energy(modified, exponents.ravel(), angles.ravel()).T
    # The index () makes numbers of arrays without a dimension.
    figures = [column.reshape(exponents.shape)[()] for column in columns]
    return Energy(*figures, ((exponents + 1 + modified) / (2 * np.pi))[()])


def _within(name: str, values: ArrayLike, most: float) -> np.ndarray:
    array = np.asarray(values, float)
    out = array[~((array >= 0) & (array <= most))]
    if out.size:
        raise InputError(f"{name}: expected 0 to {most:g}, found {out.flat[0]:g}.")
    return array
