"""What a material costs: processor time per camera sample, measured by rendering it.

The scenes are small and rendered by one thread, so that the time goes into shading. It is processor
time, which other programs on the machine disturb least; what they still do can only add to it, so
the least of several rounds is the answer. A round goes through all materials: a slow minute then
slows all of them.
"""

import itertools
import statistics
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

import bmesh
import bpy
from mathutils import Vector

from .nodes.tree import empty_shader_tree, show_grey
from .scene import uniform_world

Name = TypeVar("Name")

SCENES = {
    "sun": "one sun",
    "world": "a constant world",
    "room": "a closed room with a lamp and 4 bounces",
}
_BOUNCES = {"sun": 0, "world": 0, "room": 4}
_CURVES = ("ShaderNodeFloatCurve", "ShaderNodeRGBCurve")
_SIZE = 64  # pixels across
_SUN = (1.0, 1.0, 1.2)  # toward it, seen from a camera at +z


@dataclass(frozen=True)
class Cost:
    """Seconds per camera sample: the least of all rounds, and the middle one."""

    seconds: float
    median: float

    @property
    def spread(self) -> float:
        """How far the middle round lies above the least, as a part of it."""
        return self.median / self.seconds - 1.0


@dataclass(frozen=True)
class Contents:
    """What Cycles has to do for a material: nodes in all, curves among them, and closures."""

    nodes: int
    curves: int
    closures: int


def contents(material: bpy.types.Material) -> Contents:
    """The nodes that lead to the material's output in Cycles, those in groups included."""
    output = material.node_tree.get_output_node("CYCLES")
    nodes = list(_nodes_before(output))
    curves = sum(node.bl_idname in _CURVES for node in nodes)
    return Contents(len(nodes), curves, sum(map(_closures, nodes)))


def measure_costs(
    materials: Mapping[Name, bpy.types.Material], lights: str, rounds: int = 9, samples: int = 32
) -> dict[Name, Cost]:
    """What each of the materials, by any names, costs in the scene `lights`, a key of `SCENES`.

    Setting up a render is counted too; at 32 samples it is some 8 % of a diffuse material's time.
    """
    before = bpy.context.scene
    scene, item = _scene(lights)
    times: dict[Name, list[float]] = {name: [] for name in materials}
    try:
        for _, (name, material) in itertools.product(range(rounds), materials.items()):
            item.data.materials[0] = material
            times[name].append(_seconds(scene, samples) / (_SIZE * _SIZE * samples))
    finally:
        bpy.context.window.scene = before
        _remove(scene)
    return {name: Cost(min(each), statistics.median(each)) for name, each in times.items()}


def diffuse_material(name: str = "Diffuse", albedo: float = 1.0) -> bpy.types.Material:
    """A new material of one grey Diffuse BSDF, the least a surface can cost."""
    material = bpy.data.materials.new(name)
    tree = empty_shader_tree(material)
    show_grey(tree, "ShaderNodeBsdfDiffuse", "ShaderNodeOutputMaterial", albedo)
    return material


def _nodes_before(output: bpy.types.Node) -> Iterator[bpy.types.Node]:
    """All nodes that the output depends on, each once, without what only groups others."""
    seen, ahead = set(), [output]
    while ahead:
        node = ahead.pop()
        for other in (link.from_node for socket in node.inputs for link in socket.links):
            if other in seen:
                continue
            seen.add(other)
            ahead.append(other)
            if other.bl_idname == "ShaderNodeGroup":
                inside = next(n for n in other.node_tree.nodes if n.bl_idname == "NodeGroupOutput")
                yield from _nodes_before(inside)
            elif other.bl_idname != "NodeGroupInput":
                yield other


def _closures(node: bpy.types.Node) -> int:
    """How many closures a node adds; a Principled BSDF mixes one metal and two other ones."""
    if node.bl_idname == "ShaderNodeBsdfPrincipled":
        metallic = node.inputs["Metallic"].default_value
        return (metallic > 0.0) + 2 * (metallic < 1.0)
    return int(node.bl_idname.startswith("ShaderNodeBsdf"))


def _seconds(scene: bpy.types.Scene, samples: int) -> float:
    scene.cycles.samples = samples
    start = time.process_time()
    bpy.ops.render.render(scene=scene.name)
    return time.process_time() - start


def _scene(lights: str) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """A new scene, made current, and its one object, which no camera ray misses."""
    scene = bpy.data.scenes.new("Cost")
    bpy.context.window.scene = scene
    item = _add(scene, _mesh(walls=lights == "room"))
    scene.camera = _add(scene, bpy.data.cameras.new("Cost"))
    scene.camera.location = (0.0, 0.0, 2.0)
    # A square within the sphere's outline: all view angles but the last degrees.
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.4
    if lights == "sun":
        sun = bpy.data.lights.new("Cost", "SUN")
        sun.energy, sun.angle = 1.0, 0.0
        _add(scene, sun).rotation_euler = Vector(_SUN).to_track_quat("Z", "Y").to_euler()
    elif lights == "world":
        scene.world = uniform_world("Cost", 1.0)
    else:
        lamp = bpy.data.lights.new("Cost", "AREA")
        lamp.energy, lamp.size = 100.0, 1.0
        _add(scene, lamp).location = (0.0, 0.0, 2.9)
    _set_up_cycles(scene, _BOUNCES[lights])
    return scene, item


def _mesh(walls: bool) -> bpy.types.Mesh:
    mesh, shape = bpy.data.meshes.new("Cost"), bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=3, radius=1.0)
    if walls:
        bmesh.ops.create_cube(shape, size=6.0)
    shape.to_mesh(mesh)
    shape.free()
    mesh.polygons.foreach_set("use_smooth", [len(face.vertices) == 3 for face in mesh.polygons])
    mesh.materials.append(None)
    return mesh


def _add(scene: bpy.types.Scene, data: bpy.types.ID) -> bpy.types.Object:
    item = bpy.data.objects.new("Cost", data)
    scene.collection.objects.link(item)
    return item


def _set_up_cycles(scene: bpy.types.Scene, bounces: int) -> None:
    scene.render.engine = "CYCLES"
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.resolution_x = scene.render.resolution_y = _SIZE
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.device, cycles.seed, cycles.max_bounces = "CPU", 0, bounces
    cycles.diffuse_bounces = cycles.glossy_bounces = bounces
    # Without chance in where a path ends, a brighter material does not cost more for its longer
    # paths.
    cycles.min_light_bounces = bounces
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.light_sampling_threshold = 0.0


def _remove(scene: bpy.types.Scene) -> None:
    """Takes away the scene with all that `_scene` made for it."""
    world = [scene.world] if scene.world else []
    made = [item.data for item in scene.objects] + list(scene.objects) + world
    bpy.data.scenes.remove(scene)
    bpy.data.batch_remove(made)
