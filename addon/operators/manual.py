"""Opens the manual, which comes with the extension: nothing is taken from a network."""

from pathlib import Path
from typing import ClassVar

import bpy

MANUAL = Path(__file__).parents[1] / "manual" / "index.html"


class LOBEFIT_OT_open_manual(bpy.types.Operator):
    """Show the manual that came with the extension in the browser"""

    bl_idname = "lobefit.open_manual"
    bl_label = "Manual"
    bl_options: ClassVar = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        found = MANUAL.is_file()
        if not found:
            cls.poll_message_set("The manual comes with the packaged extension only")
        return found

    def execute(self, context: bpy.types.Context) -> set[str]:
        bpy.ops.wm.url_open(url=MANUAL.as_uri())
        return {"FINISHED"}
