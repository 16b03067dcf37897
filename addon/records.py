"""Materials and the records they carry, read also where the compiled module cannot be loaded."""

import json
from functools import lru_cache
from typing import Any

import bpy

from . import native

KEY = "lobefit_record"
# What the material shows: its kind and the number of its specular closures.
KIND_KEY, COUNT_KEY = "lobefit_kind", "lobefit_closures"
# Whether light that bounced off a diffuse surface meets a diffuse closure only.
BOUNCES_KEY = "lobefit_diffuse_bounces"
# What a simplified material showed before, as the options of `fill_material`.
BEFORE_KEY = "lobefit_before"
# The last result of simplifying a scene, kept with the scene.
RESULT_KEY = "lobefit_simplified"


def active_material(context: bpy.types.Context) -> bpy.types.Material | None:
    """The material of the editor, which may be pinned, or else of the active object."""
    material = getattr(context, "material", None)
    if material is None and context.active_object is not None:
        material = context.active_object.active_material
    return material


def record_of(material: bpy.types.Material | None) -> dict[str, Any] | None:
    """The entries of the record (RECORD.json) in a material, or None if it has none to be read."""
    text = None if material is None else material.get(KEY)
    return _entries(text) if isinstance(text, str) else None


@lru_cache(maxsize=16)
def _entries(text: str) -> dict[str, Any] | None:
    # A file of a stranger may hold any text. Without the compiled module nothing is checked but
    # that it is JSON.
    try:
        if not native.problem():
            from lobefit import Record

            Record.from_json(text)
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def is_simplified(material: bpy.types.Material) -> bool:
    """Whether the material can be shown again as before it was simplified."""
    return BEFORE_KEY in material and KEY in material


def result_of(scene: bpy.types.Scene) -> dict[str, Any] | None:
    """The last result of simplifying a scene, or None if there is none to be read."""
    try:
        return json.loads(scene[RESULT_KEY])
    except (KeyError, TypeError, ValueError):
        return None
