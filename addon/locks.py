"""Why a data-block is left as it is: Blender would not let it be changed, or not keep that."""

import bpy


def lock_of(item: bpy.types.ID) -> str:
    """What keeps a data-block from being changed, as the end of a sentence; empty if nothing does.

    Nodes in a library override can be changed, but Blender drops the change when it reads the file
    again.
    """
    if item.library is not None:
        return "it is linked from another file"
    if item.override_library is not None:
        return "it is a library override, of which Blender does not save the change"
    return "" if item.is_editable else "it cannot be edited"


def problem_of(material: bpy.types.Material) -> str:
    """Why the nodes of a material have to be left as they are; empty if they may be changed."""
    if lock_of(material):
        return lock_of(material)
    if material.node_tree is None:
        return "it has no nodes"
    return "its nodes are animated" if material.node_tree.animation_data is not None else ""
