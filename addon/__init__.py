"""Measured reflectance as Blender materials: the extension `lobefit`.

The wheel carries the same folder as the package `lobefit_addon`, which builds materials without
being registered: `lobefit_addon.build_material(record)`.
"""

from typing import Any

import bpy

from . import cli, native, nodes, operators, panels, preferences

_BUILDERS = ("add_to_tree", "build_material", "fill_material")
__all__ = [*_BUILDERS, "register", "unregister"]


def __getattr__(name: str) -> Any:
    if name not in _BUILDERS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(nodes.material, name)


def register() -> None:
    """Adds the operators, panels and the command; a missing compiled module is no obstacle."""
    native.problem.cache_clear()
    operators.register()
    panels.register()
    preferences.register()
    cli.register()
    # Soon after Blender's start, so that no panel has to load it while it is drawn (records.embed).
    bpy.app.timers.register(_load)


def unregister() -> None:
    """Removes all of it, and ends a fit that is under way."""
    if bpy.app.timers.is_registered(_load):
        bpy.app.timers.unregister(_load)
    cli.unregister()
    preferences.unregister()
    panels.unregister()
    operators.unregister()


def _load() -> None:
    """Loads the compiled module, or finds out what keeps it from being used."""
    native.problem()
