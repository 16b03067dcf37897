"""Classic materials: making one, and telling it the lights of the scene."""

from typing import ClassVar

import bpy

from .. import nodes
from ..records import active_material


class LOBEFIT_OT_make_classic(bpy.types.Operator):
    """Give the active object a new Classic Phong / Blinn-Phong material under the scene's suns"""

    bl_idname = "lobefit.make_classic"
    bl_label = "New Classic Phong / Blinn-Phong"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        found = hasattr(getattr(context.active_object, "data", None), "materials")
        if not found:
            cls.poll_message_set("The active object takes no material")
        return found

    def execute(self, context: bpy.types.Context) -> set[str]:
        material = bpy.data.materials.new(nodes.classic.NAME)
        # It shows what it emits; as a lamp for the rest of the scene it would only add noise.
        material.cycles.emission_sampling = "NONE"
        tree = nodes.tree.empty_shader_tree(material)
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = nodes.classic.classic_group()
        node.name = node.label = nodes.classic.NAME
        node.width = 240.0
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        output.location = (300.0, 0.0)
        tree.links.new(node.outputs["Emission"], output.inputs["Surface"])
        context.active_object.active_material = material
        _take_lights(self, context, [node])
        return {"FINISHED"}


class LOBEFIT_OT_take_lights(bpy.types.Operator):
    """Show the active Classic Phong / Blinn-Phong material under the suns and the world of the \
scene, as they are now"""

    bl_idname = "lobefit.take_lights"
    bl_label = "Take Lights from Scene"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        found = bool(classic_nodes(active_material(context)))
        if not found:
            cls.poll_message_set("The active material holds no Classic Phong / Blinn-Phong group")
        return found

    def execute(self, context: bpy.types.Context) -> set[str]:
        if not _take_lights(self, context, classic_nodes(active_material(context))):
            self.report({"ERROR"}, "Expected a sun in the scene, found none.")
            return {"CANCELLED"}
        return {"FINISHED"}


def classic_nodes(material: bpy.types.Material | None) -> list[bpy.types.Node]:
    """The instances of the group in a material."""
    tree = material and material.node_tree
    return [node for node in tree.nodes if nodes.classic.is_classic(node)] if tree else []


def _take_lights(
    reporter: bpy.types.Operator, context: bpy.types.Context, found: list[bpy.types.Node]
) -> bool:
    """Tells the groups the lights and reports which were left out; False where there is no sun."""
    suns = nodes.scene_lights.suns_of(context)
    if suns:
        for warning in nodes.scene_lights.take_lights(found, suns, context.scene.world):
            reporter.report({"WARNING"}, warning)
    return bool(suns)
