"""Fits the active material anew, and cancels a fit."""

from typing import ClassVar

import bpy

from ..jobs import Outcome
from ..nodes.material import fill_material
from ..records import active_material, record_of
from .run import RunsFits, current


class LOBEFIT_OT_fit(RunsFits, bpy.types.Operator):
    """Fit the active material anew from the file it was measured in"""

    bl_idname = "lobefit.fit"
    bl_label = "Fit Measured BRDF"
    bl_options: ClassVar = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = active_material(context)
        if record_of(material) is None:
            cls.poll_message_set("The active material was not made from a measurement")
            return False
        if not material.is_editable:
            cls.poll_message_set("The active material is linked from another file")
            return False
        return super().poll(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self.execute(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        material = active_material(context)
        path = record_of(material)["source"]["path"]
        if not path:
            return self.refuse(f"{material.name}: its record names no file to fit.")
        self._material_uid = material.session_uid
        return self.fit(context, [path])

    def apply(self, context: bpy.types.Context, done: list[Outcome]) -> str:
        found = [m for m in bpy.data.materials if m.session_uid == self._material_uid]
        if not found:
            return "The material was removed while its fit was under way."
        fill_material(found[0], done[0].record, **self.material_options())
        return ""


class LOBEFIT_OT_cancel_fit(bpy.types.Operator):
    """End what Lobefit is at work on; nothing is changed"""

    bl_idname = "lobefit.cancel_fit"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return current() is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        current().end()
        return {"FINISHED"}
