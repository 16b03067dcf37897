"""Lobefit: measured reflectance as one modified Phong lobe, with the error stated.

    import lobefit
    record = lobefit.fit("nickel.binary")      # the interpolated lobe of Nielsen et al., eq. 3
    print(record.parameters, record.error["relative_l1"]["pooled"])
    record.save("nickel.json")

Nothing here needs Blender; materials are built from a record by the package `lobefit_addon`.
"""

from lobefit._native import Cancelled, InputError, Measurement
from lobefit._native import version as __version__
from lobefit.classic import ExponentMatch, match_exponent
from lobefit.fitting import Closures, Job, closures, closures_for, fit, read, start_fit
from lobefit.phong_energy import Energy, energy
from lobefit.record import Record

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
