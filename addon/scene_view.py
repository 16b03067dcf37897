"""What the camera of a scene sees of each material, by casting a grid of rays.

Rays meet what the viewport shows, without the objects that renders or camera rays leave out. They
end at the first surface: what is seen through glass or in a mirror counts as bounced light.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.interpolate import poly_3d_calc
from numpy.typing import NDArray

DEGREES = 90  # bins of view angles, one a degree
RAYS = 160  # along the longer side of the picture
# How many surfaces that renders do not show a ray passes before it is given up.
_MOST_PASSED = 64
# The step beyond such a surface, as a part of its distance.
_STEP = 1e-5


@dataclass
class View:
    """One frame: how many rays meet each material at which angle, in rays by degree.

    Materials stand under their `session_uid`; `present` are those of all objects in the scene, seen
    or not. `other` rays meet surfaces whose material is none at all; the rest meet nothing.
    """

    frame: int
    rays: int
    angles: dict[int, NDArray[np.float64]] = field(default_factory=dict)
    other: int = 0
    present: set[int] = field(default_factory=set)

    def add(self, material: bpy.types.Material | None, cosines: Sequence[float]) -> None:
        """Counts rays that meet a material under the angles with these cosines."""
        if material is None:
            self.other += len(cosines)
            return
        angles = np.degrees(np.arccos(np.clip(cosines, 0.0, 1.0))).astype(int)
        bins = self.angles.setdefault(material.session_uid, np.zeros(DEGREES))
        bins += np.bincount(np.minimum(angles, DEGREES - 1), minlength=DEGREES)


def evenly(first: int, last: int, count: int) -> list[int]:
    """At most `count` whole numbers from first to last, with both unless there is room for one."""
    return sorted({round(place) for place in np.linspace(first, last, max(1, count))})


def problem_of_camera(scene: bpy.types.Scene) -> str:
    """What keeps the scene's camera from being looked through; empty where nothing does."""
    if scene.camera is None or scene.camera.type != "CAMERA":
        return f"{scene.name}: expected a scene with a camera, found none."
    if scene.camera.data.type not in {"PERSP", "ORTHO"}:
        return (
            f"{scene.camera.name}: expected a perspective or orthographic camera, found a "
            "panoramic one."
        )
    return ""


def look(context: bpy.types.Context, frame: int, rays: int = RAYS) -> View:
    """What the current scene's camera sees at a frame; the current frame is put back.

    Raises ValueError, with a sentence, where no such camera is there.
    """
    scene = context.scene
    before, part = scene.frame_current, scene.frame_subframe
    scene.frame_set(frame)
    try:
        problem = problem_of_camera(scene)
        if problem:
            raise ValueError(problem)
        return _Look(context, rays).view(frame)
    finally:
        scene.frame_set(before, subframe=part)


def shown_only_in_renders(context: bpy.types.Context) -> dict[int, str]:
    """Materials on objects that renders show and the viewport hides, with such an object's name."""
    found: dict[int, str] = {}
    for item in _rendered_objects(context.view_layer):
        if not item.visible_get(view_layer=context.view_layer):
            for slot in item.material_slots:
                if slot.material is not None:
                    found.setdefault(slot.material.session_uid, item.name)
    return found


def lights(context: bpy.types.Context) -> dict[str, Any]:
    """How many lights of each type renders of the scene have, and whether a world lights it."""
    types = Counter(
        item.data.type.capitalize()
        for item in _rendered_objects(context.view_layer)
        if item.type == "LIGHT"
    )
    return {"lights": dict(types), "world": _is_lit(context.scene.world)}


def _is_lit(world: bpy.types.World | None) -> bool:
    if world is None:
        return False
    backgrounds = [
        node
        for node in (world.node_tree.nodes if world.node_tree else ())
        if node.type == "BACKGROUND"
    ]
    if not backgrounds:
        return any(world.color)
    return any(
        (node.inputs["Color"].is_linked or any(node.inputs["Color"].default_value[:3]))
        and (node.inputs["Strength"].is_linked or node.inputs["Strength"].default_value > 0)
        for node in backgrounds
    )


