"""Materials and the records they carry, read also where the compiled module cannot be loaded."""

import dataclasses
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy

from . import native
from .preferred import measured_folders

KEY = "lobefit_record"
# The schema of records that this Lobefit reads, as `lobefit.record.SCHEMA`.
SCHEMA = 1
# Which nodes a material was given: to be raised with any change of what is built of a record. A
# material without it is from before they were counted.
VERSION_KEY, VERSION = "lobefit_version", 1
# What the material shows: its kind and the number of its specular closures.
KIND_KEY, COUNT_KEY = "lobefit_kind", "lobefit_closures"
# The kinds that show closures of a record, which has them under these names.
BAKED = ("lobe", "measured")
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


def source_file(source: Mapping[str, Any]) -> str:
    """Where the file of a record's `source` is; empty where it is not found.

    If it is no longer where it was, or the record does not tell where (that of an asset), it is
    looked for by its name beside the .blend and in the folder that the preferences tell.
    """
    if not source["path"]:
        return ""
    folders = ((bpy.path.abspath("//"),) if bpy.data.filepath else ()) + measured_folders()
    others = [str(Path(folder) / Path(source["path"]).name) for folder in folders]
    return next((place for place in (source["path"], *others) if Path(place).is_file()), "")


def located(record: Any) -> Any:
    """The `lobefit.Record` with the place in it where its measured file is found now, if it is."""
    path = source_file(record.source)
    if path in ("", record.source["path"]):
        return record
    return dataclasses.replace(record, source=record.source | {"path": path})


def entries_of(material: bpy.types.Material | None) -> dict[str, Any] | None:
    """What stands in the record (RECORD.json) of a material, or None if nothing is to be read.

    It may be the record of a later version, or damaged: a file of a stranger may hold any text. It
    is not to be changed: who asks again gets the same.
    """
    text = None if material is None else material.get(KEY)
    return _parsed(text) if isinstance(text, str) else None


def record_of(material: bpy.types.Material | None) -> dict[str, Any] | None:
    """The entries of the record in a material that is understood, or None if there is none.

    Without the compiled module nothing is checked but that it is JSON.
    """
    entries = entries_of(material)
    if entries is None or native.problem():
        return entries
    return None if damage_of(material) else entries


def embed(material: bpy.types.Material, record: Any) -> None:
    """Puts a `lobefit.Record` into a material.

    It is checked here, where there is time, and not when its panel is first drawn: from 5 ms on
    Python lets a thread in that renders a preview, and Blender may then refuse for good what
    timers write ("Writing to ID classes in this context is not allowed").
    """
    material[KEY] = record.to_json()
    damage_of(material)


def damage_of(material: bpy.types.Material) -> str:
    """What is wrong with the record in a material, in a sentence; wants the compiled module."""
    return _damage(material[KEY], material.name)


# Panels ask several times as they are drawn, and are drawn often.
@lru_cache(maxsize=16)
def _damage(text: str, name: str) -> str:
    import lobefit

    try:
        lobefit.Record.from_json(text, name)
    except lobefit.InputError as error:
        return str(error)
    return ""


@lru_cache(maxsize=16)
def _parsed(text: str) -> dict[str, Any] | None:
    import json  # later than at Blender's start

    try:
        entries = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return entries if isinstance(entries, dict) else None


def has_bounces(material: bpy.types.Material) -> bool:
    """Whether light that bounced off a diffuse surface meets a diffuse closure only."""
    return bool(material.get(BOUNCES_KEY, False))


def is_simplified(material: bpy.types.Material) -> bool:
    """Whether the material can be shown again as before it was simplified."""
    return BEFORE_KEY in material and KEY in material


def result_of(scene: bpy.types.Scene) -> dict[str, Any] | None:
    """The last result of simplifying a scene, or None if there is none to be read."""
    import json

    try:
        return json.loads(scene[RESULT_KEY])
    except (KeyError, TypeError, ValueError):
        return None
