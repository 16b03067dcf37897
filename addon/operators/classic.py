"""Classic materials, and the lights that they are told."""

import math
import operator
from typing import Any, ClassVar, NamedTuple

import bpy
from mathutils import Vector

from .. import nodes
from ..records import active_material


class Light(NamedTuple):
    """A light as the group takes it: the direction toward it, i_d and i_s (linear RGB)."""

    direction: Vector
    diffuse: Vector
    specular: Vector


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
        if suns_of(context):
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
        if not suns_of(context):
            self.report({"ERROR"}, "Expected a sun in the scene, found none.")
            return {"CANCELLED"}
        _take_lights(self, context, classic_nodes(active_material(context)))
        return {"FINISHED"}


def classic_nodes(material: bpy.types.Material | None) -> list[bpy.types.Node]:
    """The instances of the group in a material."""
    tree = material and material.node_tree
    return [node for node in tree.nodes if nodes.classic.is_classic(node)] if tree else []


def suns_of(context: bpy.types.Context) -> list[Light]:
    """The suns that are rendered, the brightest first."""
    suns = [
        _light(item)
        for item in context.view_layer.objects
        if item.type == "LIGHT" and item.data.type == "SUN" and not item.hide_render
    ]
    # Sorting is stable: of two that are equally bright, the first of the scene comes first.
    return sorted(suns, key=lambda sun: -max(*sun.diffuse, *sun.specular))


def _light(sun: bpy.types.Object) -> Light:
    """Such that the diffuse term shows what Cycles' diffuse closure shows of the sun."""
    data = sun.data
    colour = Vector(data.color)
    # Lamps have an exposure and a temperature since Blender 4.5.
    if getattr(data, "use_temperature", False):
        colour = Vector(map(operator.mul, colour, data.temperature_color))
    radiance = colour * (data.energy * 2 ** getattr(data, "exposure", 0.0) / math.pi)
    direction = sun.matrix_world.to_3x3() @ Vector((0.0, 0.0, 1.0))
    return Light(
        direction.normalized(), radiance * data.diffuse_factor, radiance * data.specular_factor
    )


def _world_radiance(world: bpy.types.World | None) -> Vector | None:
    """What comes from everywhere; None where that differs from direction to direction."""
    if world is None:
        return Vector()
    # Since Blender 5.0 every world has nodes, and asking whether it uses them is deprecated.
    if bpy.app.version < (5, 0) and not world.use_nodes:
        return Vector(world.color)
    output = world.node_tree.get_output_node("CYCLES")
    if output is None or not output.inputs["Surface"].is_linked:
        return Vector()
    node = output.inputs["Surface"].links[0].from_node
    if node.type != "BACKGROUND" or any(socket.is_linked for socket in node.inputs):
        return None
    colour, strength = (node.inputs[name].default_value for name in ("Color", "Strength"))
    return Vector(colour[:3]) * strength


def _take_lights(
    reporter: bpy.types.Operator, context: bpy.types.Context, found: list[bpy.types.Node]
) -> None:
    suns, ambient = suns_of(context), _world_radiance(context.scene.world)
    for node in found:
        for index in range(nodes.classic.LIGHTS):
            _set_light(node, index, suns[index] if index < len(suns) else None)
        if ambient is not None:
            node.inputs["Ambient Light"].default_value = (*ambient, 1.0)
    if len(suns) > nodes.classic.LIGHTS:
        text = f"The {nodes.classic.LIGHTS} brightest of {len(suns)} suns were taken"
        reporter.report({"WARNING"}, text)
    if ambient is None:
        text = "Ambient Light is left as it was: the world is not of one colour"
        reporter.report({"WARNING"}, text)


def _set_light(node: bpy.types.Node, index: int, light: Light | None) -> None:
    """Fills a light's inputs; without a light it is black, and its direction stays."""

    def put(what: str, value: Any) -> None:
        node.inputs[nodes.classic.light_socket(index, what)].default_value = value

    if light:
        put("Direction", light.direction)
    put("Diffuse", (*(light.diffuse if light else (0.0,) * 3), 1.0))
    put("Specular", (*(light.specular if light else (0.0,) * 3), 1.0))
