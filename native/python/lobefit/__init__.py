"""Lobefit: measured reflectance as one modified Phong lobe, with the error stated.

    import lobefit
    record = lobefit.fit("nickel.binary")      # the interpolated lobe of Nielsen et al., eq. 3
    print(record.parameters, record.error["relative_l1"]["pooled"])
    record.save("nickel.json")

Nothing here needs Blender; materials are built from a record by the package `lobefit_addon`.
"""

import importlib
from typing import TYPE_CHECKING, Any

from lobefit._native import Cancelled, InputError, Measurement
from lobefit._native import version as __version__
from lobefit.fitting import Closures, Job, closures, closures_for, fit, read, start_fit
from lobefit.record import Record

if TYPE_CHECKING:
    from lobefit.classic import ExponentMatch, match_exponent
    from lobefit.phong_energy import Energy, energy

__all__ = [
    "Cancelled",
    "Closures",
    "Energy",
    "ExponentMatch",
    "InputError",
    "Job",
    "Measurement",
    "Record",
    "__version__",
    "closures",
    "closures_for",
    "energy",
    "fit",
    "match_exponent",
    "read",
    "start_fit",
]

# What needs NumPy, by its module: loading it takes longer than all the rest, and Blender's window
# would stand still that long.
_WITH_NUMPY = {
    "Energy": "phong_energy",
    "ExponentMatch": "classic",
    "energy": "phong_energy",
    "match_exponent": "classic",
}


def __getattr__(name: str) -> Any:
    if name not in _WITH_NUMPY:
        raise AttributeError(f"module 'lobefit' has no attribute '{name}'")
    return getattr(importlib.import_module(f"lobefit.{_WITH_NUMPY[name]}"), name)
