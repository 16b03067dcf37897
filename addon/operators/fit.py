"""Fits the active material anew, and cancels a fit."""

from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import bpy
from bpy.props import StringProperty

from .. import native, nodes
from ..locks import lock_of
from ..records import active_material, record_of, source_file
from .import_measured import GLOB_DESCRIPTION, MEASURED_GLOB
from .polls import poll_changeable, poll_measured
from .preview import draw_spheres
from .run import RunsFits, current

if TYPE_CHECKING:  # It is loaded when it is used: Blender starts as soon as before.
    from ..jobs import Outcome


class LOBEFIT_OT_fit(RunsFits, bpy.types.Operator):
    """Fit the active material anew from the file it was measured in"""

    bl_idname = "lobefit.fit"
    bl_label = "Fit Measured BRDF"
    bl_options: ClassVar = {"REGISTER"}

    filepath: StringProperty(
        name="File",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
        description="The measured file; if empty, the one of the record",
    )
    filter_glob: StringProperty(
        default=MEASURED_GLOB, options={"HIDDEN"}, description=GLOB_DESCRIPTION
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        # All nodes are made anew: it is no matter what they were, or whether there were any.
        return (
            poll_measured(cls, context)
            and poll_changeable(cls, [active_material(context)], lock_of)
            and super().poll(context)
        )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks for the measured file where it is not found."""
        source = record_of(active_material(context))["source"]
        if self.filepath or source_file(source):
            return self.execute(context)
        self.filepath = Path(source["path"] or "").name
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        material = active_material(context)
        source = record_of(material)["source"]
        path = bpy.path.abspath(self.filepath) or source_file(source) or source["path"]
        if not path:
            return self.refuse(f"{material.name}: its record names no file to fit.")
        self._material_uid = material.session_uid
        return self.fit(context, [path])

    def apply(
        self, context: bpy.types.Context, done: list["Outcome"]
    ) -> Generator[None, None, str]:
        yield
        found = [m for m in bpy.data.materials if m.session_uid == self._material_uid]
        if not found:
            return "The material was removed while its fit was under way."
        nodes.material.fill_material(found[0], done[0].record, **self.material_options())
        draw_spheres(found[0])
        return ""


class LOBEFIT_OT_cancel_fit(bpy.types.Operator):
    """End what Lobefit is at work on; nothing is changed"""

    bl_idname = "lobefit.cancel_fit"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if current() is None:
            cls.poll_message_set("Lobefit is not at work")
        return current() is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        current().end()
        return {"FINISHED"}
