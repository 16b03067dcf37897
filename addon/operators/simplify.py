"""Leaves out of the scene's measured materials what it does not need, and puts it back."""

from typing import TYPE_CHECKING, ClassVar

import bpy

from .. import native
from ..properties import SimplifyOptions
from ..records import is_simplified
from .run import RunsWork, current

# What needs NumPy is loaded when it is used: it would double the time that Blender takes to start.
if TYPE_CHECKING:
    from ..survey import Survey


class LOBEFIT_OT_simplify_scene(SimplifyOptions, RunsWork, bpy.types.Operator):
    """Give measured materials as few closures as the camera of the scene needs to see of them"""

    bl_idname = "lobefit.simplify_scene"
    bl_label = "Simplify Measured Materials"
    bl_options: ClassVar = {"REGISTER"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self.execute(context)

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..survey import Survey

        survey = Survey(context, self.frames)
        if survey.problem:
            return self.refuse(survey.problem)
        return self.start(context, survey)

    def conclude(self, context: bpy.types.Context, work: "Survey") -> set[str]:
        from ..simplification import simplify

        if work.problem:
            return self.refuse(work.problem)
        result = simplify(context, work, self.tolerance / 100, self.diffuse_bounces, self.timed)
        for item in result["skipped"]:
            self.report({"WARNING"}, f"{item['material']}: left as it is, {item['reason']}")
        if self.timed and result["seconds"]["after"] is None:
            self.report({"WARNING"}, "Rendering is timed in Cycles only")
        if not result["materials"]:
            return self.refuse("Expected a measured material in the scene, found none to simplify.")
        changed = sum(row["changed"] for row in result["materials"])
        self.report(
            {"INFO"},
            f"{changed} of {len(result['materials'])} materials changed, which adds at most "
            f"{result['error_added']:.2%} of error to the picture",
        )
        bpy.ops.ed.undo_push(message=self.bl_label)
        return {"FINISHED"}


class LOBEFIT_OT_restore_scene(bpy.types.Operator):
    """Put back what all simplified materials of the file showed before"""

    bl_idname = "lobefit.restore_scene"
    bl_label = "Restore Measured Materials"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not any(map(is_simplified, bpy.data.materials)):
            cls.poll_message_set("No material of the file was simplified")
            return False
        if current():
            cls.poll_message_set("Lobefit is at work: wait for it or cancel it")
        return current() is None

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..simplification import restore_all

        result = restore_all()
        for item in result["skipped"]:
            self.report({"WARNING"}, f"{item['material']}: left as it is, {item['reason']}")
        self.report({"INFO"}, f"{len(result['restored'])} materials restored")
        return {"FINISHED"}
