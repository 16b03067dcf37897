"""Add > Lobefit Live in the shader editor."""

from typing import Any, ClassVar

import bpy
from bpy.props import FloatVectorProperty

from .. import nodes
from ..locks import lock_of
from ..targets import cursor_location, edited, shows_material


class LOBEFIT_OT_add_live(bpy.types.Operator):
    """Add the group Lobefit Live, a measured lobe of which every parameter is a socket"""

    bl_idname = "lobefit.add_live"
    bl_label = "Add Lobefit Live"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    location: FloatVectorProperty(
        name="Location", size=2, options={"SKIP_SAVE"}, description="Where in the node tree it goes"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not shows_material(context.space_data) or context.space_data.edit_tree is None:
            cls.poll_message_set("There is no shader editor that shows a material's nodes")
            return False
        reason = lock_of(edited(context.space_data))
        if reason:
            cls.poll_message_set(f"The node tree cannot be edited: {reason}")
        return not reason

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Adds it where the cursor is, and lets it be moved as Blender's own nodes are."""
        self.location = cursor_location(context, event)
        self.execute(context)
        bpy.ops.node.translate_attach_remove_on_cancel("INVOKE_DEFAULT")
        return {"FINISHED"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        tree = context.space_data.edit_tree
        for node in tree.nodes:
            node.select = False
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = nodes.live.live_group()
        node.name = node.label = nodes.live.NAME
        node.width, node.location = 200.0, self.location
        tree.nodes.active = node
        return {"FINISHED"}


def draw_menu(self: Any, context: bpy.types.Context) -> None:
    """The entry in Add of the shader editor."""
    if shows_material(context.space_data):
        self.layout.separator()
        self.layout.operator(LOBEFIT_OT_add_live.bl_idname, text=nodes.live.NAME)
