"""Edits the parameters of a measured material, and takes back what was edited."""

from typing import ClassVar

import bpy

from .. import nodes
from ..records import COUNT_KEY, KEY, KIND_KEY, active_material, has_bounces, record_of
from .at_once import ActsAtOnce
from .polls import poll_changeable


class _EditsMaterial(ActsAtOnce):
    """What operators have in common that change the active measured material at once."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and poll_changeable(cls, [active_material(context)])


class LOBEFIT_OT_edit_parameters(_EditsMaterial, bpy.types.Operator):
    """Make the active material one of the kind Live, whose parameters are all there to be edited"""

    bl_idname = "lobefit.edit_parameters"
    bl_label = "Edit as Live"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if active_material(context).get(KIND_KEY, "live") == "live":
            cls.poll_message_set("The active material is of the kind Live: its inputs are below")
            return False
        return True

    def act(self, material: bpy.types.Material) -> str:
        import lobefit

        nodes.material.fill_material(
            material, lobefit.Record.from_json(material[KEY], material.name), "live"
        )
        return ""


class LOBEFIT_OT_reset_parameters(_EditsMaterial, bpy.types.Operator):
    """Give the parameters of the active material the fitted values again"""

    bl_idname = "lobefit.reset_parameters"
    bl_label = "Reset"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        material = active_material(context)
        kind = material.get(KIND_KEY, "live")
        if not nodes.parameters.is_edited(material, record_of(material), kind):
            cls.poll_message_set("Nothing was edited")
            return False
        return True

    def act(self, material: bpy.types.Material) -> str:
        import lobefit

        record = lobefit.Record.from_json(material[KEY], material.name)
        kind = material.get(KIND_KEY, "live")
        if not nodes.parameters.reset(material, record_of(material), kind):
            # Its nodes are no longer those of the record.
            count = material.get(COUNT_KEY) if kind in ("lobe", "measured") else None
            nodes.material.fill_material(
                material, record, kind, count, diffuse_bounces=has_bounces(material)
            )
        return ""
