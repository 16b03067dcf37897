"""The suns and the world of a scene as the lights of the classic group."""

import math
import operator
from collections.abc import Sequence
from typing import Any, NamedTuple

import bpy
from mathutils import Vector

from .classic import LIGHTS, light_socket


class Light(NamedTuple):
    """A light as the group takes it: the direction toward it, i_d and i_s (linear RGB)."""

    direction: Vector
    diffuse: Vector
    specular: Vector


def suns_of(context: bpy.types.Context) -> list[Light]:
    """The suns that are rendered, the brightest first."""
    suns = [
        _light(item)
        for item in context.view_layer.objects
        if item.type == "LIGHT" and item.data.type == "SUN" and not item.hide_render
    ]
    # Sorting is stable: of two that are equally bright, the first of the scene comes first.
    return sorted(suns, key=lambda sun: -max(*sun.diffuse, *sun.specular))


def take_lights(
    found: Sequence[bpy.types.Node], suns: Sequence[Light], world: bpy.types.World | None
) -> list[str]:
    """Gives groups the lights, as many as they take; returns sentences on what was left out."""
    ambient = _world_radiance(world)
    for node in found:
        for index in range(LIGHTS):
            _set_light(node, index, suns[index] if index < len(suns) else None)
        if ambient is not None:
            node.inputs["Ambient Light"].default_value = (*ambient, 1.0)
    warnings = []
    if len(suns) > LIGHTS:
        warnings.append(f"The {LIGHTS} brightest of {len(suns)} suns were taken")
    if ambient is None:
        warnings.append("Ambient Light is left as it was: the world is not of one colour")
    return warnings


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


def _set_light(node: bpy.types.Node, index: int, light: Light | None) -> None:
    """Fills a light's inputs; without a light it is black, and its direction stays."""

    def put(what: str, value: Any) -> None:
        node.inputs[light_socket(index, what)].default_value = value

    if light:
        put("Direction", light.direction)
    put("Diffuse", (*(light.diffuse if light else (0.0,) * 3), 1.0))
    put("Specular", (*(light.specular if light else (0.0,) * 3), 1.0))