def _rendered_objects(layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """The objects of a view layer that renders show, without those that are only instanced."""
    found: dict[bpy.types.Object, None] = {}
    waiting = [layer.layer_collection]
    while waiting:
        here = waiting.pop()
        if here.collection.hide_render:
            continue
        waiting += here.children
        if not here.exclude:
            found |= {item: None for item in here.collection.objects if not item.hide_render}
    return list(found)


class _Look:
    """The rays of one frame, and the meshes they meet."""

    def __init__(self, context: bpy.types.Context, rays: int) -> None:
        self._scene, self._layer = context.scene, context.view_layer
        self._rays = rays
        self._depsgraph = context.evaluated_depsgraph_get()
        self._meshes: dict[_Key, list[bpy.types.Mesh]] = {}
        self._present: set[int] = set()
        self._passed: dict[str, bool] = {}
        rendered = _rendered_objects(self._layer)
        self._unrendered = {item.name_full for item in self._layer.objects}
        self._unrendered -= {item.name_full for item in rendered}
        for instance in self._depsgraph.object_instances:
            self._note(instance.object, instance.matrix_world)

    def view(self, frame: int) -> View:
        view = View(frame, rays=0, present=self._present)
        hits: dict[_Key, list[_Hit]] = defaultdict(list)
        items: dict[_Key, bpy.types.Object] = {}
        for origin, direction, reach in self._camera_rays():
            view.rays += 1
            hit = self._hit(origin, direction, reach)
            if hit is not None:
                place, _, index, item, matrix = hit
                key = _key(item, matrix)
                items[key] = item
                hits[key].append((place, index, direction))
        for key, found in hits.items():
            self._count(view, items[key], key, found)
        return view

    def _note(self, item: bpy.types.Object, matrix: Matrix) -> None:
        """Remembers a mesh by its object's name and place, all that a hit tells of it."""
        materials = [slot.material for slot in item.material_slots]
        if item.type == "MESH":
            self._meshes.setdefault(_key(item, matrix.copy()), []).append(item.data)
            materials += item.data.materials
        self._present |= {m.original.session_uid for m in materials if m is not None}

    def _camera_rays(self) -> Iterator[tuple[Vector, Vector, float]]:
        """Origin, direction and reach of a ray through each cell of the picture."""
        camera = self._scene.camera.evaluated_get(self._depsgraph)
        right_top, _, left_bottom, left_top = camera.data.view_frame(scene=self._scene)
        across, up = right_top - left_top, left_top - left_bottom
        (left, right), (bottom, top) = self._border()
        width, height = (right - left) * across.length, (top - bottom) * up.length
        cell = max(width, height) / self._rays
        columns, rows = max(1, round(width / cell)), max(1, round(height / cell))
        for row in range(rows):
            start = left_bottom + up * (bottom + (top - bottom) * (row + 0.5) / rows)
            for column in range(columns):
                point = start + across * (left + (right - left) * (column + 0.5) / columns)
                yield _camera_ray(camera, point)

    def _border(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The part of the frame that is rendered, from left to right and from below."""
        render = self._scene.render
        if not render.use_border:
            return (0.0, 1.0), (0.0, 1.0)
        return (
            (render.border_min_x, render.border_max_x),
            (render.border_min_y, render.border_max_y),
        )

    def _hit(
        self, origin: Vector, direction: Vector, reach: float
    ) -> tuple[Vector, Vector, int, bpy.types.Object, Matrix] | None:
        """Where a ray meets the first surface that a camera sees, or None."""
        for _ in range(_MOST_PASSED):
            found, *hit = self._scene.ray_cast(
                self._depsgraph, origin, direction, distance=max(reach, 0.0)
            )
            if not found:
                return None
            if not self._is_passed(hit[3]):
                return tuple(hit)
            gone = (hit[0] - origin).length
            step = gone + _STEP * max(1.0, hit[0].length)
            origin, reach = origin + direction * step, reach - step
        return None

    def _is_passed(self, item: bpy.types.Object) -> bool:
        """Whether camera rays of a render go through the object as if it were not there."""
        name = item.name_full
        if name not in self._passed:
            self._passed[name] = (
                item.hide_render
                or not item.visible_camera
                or name in self._unrendered
                or item.original.indirect_only_get(view_layer=self._layer)
            )
        return self._passed[name]

    def _count(self, view: View, item: bpy.types.Object, key: "_Key", hits: "list[_Hit]") -> None:
        """Counts the rays that meet one object in one place."""
        inverse = key[1].inverted_safe()
        turn = inverse.to_3x3().transposed()
        cosines: dict[bpy.types.Material | None, list[float]] = defaultdict(list)
        for place, index, direction in hits:
            local = inverse @ place
            mesh = self._mesh(local, index, key)
            if mesh is None:
                cosines[None].append(1.0)
                continue
            face = mesh.polygons[index]
            cosine = -(turn @ _shading_normal(mesh, face, local)).normalized().dot(direction)
            # Rays meet a surface from either side; its normals then stand on the viewer's.
            if (turn @ face.normal).dot(direction) > 0:
                cosine = -cosine
            cosines[_material_of(item, mesh, face.material_index)].append(cosine)
        for material, values in cosines.items():
            view.add(material, values)

    def _mesh(self, local: Vector, index: int, key: "_Key") -> bpy.types.Mesh | None:
        """The evaluated mesh that was met: of several in one place the one with such a face."""
        meshes = [mesh for mesh in self._meshes.get(key, ()) if index < len(mesh.polygons)]
        if len(meshes) < 2:
            return meshes[0] if meshes else None

        def distance(mesh: bpy.types.Mesh) -> float:
            face = mesh.polygons[index]
            return abs((local - face.center).dot(face.normal))

        return min(meshes, key=distance)


# An object's full name and its place: a hit tells no more of an instance.
_Key = tuple[str, Matrix]
# Where a ray meets a face of which index, and the ray's direction.
_Hit = tuple[Vector, int, Vector]


def _key(item: bpy.types.Object, matrix: Matrix) -> _Key:
    return item.name_full, matrix.freeze()


def _camera_ray(camera: bpy.types.Object, point: Vector) -> tuple[Vector, Vector, float]:
    """The ray through a point in the camera's own space, between the clipping distances."""
    near, far = camera.data.clip_start, camera.data.clip_end
    # Renders ignore a camera's scale.
    matrix = camera.matrix_world.normalized()
    if camera.data.type == "ORTHO":
        origin = matrix @ Vector((point.x, point.y, -near))
        return origin, (matrix.to_3x3() @ Vector((0.0, 0.0, -1.0))).normalized(), far - near
    stretch = point.length / -point.z
    direction = (matrix.to_3x3() @ point).normalized()
    return matrix.translation + direction * near * stretch, direction, (far - near) * stretch


def _shading_normal(mesh: bpy.types.Mesh, face: bpy.types.MeshPolygon, local: Vector) -> Vector:
    """The normal at a place of a face, between those of the face's corners."""
    corners, vertices = mesh.corner_normals, mesh.vertices
    weights = poly_3d_calc([vertices[vertex].co for vertex in face.vertices], local)
    normal = Vector((0.0, 0.0, 0.0))
    for weight, corner in zip(weights, face.loop_indices, strict=True):
        normal += corners[corner].vector * weight
    return normal if normal.length_squared > 0 else face.normal


def _material_of(
    item: bpy.types.Object, mesh: bpy.types.Mesh, index: int
) -> bpy.types.Material | None:
    """The material of a face, from the object's slot or the mesh's."""
    slots = item.material_slots
    if index < len(slots) and slots[index].link == "OBJECT":
        material = slots[index].material
    elif mesh.materials:
        # As in renders, a face whose slot is gone shows the last one.
        material = mesh.materials[min(index, len(mesh.materials) - 1)]
    else:
        material = None
    return None if material is None else material.original
