"""Gives materials that an earlier version made what this version makes of their records."""

from typing import ClassVar

import bpy

from .. import native, nodes
from ..locks import problem_of
from ..records import KEY
from .polls import poll_changeable


class LOBEFIT_OT_update_materials(bpy.types.Operator):
    """Give all measured materials of this file that an older Lobefit made the nodes of this one; \
what is linked from other files is named and left as it is"""

    bl_idname = "lobefit.update_materials"
    bl_label = "Update Measured Materials"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        found = list(filter(nodes.versions.is_outdated, bpy.data.materials))
        if not found:
            cls.poll_message_set("No material of the file was made by an older Lobefit")
            return False
        return poll_changeable(cls, found)

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        import lobefit

        updated, problems = [], []
        for material in filter(nodes.versions.is_outdated, list(bpy.data.materials)):
            reason = problem_of(material)
            try:
                if reason:
                    raise ValueError(f"{material.name_full}: left as it is, {reason}")
                record = lobefit.Record.from_json(material[KEY], material.name)
                nodes.versions.update(material, record)
                updated.append(material.name)
            except (lobefit.InputError, ValueError) as error:
                problems.append(str(error))
        for text in problems:
            self.report({"WARNING" if updated else "ERROR"}, text)
        if updated:
            self.report({"INFO"}, f"Updated {', '.join(updated)}")
        return {"FINISHED"} if updated else {"CANCELLED"}
