"""What the user prefers: where files are, and options that follow the preferences.

An option follows them until the user chooses it; Blender then remembers the choice until it quits.
"""

from pathlib import Path
from typing import Any

import bpy

# The options that the preferences have values for, by the same names.
_NAMES = ("kind", "threads")


def take_preferred(options: Any) -> None:
    """Gives options that nobody has chosen yet the values that the preferences tell.

    `options` is an operator or its last properties. What it does not know is left out.
    """
    options = getattr(options, "properties", options)
    for name in _NAMES if _preferences() else ():
        value = getattr(_preferences(), name)
        known = options.bl_rna.properties.get(name)
        items = getattr(known, "enum_items", ())
        if known and not options.is_property_set(name) and (not items or value in items):
            setattr(options, name, value)


def forget_chosen(context: bpy.types.Context) -> None:
    """Lets all operators follow the preferences again."""
    for name in dir(bpy.ops.lobefit):
        options = context.window_manager.operator_properties_last(f"lobefit.{name}")
        for option in _NAMES:
            if options is not None and option in options.bl_rna.properties:
                options.property_unset(option)


def measured_folders() -> tuple[str, ...]:
    """Where measured files may be found that are not where they were."""
    folder = _preferences() and _preferences().measured_folder
    return (bpy.path.abspath(folder),) if folder else ()


def library_folder(beside: Path) -> Path:
    """Where to write an asset library of the measured files of a folder."""
    folder = _preferences() and _preferences().library_folder
    return Path(bpy.path.abspath(folder)) if folder else beside


def _preferences() -> Any:
    """The extension's preferences; None where it is not enabled, as in Python without Blender."""
    addon = bpy.context.preferences.addons.get(__package__)
    return addon and addon.preferences
