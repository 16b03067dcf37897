"""The classic reflection model: Blinn-Phong's exponent for one of Phong's, and fits shown by it.

The model is that of native/reflectance/classic.h: ambient, diffuse and specular terms, the last one
a power of R.V (`classic-phong`) or of N.H (`classic-blinn-phong`), without a cosine.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lobefit import _native
from lobefit._native import InputError

MODELS = ("classic-phong", "classic-blinn-phong")
LEAST_EXPONENT, MOST_EXPONENT = 0.1, 1e8


@dataclass(frozen=True)
class ExponentMatch:
    """Blinn-Phong's exponent nearest to one of Phong's.

    `error` is the integral of the absolute difference of both terms over that of Phong's, and
    `error_of_four` the same for four times Phong's exponent.
    """

    exponent: float
    error: float
    error_of_four: float


def match_exponent(exponent: float, angle: float | None = None) -> ExponentMatch:
    """The exponent with which Blinn-Phong's specular term is nearest in L1 to that of Phong's.

    `exponent` is from 0.1 to 1e8. All lights count alike: at a view angle in degrees from the
    normal, or, without one, over the pixels of spheres lit from everywhere. Within 0.2 %. Raises
    InputError for what is out of range.
    """
    if not LEAST_EXPONENT <= exponent <= MOST_EXPONENT:
        raise InputError(
            f"exponent: expected {LEAST_EXPONENT:g} to {MOST_EXPONENT:g}, found {exponent:g}."
        )
    if angle is not None and not 0 <= angle <= 90:
        raise InputError(f"angle: expected 0 to 90 degrees, found {angle:g}.")
    return ExponentMatch(**_native.match_exponent(exponent, angle))


def as_classic(parameters: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """A fit's parameters as classic materials, by their model: k_d, k_s and the exponent.

    Where light, viewer and normal agree they show what the fit does under lights of i_d = i_s, its
    Fresnel reflectance included. Blinn-Phong's exponent is matched to Phong's.
    """
    diffuse = np.broadcast_to(parameters["diffuse"], 3)
    facing = _native.evaluate_model(dict(parameters), [[0, 0, 1]], [[0, 0, 1]])[0]
    # Of modified Blinn-Phong's N.H, four times as high a power is Phong's (model.h).
    scale = 4 if parameters["model"] == "modified-blinn-phong" else 1
    exponents = np.clip(np.divide(parameters["exponent"], scale), LEAST_EXPONENT, MOST_EXPONENT)
    matched = [match_exponent(float(exponent)).exponent for exponent in np.ravel(exponents)]
    same = {
        "diffuse": diffuse.tolist(),
        "specular": np.maximum(np.pi * facing - diffuse, 0).tolist(),
    }
    powers = exponents.tolist(), matched if exponents.ndim else matched[0]
    return {
        model: {"model": model, **same, "exponent": power}
        for model, power in zip(MODELS, powers, strict=True)
    }
