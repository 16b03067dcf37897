"""Materials that another version of Lobefit made: which they are, and giving them today's nodes."""

from typing import Any

import bpy

from ..records import (
    BAKED,
    KIND_KEY,
    SCHEMA,
    VERSION,
    VERSION_KEY,
    entries_of,
    has_bounces,
    record_of,
)
from . import baked, live
from .material import fill_material, shown_by
from .parameters import parameter_nodes


def is_outdated(material: bpy.types.Material) -> bool:
    """Whether an earlier version made a measured material, so that `update` has something to do."""
    if record_of(material) is None or is_newer(material):
        return False
    if material.get(VERSION_KEY, 0) < VERSION:
        return True
    groups = _groups(parameter_nodes(material, material.get(KIND_KEY, "live")))
    return any(
        group.node_tree.get(live.VERSION_KEY, live.VERSION) < live.VERSION for group in groups
    )


def is_newer(material: bpy.types.Material) -> bool:
    """Whether a later version made a measured material, whose record may not be understood."""
    schema = (entries_of(material) or {}).get("schema")
    return material.get(VERSION_KEY, 0) > VERSION or (isinstance(schema, int) and schema > SCHEMA)


def update(material: bpy.types.Material, record: Any) -> None:
    """Gives the material what is built of its `lobefit.Record` today, and keeps what was edited.

    Values of the groups' inputs stay, and what is linked to them. Raises ValueError where the
    record does not hold what the material shows.
    """
    choice = shown_by(material, record)
    groups = _groups(parameter_nodes(material, choice.kind))
    if choice.kind == "live" and groups:
        for node in groups:
            _exchange(node, live.live_group())
    elif choice.closures is not None and len(groups) == 1:
        _exchange(groups[0], baked.baked_group(groups[0].node_tree.name, choice.closures))
    elif choice.kind != "principled":
        count = choice.count if choice.kind in BAKED else None
        fill_material(material, record, choice.kind, count, diffuse_bounces=has_bounces(material))
    material[VERSION_KEY] = VERSION


def _groups(found: list[bpy.types.Node]) -> list[bpy.types.Node]:
    return [node for node in found if node.bl_idname == "ShaderNodeGroup"]


def _exchange(node: bpy.types.Node, group: bpy.types.NodeTree) -> None:
    old, name = node.node_tree, node.node_tree.name
    if old == group:
        return
    node.node_tree = group
    if old.users == 0 and old.library is None:
        bpy.data.node_groups.remove(old)
        group.name = name
