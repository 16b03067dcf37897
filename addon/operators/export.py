"""File > Export > Measured BRDFs: what the measured materials of the open file hold."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import bpy
from bpy.props import BoolProperty, StringProperty

from .. import native
from ..records import KEY
from .run import RunsWork

# What starts processes is loaded when it is used, so that Blender starts as soon as before.
if TYPE_CHECKING:
    from ..child import Child

_KINDS = ("records", "csv", "gltf", "usd")


class LOBEFIT_OT_export_measured(RunsWork, bpy.types.Operator):
    """Write records, parameters and Principled BSDFs of all measured materials to a folder"""

    bl_idname = "lobefit.export_measured"
    bl_label = "Export BRDFs"
    bl_options: ClassVar = {"REGISTER", "PRESET"}

    directory: StringProperty(
        name="Folder", subtype="DIR_PATH", options={"SKIP_SAVE"}, description="Where to write"
    )
    filter_folder: BoolProperty(
        default=True,
        options={"HIDDEN", "SKIP_SAVE"},
        description="Show folders only in the file browser",
    )
    records: BoolProperty(
        name="Records", default=True, description="A .json of each material, to build it again"
    )
    csv: BoolProperty(
        name="Parameters", default=True, description="A table of all parameters, parameters.csv"
    )
    gltf: BoolProperty(
        name="glTF", default=False, description="A .glb of each material's Principled BSDF"
    )
    usd: BoolProperty(
        name="USD", default=False, description="A .usdc of each material's Principled BSDF"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not any(KEY in material for material in bpy.data.materials):
            cls.poll_message_set("No material of the file was made from a measurement")
            return False
        return super().poll(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks for a folder."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        kinds = [f"--{kind}" for kind in _KINDS if getattr(self, kind)]
        if not self.directory or not kinds:
            return self.refuse("Expected a folder and what to write to it, found none chosen.")
        import tempfile

        from ..child import Child

        # The other Blender reads a file of the materials as they are now, saved or not.
        self._folder = tempfile.TemporaryDirectory(prefix="lobefit-")
        blend = str(Path(self._folder.name) / "materials.blend")
        bpy.data.libraries.write(blend, {item for item in bpy.data.materials if KEY in item})
        folder = bpy.path.abspath(self.directory)
        return self.start(context, Child(["export", blend, *kinds, "--json", "-o", folder]))

    def conclude(self, context: bpy.types.Context, work: "Child") -> set[str]:
        self._folder.cleanup()
        for problem in work.problems:
            self.report({"WARNING" if work.results else "ERROR"}, problem)
        if not work.results:
            return {"CANCELLED"}
        self.report({"INFO"}, f"{self.directory}: {len(work.results)} files")
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        for name in _KINDS:
            self.layout.prop(self, name)


def draw_menu(self: Any, context: bpy.types.Context) -> None:
    """The entry in File > Export."""
    self.layout.operator(
        LOBEFIT_OT_export_measured.bl_idname, text="Measured BRDFs", icon="MATERIAL"
    )
