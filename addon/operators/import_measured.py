"""File > Import > Measured BRDF, and the same by dropping files on a window."""

from pathlib import Path
from typing import ClassVar

import bpy
from bpy.props import BoolProperty, CollectionProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ..jobs import Outcome
from ..nodes.material import build_material
from ..properties import draw_fit_options
from .run import RunsFits

MEASURED_SUFFIXES = (".binary", ".bsdf")
MEASURED_GLOB = ";".join(f"*{suffix}" for suffix in MEASURED_SUFFIXES)
GLOB_DESCRIPTION = "Which files the file browser shows"


class ChoosesFiles(ImportHelper):
    """What operators have in common that ask for several files of a folder."""

    directory: StringProperty(
        name="Folder",
        subtype="DIR_PATH",
        options={"HIDDEN", "SKIP_SAVE"},
        description="Where the files are",
    )
    files: CollectionProperty(
        name="Files",
        type=bpy.types.OperatorFileListElement,
        options={"HIDDEN", "SKIP_SAVE"},
        description="The names of the files in the folder",
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks for files, unless they were dropped."""
        if self.directory:
            return self.execute(context)
        return ImportHelper.invoke(self, context, event)

    def chosen(self) -> list[Path]:
        """The files that were chosen; none where only a folder was."""
        folder = Path(bpy.path.abspath(self.directory))
        names = [folder / item.name for item in self.files if item.name]
        if names or not Path(self.filepath).name:
            return names
        return [Path(bpy.path.abspath(self.filepath))]


class LOBEFIT_OT_import_measured(RunsFits, bpy.types.Operator, ChoosesFiles):
    """Fit measured reflectance files and make a material of each"""

    bl_idname = "lobefit.import_measured"
    bl_label = "Import BRDF"
    bl_options: ClassVar = {"REGISTER", "PRESET"}

    filename_ext = ".binary"
    filter_glob: StringProperty(
        default=MEASURED_GLOB, options={"HIDDEN"}, description=GLOB_DESCRIPTION
    )
    assign: BoolProperty(
        name="Assign to Object",
        default=True,
        description="Put the first material into the active object's active slot",
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        paths = self.chosen()
        if not paths:
            return self.refuse("Expected at least one measured file, found none chosen.")
        return self.fit(context, list(map(str, paths)))

    def apply(self, context: bpy.types.Context, done: list[Outcome]) -> str:
        options = self.material_options()
        materials = [build_material(outcome.record, **options) for outcome in done]
        target = context.active_object if self.assign else None
        if target is not None and hasattr(target.data, "materials") and target.is_editable:
            target.active_material = materials[0]
        for material in materials:
            # A material without a user would be lost when the file is saved.
            material.use_fake_user = material.users == 0
        return ""

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        draw_fit_options(self.layout, self)
        self.layout.prop(self, "assign")


class LOBEFIT_FH_measured(bpy.types.FileHandler):
    """Files of measured reflectance that are dropped on a window"""

    bl_idname = "LOBEFIT_FH_measured"
    bl_label = "Measured BRDF"
    bl_import_operator = LOBEFIT_OT_import_measured.bl_idname
    bl_file_extensions = ";".join(MEASURED_SUFFIXES)

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type in {"VIEW_3D", "PROPERTIES"}


def draw_menu(self, context: bpy.types.Context) -> None:
    """The entry in File > Import."""
    self.layout.operator(
        LOBEFIT_OT_import_measured.bl_idname, text="Measured BRDF (.binary, .bsdf)", icon="MATERIAL"
    )
