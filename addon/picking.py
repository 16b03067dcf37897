"""What lies under the cursor in a viewport."""

import bmesh
import bpy
from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d
from mathutils import Vector

from .targets import takes_material

# Of objects in front that the viewport does not show, so many are seen through.
_MOST_HIDDEN = 100


def slot_under(
    context: bpy.types.Context, place: tuple[float, float]
) -> tuple[bpy.types.Object, int] | None:
    """The object at a place of the viewport's region, in pixels, and its face's material slot.

    None where there is no surface, or none of an object that takes a material.
    """
    region, view = context.region, context.region_data
    origin = region_2d_to_origin_3d(region, view, place)
    direction = region_2d_to_vector_3d(region, view, place)
    depsgraph = context.evaluated_depsgraph_get()
    for _ in range(_MOST_HIDDEN):
        hit, point, _, face, item, _ = context.scene.ray_cast(depsgraph, origin, direction)
        if not hit:
            return None
        if not _is_hidden_here(context, item):
            return (item, _slot_of_face(item, face, depsgraph)) if takes_material(item) else None
        origin = _beyond(point, direction)
    return None


def _is_hidden_here(context: bpy.types.Context, item: bpy.types.Object) -> bool:
    """Whether this viewport leaves out what the scene shows: by its local view or by type.

    Objects that are not shown themselves were hit as instances, which are.
    """
    shown = item.name in context.view_layer.objects and item.visible_get()
    return shown and not item.visible_get(viewport=context.space_data)


def _slot_of_face(item: bpy.types.Object, face: int, depsgraph: bpy.types.Depsgraph) -> int:
    if item.mode == "EDIT" and item.type == "MESH" and bpy.app.version >= (4, 3):
        # The ray then meets the faces that are edited, not those that modifiers make of them.
        faces = bmesh.from_edit_mesh(item.data).faces
        faces.ensure_lookup_table()
        index = faces[face].material_index
    else:
        evaluated = item.evaluated_get(depsgraph)
        # A mesh is at hand unless it is edited; other surfaces are converted.
        at_hand = item.type == "MESH" and item.mode != "EDIT"
        mesh = evaluated.data if at_hand else evaluated.to_mesh()
        index = mesh.polygons[face].material_index
        evaluated.to_mesh_clear()
    return max(0, min(index, len(item.material_slots) - 1))


def _beyond(point: Vector, direction: Vector) -> Vector:
    """A little further, beyond the rounding of single precision."""
    return point + direction * (1e-5 * (1 + point.length))
