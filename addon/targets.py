"""Where what was imported goes: a slot of an object, or a node tree that is edited."""

from typing import Any

import bpy

from . import nodes
from .locks import lock_of


class SlotTarget:
    """A material slot of an object, counted from 0; the last one where it has fewer."""

    def __init__(self, item: bpy.types.Object, index: int) -> None:
        # Blender may free and make objects anew until there is something to put there.
        self._uid, self._index = item.session_uid, index

    def put(self, material: bpy.types.Material) -> str:
        """Puts a material there; says why if that is not possible, and then changes nothing."""
        found = [item for item in bpy.data.objects if item.session_uid == self._uid]
        if not found:
            return "The object was removed while the fit was under way."
        reason = _assign(found[0], self._index, material)
        return reason and f"{found[0].name} was not given the material: {reason}."


def takes_material(item: bpy.types.Object | None) -> bool:
    """Whether an object has material slots, or could have."""
    return hasattr(getattr(item, "data", None), "materials")


def _assign(item: bpy.types.Object, index: int, material: bpy.types.Material) -> str:
    if item.library is not None:
        return lock_of(item)
    if not item.material_slots:
        # Blender does not save a slot that is added to an override.
        if item.data.library or item.data.override_library:
            return "it has no slot, and its data belong to another file"
        item.data.materials.append(material)
        return ""
    slot = item.material_slots[min(index, len(item.material_slots) - 1)]
    if slot.is_property_readonly("material") and item.is_editable:
        # The object's own slot hides that of data which are linked.
        slot.link = "OBJECT"
    if slot.is_property_readonly("material"):
        return "its slot cannot be edited"
    slot.material = material
    return ""


def shows_material(editor: bpy.types.Space | None) -> bool:
    """Whether an editor is one of the nodes of materials."""
    return (
        editor is not None
        and editor.type == "NODE_EDITOR"
        and editor.tree_type == "ShaderNodeTree"
        and editor.shader_type == "OBJECT"
    )


def edited(editor: bpy.types.SpaceNodeEditor) -> bpy.types.ID:
    """The data-block that holds the tree which the editor edits: a group, or else a material."""
    tree = editor.edit_tree
    if not tree.is_embedded_data:
        return tree
    return next(material for material in bpy.data.materials if material.node_tree == tree)


def cursor_location(context: bpy.types.Context, event: bpy.types.Event) -> tuple[float, float]:
    """Where the cursor is in the edited tree, or the middle of what is seen where it is beside."""
    region = next(region for region in context.area.regions if region.type == "WINDOW")
    place = event.mouse_x - region.x, event.mouse_y - region.y
    if context.region != region:
        place = region.width // 2, region.height // 2
    context.space_data.cursor_location_from_region(*place)
    return tuple(context.space_data.cursor_location)


class TreeTarget:
    """A place in a node tree that a shader editor shows."""

    def __init__(self, editor: bpy.types.SpaceNodeEditor, location: tuple[float, float]) -> None:
        tree = editor.edit_tree
        self._owners = "materials" if tree.is_embedded_data else "node_groups"
        self._uid, self.lock = edited(editor).session_uid, lock_of(edited(editor))
        self._location = location

    def put(self, record: Any, **options: Any) -> str:
        """Adds the shader of a record, as `add_to_tree` takes it; says why if it cannot."""
        owners = getattr(bpy.data, self._owners)
        found = [owner for owner in owners if owner.session_uid == self._uid]
        if not found:
            return "The edited node tree was removed while the fit was under way."
        tree = found[0] if self._owners == "node_groups" else found[0].node_tree
        nodes.material.add_to_tree(tree, record, self._location, **options)
        return ""
