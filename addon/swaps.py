"""Shows a material in another way than it was made with, and puts the first one back."""

from typing import Any

import bpy

from .nodes.material import build_material, discard, fill_material
from .records import BAKED, BEFORE_KEY, COUNT_KEY, KIND_KEY, has_bounces, is_simplified
from .ways import Way

_COMPARED = ".lobefit as built"  # a material that is there only to be compared with
# Curve mappings, groups and active outputs are looked at elsewhere, or by choice not at all.
_NOT_SETTINGS = {*bpy.types.Node.bl_rna.properties.keys(), "is_active_output"}
_PLAIN = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}


def is_named(material: bpy.types.Material, way: Way) -> bool:
    """Whether the material says of itself that it shows this; see `is_as_built`."""
    if way.kind != material.get(KIND_KEY, "live"):
        return False
    return way.kind not in BAKED or len(way.closures["specular"]) == material.get(COUNT_KEY)


def is_as_built(material: bpy.types.Material, record: Any, way: Way) -> bool:
    """Whether the nodes are still those of the record, so that nothing of a user's is lost."""
    groups = {group.session_uid for group in bpy.data.node_groups}
    # With its own name it takes the place of no group of the user's.
    built = build_material(
        record,
        way.kind,
        name=_COMPARED,
        count=way.count,
        diffuse_bounces=has_bounces(material),
    )
    try:
        return tree_content(built.node_tree) == tree_content(material.node_tree)
    finally:
        discard({built.session_uid}, groups)


def tree_content(tree: bpy.types.NodeTree) -> tuple[Any, ...]:
    """All that a tree and its groups compute, to be compared; names and places do not count."""
    order = {node.as_pointer(): index for index, node in enumerate(tree.nodes)}
    links = {
        (
            order[link.from_node.as_pointer()],
            _place(link.from_node.outputs, link.from_socket),
            order[link.to_node.as_pointer()],
            _place(link.to_node.inputs, link.to_socket),
            link.is_muted,
        )
        for link in tree.links
    }
    return tuple(map(_node_content, tree.nodes)), frozenset(links)


def _node_content(node: bpy.types.Node) -> tuple[Any, ...]:
    settings = tuple(
        _plain(getattr(node, item.identifier))
        for item in node.bl_rna.properties
        if item.type in _PLAIN and item.identifier not in _NOT_SETTINGS
    )
    inputs = tuple(_plain(getattr(socket, "default_value", None)) for socket in node.inputs)
    return node.bl_idname, node.mute, settings, inputs, _inner_content(node)


def _inner_content(node: bpy.types.Node) -> Any:
    """What a group holds, or the curves of a node."""
    if node.bl_idname == "ShaderNodeGroup":
        return node.node_tree and tree_content(node.node_tree)
    if hasattr(node, "mapping") and hasattr(node.mapping, "curves"):
        return [
            [(*point.location, point.handle_type) for point in curve.points]
            for curve in node.mapping.curves
        ]
    return None


def _plain(value: Any) -> Any:
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def _place(sockets: Any, socket: bpy.types.NodeSocket) -> int:
    return next(index for index, item in enumerate(sockets) if item == socket)


def show(
    material: bpy.types.Material, record: Any, now: Way, way: Way, diffuse_bounces: bool
) -> None:
    """Gives a material another way to be shown, and remembers the one it had at first."""
    before = _state(now, has_bounces(material))
    if is_simplified(material):
        before = material[BEFORE_KEY].to_dict()
    after = _state(way, diffuse_bounces)
    fill_material(material, record, **after)
    if before != after:
        material[BEFORE_KEY] = before


def restore(material: bpy.types.Material, record: Any) -> None:
    """Shows a material as before it was simplified, from the record in it alone.

    Raises ValueError where the record does not hold what was shown.
    """
    fill_material(material, record, **material[BEFORE_KEY].to_dict())


def _state(way: Way, diffuse_bounces: bool) -> dict[str, Any]:
    """What `fill_material` has to be told to show a way."""
    return {"kind": way.kind, "count": way.count, "diffuse_bounces": diffuse_bounces}
