"""Node trees for Cycles: the formulas as nodes, and the materials made of them.

Each module is loaded when it is first asked for (`nodes.live`), not when the package is: Blender's
start does not wait for what no material may need.
"""

import importlib
from types import ModuleType

_MODULES = (
    "baked",
    "classic",
    "live",
    "live_energy",
    "material",
    "parameters",
    "principled",
    "scene_lights",
    "tree",
    "versions",
)


def __getattr__(name: str) -> ModuleType:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return importlib.import_module(f".{name}", __name__)
