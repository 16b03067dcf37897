"""The extension's page in the preferences: defaults, what is wrong with it, what to tell of it."""

import platform
from typing import ClassVar

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from . import native
from .layouts import draw_problem
from .operators.manual import LOBEFIT_OT_open_manual
from .preferred import forget_chosen
from .properties import KINDS


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


def _forget(_preferences: bpy.types.AddonPreferences, context: bpy.types.Context) -> None:
    forget_chosen(context)


class LOBEFIT_AP_preferences(bpy.types.AddonPreferences):
    """What operators propose where nothing was chosen yet, and where files are"""

    bl_idname = __package__

    kind: EnumProperty(
        name="Kind",
        items=KINDS,
        default="measured",
        description="The kind of material that import, fit and libraries propose",
        update=_forget,
    )
    threads: IntProperty(
        name="Threads",
        default=0,
        min=0,
        max=1024,
        description="How many processors fits use; 0 for all",
        update=_forget,
    )
    measured_folder: StringProperty(
        name="Measured Files",
        subtype="DIR_PATH",
        description="Where to look for a measured file that is not where a material was made of it",
    )
    library_folder: StringProperty(
        name="Libraries",
        subtype="DIR_PATH",
        description="Where asset libraries are written; if empty, beside the measured files",
    )

    def draw(self, context: bpy.types.Context) -> None:
        draw_problem(self.layout, context)
        column = self.layout.column()
        column.use_property_split = True
        for name in ("kind", "threads", "measured_folder", "library_folder"):
            column.prop(self, name)
        row = self.layout.row()
        row.operator(LOBEFIT_OT_open_manual.bl_idname, icon="HELP")
        row.operator(LOBEFIT_OT_copy_diagnostics.bl_idname, icon="COPYDOWN")


def register() -> None:
    bpy.utils.register_class(LOBEFIT_OT_copy_diagnostics)
    bpy.utils.register_class(LOBEFIT_AP_preferences)


def unregister() -> None:
    bpy.utils.unregister_class(LOBEFIT_AP_preferences)
    bpy.utils.unregister_class(LOBEFIT_OT_copy_diagnostics)
