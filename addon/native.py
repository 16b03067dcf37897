"""Finds the compiled module `lobefit`, or says in one sentence what is wrong with it."""

import functools
import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

_HERE = Path(__file__).parent


@functools.cache
def problem() -> str:
    """What keeps the compiled module from being used and what to do; empty when it can be used."""
    try:
        module = importlib.import_module("lobefit")
        compiled = importlib.import_module("lobefit._native")
    except ModuleNotFoundError:
        return (
            f"The compiled part of Lobefit for {_this_python()} is not installed: install the "
            "Lobefit package for this platform and Blender release."
        )
    except (ImportError, OSError) as failure:
        return (
            f"The compiled part of Lobefit does not load on this system ({_one_line(failure)}): "
            "install the Lobefit package for this platform and Blender release."
        )
    found = {"version": module.__version__, "build_id": compiled.build_id}
    for key, wanted in own_identity().items():
        if found[key] != wanted:
            return (
                f"Lobefit's add-on is of {key.replace('_', ' ')} {wanted[:12]} and its compiled "
                f"part of {found[key][:12]}: restart Blender, and if that does not help remove "
                "Lobefit and install it again."
            )
    return ""


def needed(execute: Callable[[Any, Any], set[str]]) -> Callable[[Any, Any], set[str]]:
    """Makes an operator's `execute` only report what keeps the module from being used, if so."""

    @functools.wraps(execute)
    def checked(self: Any, context: Any) -> set[str]:
        if problem():
            self.report({"ERROR"}, problem())
            return {"CANCELLED"}
        return execute(self, context)

    return checked


def own_identity() -> dict[str, str]:
    """The version of the add-on and, where it was packaged, the build it was packaged with."""
    import json  # later than at Blender's start
    import tomllib

    manifest = tomllib.loads((_HERE / "blender_manifest.toml").read_text(encoding="utf-8"))
    identity = {"version": manifest["version"]}
    build = _HERE / "build.json"
    if build.is_file():
        identity |= json.loads(build.read_text(encoding="utf-8"))
    return identity


def _this_python() -> str:
    import platform

    return f"Python {sys.version_info[0]}.{sys.version_info[1]} on {platform.machine()}"


def _one_line(failure: Exception) -> str:
    return " ".join(str(failure).split()).rstrip(".")
