"""What a report of a problem has to tell: versions, machine, and whether a small fit works."""

import math
import platform
import sys
import tempfile
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from lobefit import _native
from lobefit.fitting import closures
from lobefit.origin import write_samples
from lobefit.record import VISUAL_NORM, this_machine

_SAMPLE = "nickel"


@dataclass(frozen=True)
class Check:
    """A figure of the self-test beside the known one; `tolerance` is a part of `expected`."""

    name: str
    expected: float
    tolerance: float
    found: float

    @property
    def passed(self) -> bool:
        """Whether the figure is the known one."""
        return math.isclose(self.found, self.expected, rel_tol=self.tolerance)

    def __str__(self) -> str:
        tolerance = f" +- {self.tolerance:.1%}" if self.tolerance else ""
        verdict = "passed" if self.passed else "FAILED"
        return f"{verdict}, {self.name}: {self.found:.7g}, expected {self.expected:.7g}{tolerance}"


@dataclass(frozen=True)
class Diagnosis:
    """Facts by their name, None for what is not there, and what became of the self-test.

    `problem` is what ended the self-test early; there are no `checks` then.
    """

    facts: dict[str, Any]
    checks: list[Check]
    problem: str = ""

    @property
    def passed(self) -> bool:
        """Whether the self-test ran to its end and every figure is the known one."""
        return not self.problem and all(check.passed for check in self.checks)

    def __str__(self) -> str:
        told = [(name, "none" if fact is None else fact) for name, fact in self.facts.items()]
        told += [("self-test", f"FAILED, {self.problem}")] if self.problem else []
        told += [("self-test", check) for check in self.checks]
        return "\n".join(f"{name:14} {value}" for name, value in told)

    def entries(self) -> dict[str, Any]:
        """The same for JSON."""
        checks = [{**asdict(check), "passed": check.passed} for check in self.checks]
        test = {"passed": self.passed, "problem": self.problem or None, "checks": checks}
        return {**self.facts, "self-test": test}


def diagnose() -> Diagnosis:
    """Versions, machine and module, and a self-test of some seconds; never raises."""
    facts = _facts()
    try:
        return Diagnosis(facts, _checks())
    except Exception as failure:  # Whatever it is, it is what the report is about.
        return Diagnosis(facts, [], f"{type(failure).__name__}: {failure}")


def _facts() -> dict[str, Any]:
    machine = this_machine()
    return {
        "Lobefit": machine["version"],
        "build": machine["build"],
        "module": _without_home(_native.__file__),
        "Python": platform.python_version(),
        "NumPy": np.__version__,
        "Blender": _blender(),
        "system": machine["system"],
        "processor": machine["processor"],
        "threads": machine["threads"],
        "instructions": "AVX2" if _native.uses_avx2() else "baseline",
    }


def _without_home(path: str) -> str:
    """A path that can be shown to others: a home folder has its user's name."""
    place, home = Path(path), Path.home()
    return str(Path("~") / place.relative_to(home)) if place.is_relative_to(home) else path


def _blender() -> str | None:
    """Blender's version: of this program, or of its Python module, which takes time to import."""
    bpy = sys.modules.get("bpy")
    if bpy is not None:
        return bpy.app.version_string
    try:
        return metadata.version("bpy")
    except metadata.PackageNotFoundError:
        return None


def _checks() -> list[Check]:
    """Writes a sample, reads it, fits it and finds closures."""
    with tempfile.TemporaryDirectory(prefix="lobefit-") as folder:
        (path,) = write_samples(folder, [_SAMPLE])
        record = closures(path, norm=VISUAL_NORM, count=2)
    # Rounding, which the processor's instructions decide, moves the error of a fit by parts in a
    # million. It may lead the search for closures to another of several near-equal optima.
    return [
        Check("valid bins", 1_096_216, 0, record.source["bins"]["valid"]),
        Check("error of the fit", 0.2977, 0.001, record.error["relative_l1_cosine"]["pooled"]),
        Check("error of two closures", 0.00704, 0.1, record.closures[0]["error"]),
    ]
