"""The extension's page in the preferences: what is wrong with it, and what to tell of it."""

import platform
from typing import ClassVar

import bpy

from . import native
from .panels import draw_problem


def diagnosis() -> str:
    """What `lobefit diagnose` prints; without the compiled module what can be told without it."""
    problem = native.problem()
    if not problem:
        from lobefit.diagnosis import diagnose

        return str(diagnose())
    return "\n".join(
        [
            f"{'Lobefit':14} {native.own_identity()['version']}",
            f"{'Python':14} {platform.python_version()}",
            f"{'Blender':14} {bpy.app.version_string}",
            f"{'system':14} {platform.platform(terse=True)}, {platform.machine()}",
            f"{'problem':14} {problem}",
        ]
    )


class LOBEFIT_OT_copy_diagnostics(bpy.types.Operator):
    """Copy versions, machine and the outcome of a self-test of some seconds, for a report"""

    bl_idname = "lobefit.copy_diagnostics"
    bl_label = "Copy Diagnostics"
    bl_options: ClassVar = {"INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.window_manager.clipboard = diagnosis()
        self.report({"INFO"}, "The diagnostics are in the clipboard")
        return {"FINISHED"}


class LOBEFIT_AP_preferences(bpy.types.AddonPreferences):
    """Has no settings: those of a fit are in the panel"""

    bl_idname = __package__

    def draw(self, context: bpy.types.Context) -> None:
        draw_problem(self.layout, context)
        self.layout.operator(LOBEFIT_OT_copy_diagnostics.bl_idname, icon="COPYDOWN")


def register() -> None:
    bpy.utils.register_class(LOBEFIT_OT_copy_diagnostics)
    bpy.utils.register_class(LOBEFIT_AP_preferences)


def unregister() -> None:
    bpy.utils.unregister_class(LOBEFIT_AP_preferences)
    bpy.utils.unregister_class(LOBEFIT_OT_copy_diagnostics)
