"""A record as a Blender material."""

from typing import Any

import bpy

from ..records import KEY
from .live import live_group, live_inputs
from .principled import principled_node
from .tree import empty_shader_tree

KINDS = ("live", "principled")


def build_material(record: Any, kind: str = "live", name: str | None = None) -> bpy.types.Material:
    """A new material for a `lobefit.Record`, called `name` or like the record.

    Raises ValueError for another kind than those in KINDS.
    """
    _check(kind)
    material = bpy.data.materials.new(record.name if name is None else name)
    fill_material(material, record, kind)
    return material


def fill_material(material: bpy.types.Material, record: Any, kind: str = "live") -> None:
    """Replaces the material's nodes by those of a record, and keeps everything else of it.

    Its output for all renderers is the record's best Principled BSDF, which EEVEE, the viewport and
    the exporters show. With the kind `live` Cycles has an output of its own, the group 'Lobefit
    Live'. The record goes along as JSON in the custom property `lobefit_record`.
    """
    _check(kind)
    tree = empty_shader_tree(material)
    principled = principled_node(tree, record.principled, location=(0.0, 0.0))
    _add_output(tree, "ALL", principled.outputs[0], (500.0, 0.0)).is_active_output = True
    if kind == "live":
        _add_output(tree, "CYCLES", _add_live(tree, record.parameters), (500.0, 300.0))
    material[KEY] = record.to_json()


def _check(kind: str) -> None:
    if kind not in KINDS:
        raise ValueError(f"kind: expected one of {', '.join(KINDS)}, found '{kind}'.")


def _add_live(tree: bpy.types.NodeTree, parameters: dict[str, Any]) -> bpy.types.NodeSocket:
    """The shader of the live group, or the sum of several where the channels differ in exponent."""
    total = None
    for index, values in enumerate(live_inputs(parameters)):
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = live_group()
        node.name = node.label = node.node_tree.name
        node.width, node.location = 200.0, (0.0, 300.0 + 320.0 * index)
        for socket, value in values.items():
            colour = isinstance(value, list)
            node.inputs[socket].default_value = (*value, 1.0) if colour else value
        shader = node.outputs[0]
        if total is not None:
            both = tree.nodes.new("ShaderNodeAddShader")
            both.location = (250.0, 300.0 + 320.0 * index)
            tree.links.new(total, both.inputs[0])
            tree.links.new(shader, both.inputs[1])
            shader = both.outputs[0]
        total = shader
    return total


def _add_output(
    tree: bpy.types.NodeTree,
    target: str,
    shader: bpy.types.NodeSocket,
    location: tuple[float, float],
) -> bpy.types.Node:
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.target = target
    output.name = output.label = "Cycles" if target == "CYCLES" else "All"
    output.location = location
    tree.links.new(shader, output.inputs["Surface"])
    return output
