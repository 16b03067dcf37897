"""Finds the measured file of a material again that is no longer where it was."""

import itertools
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import bpy
from bpy.props import BoolProperty, StringProperty

from .. import native
from ..locks import lock_of
from ..preferred import measured_folders
from ..records import KEY, active_material, record_of, source_file
from .import_measured import GLOB_DESCRIPTION, MEASURED_GLOB
from .polls import poll_changeable, poll_measured

_MOST_FILES = 20000  # that are looked at below a folder


class LOBEFIT_OT_relink(bpy.types.Operator):
    """Tell where the measured file of the active material is now; it has to be the one fitted"""

    bl_idname = "lobefit.relink"
    bl_label = "Find Measured File"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    filepath: StringProperty(
        name="File",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
        description="The measured file, or a folder to look for it in and below",
    )
    filter_glob: StringProperty(
        default=MEASURED_GLOB, options={"HIDDEN"}, description=GLOB_DESCRIPTION
    )
    all_materials: BoolProperty(
        name="All Materials",
        default=True,
        description="Also those files of other materials that are found in the same folder",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = active_material(context)
        return poll_measured(cls, context) and poll_changeable(cls, [material], lock_of)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks for the file, where it is not in the folder that the preferences tell."""
        wanted = record_of(active_material(context))["source"]
        if native.problem() == "" and not self.filepath:
            found = (_find(_files_below(Path(folder)), wanted) for folder in measured_folders())
            self.filepath = next(filter(None, found), "")
        if self.filepath:
            return self.execute(context)
        self.filepath = Path(wanted["path"] or "").name
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        place = Path(bpy.path.abspath(self.filepath))
        material = active_material(context)
        source = record_of(material)["source"]
        if place.is_dir():
            path = _find(_files_below(place), source)
            expected = "the measured file of the record in or below it"
        else:
            path, expected = str(place), "the file that was fitted"
        if not self.filepath or not path or not Path(path).exists():
            self.report({"ERROR"}, f"{place}: expected {expected}, found no such file.")
            return {"CANCELLED"}
        if not _is_file_of(path, source):
            self.report(
                {"ERROR"},
                f"{path}: expected the file that was fitted, found another one; Fit makes the "
                "material anew from it.",
            )
            return {"CANCELLED"}
        linked = [material]
        _set_path(material, path)
        if self.all_materials:
            linked += _link_others(material, place if place.is_dir() else place.parent)
        names = ", ".join(item.name for item in linked)
        self.report({"INFO"}, f"Found the measured files of {names}")
        return {"FINISHED"}


def _link_others(material: bpy.types.Material, folder: Path) -> list[bpy.types.Material]:
    """Tells the other materials whose files are not found where theirs are now."""
    linked, files = [], _files_below(folder)
    for other in bpy.data.materials:
        record = None if other == material or lock_of(other) else record_of(other)
        if record is not None and not source_file(record["source"]):
            path = _find(files, record["source"])
            if path:
                _set_path(other, path)
                linked.append(other)
    return linked


def _find(files: Mapping[str, Sequence[str]], source: dict) -> str:
    """The file of a record among `files`, by its name and its bytes; empty if none is."""
    places = files.get(Path(source["path"] or "").name, ())
    return next((place for place in places if _is_file_of(place, source)), "")


def _files_below(folder: Path) -> dict[str, list[str]]:
    """Where files are, in a folder and below it, by their names."""
    places: dict[str, list[str]] = {}
    found = (Path(place, name) for place, _, names in os.walk(folder) for name in names)
    for path in itertools.islice(found, _MOST_FILES):
        places.setdefault(path.name, []).append(str(path))
    return places


def _is_file_of(path: str, source: dict) -> bool:
    from lobefit.origin import is_unchanged

    return is_unchanged(source | {"path": path})


def _set_path(material: bpy.types.Material, path: str) -> None:
    import json

    record = json.loads(material[KEY])
    record["source"]["path"] = str(Path(path).absolute())
    material[KEY] = json.dumps(record, allow_nan=False) + "\n"
