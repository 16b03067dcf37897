"""Measured reflectance as Blender materials: the extension `lobefit`.

The wheel carries the same folder as the package `lobefit_addon`, which builds materials without
being registered: `lobefit_addon.build_material(record)`.
"""

from . import cli, native, operators, panels, preferences
from .nodes.material import build_material

__all__ = ["build_material", "register", "unregister"]


def register() -> None:
    """Adds the operators, panels and the command; a missing compiled module is no obstacle."""
    native.problem.cache_clear()
    operators.register()
    panels.register()
    preferences.register()
    cli.register()


def unregister() -> None:
    """Removes all of it, and ends a fit that is under way."""
    cli.unregister()
    preferences.unregister()
    panels.unregister()
    operators.unregister()
