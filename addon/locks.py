"""Why Blender would not let a data-block be changed, or would not keep the change."""

import bpy


def lock_of(item: bpy.types.ID) -> str:
    """What keeps a data-block from being changed, as the end of a sentence; empty if nothing does.

    Nodes in a library override can be changed, but Blender drops the change when it reads the file
    again.
    """
    if item.library is not None:
        return "it is linked from another file"
    if item.override_library is not None:
        return "it is a library override, whose nodes Blender does not save"
    return "" if item.is_editable else "it cannot be edited"
