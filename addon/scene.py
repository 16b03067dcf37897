"""A sphere under two lights, as the previews draw it, rendered by Cycles."""

import contextlib
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from .nodes.tree import empty_shader_tree, show_grey

# Directions toward the lights, seen from a camera at +z with x to the right and y up: one from the
# upper right, one behind the lower left that grazes the rim.
LIGHTS = {"Upper Right": (1.0, 1.0, 1.2), "Grazing": (-1.0, -1.0, -0.55)}


def two_lights_scene(material: bpy.types.Material | None, size: int) -> bpy.types.Scene:
    """The material on a unit sphere, in a square picture of `size` pixels that it fills.

    Two suns of strength 1 (irradiance on a surface that faces them) and angle 0 give radiances of
    f cos(theta_i). The current scene is used if it is empty, otherwise a new one is made current.
    """
    scene = bpy.context.scene
    if scene.objects:
        scene = bpy.data.scenes.new("Two Lights")
        bpy.context.window.scene = scene
    _add(scene, "Sphere", sphere_mesh(material))
    scene.camera = _add(scene, "Camera", _camera())
    scene.camera.location = (0, 0, 10)
    for name, direction in LIGHTS.items():
        sun = _add(scene, name, _sun(name))
        sun.rotation_euler = Vector(direction).to_track_quat("Z", "Y").to_euler()
    _set_up_cycles(scene)
    scene.world = None
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Standard"
    # A white diffuse surface that faces a light is white in the picture.
    scene.view_settings.exposure = float(np.log2(np.pi))
    return scene


def uniform_world(name: str, radiance: float) -> bpy.types.World:
    """A new world, grey and the same from everywhere."""
    world = bpy.data.worlds.new(name)
    tree = empty_shader_tree(world)
    show_grey(tree, "ShaderNodeBackground", "ShaderNodeOutputWorld", radiance)
    return world


def render(scene: bpy.types.Scene, path: str | os.PathLike[str]) -> None:
    """Renders the scene to the PNG file `path`."""
    with _set(scene.render.image_settings, file_format="PNG", color_mode="RGBA", color_depth="8"):
        _render_to(scene, path)


def render_seconds(scene: bpy.types.Scene) -> float:
    """How long Cycles takes for the current frame, half as wide and high with 8 samples a pixel."""
    few = {"samples": 8, "use_adaptive_sampling": False, "use_denoising": False}
    with (
        _set(scene.cycles, **few),
        _set(scene.render, resolution_percentage=50, use_compositing=False, use_sequencer=False),
    ):
        # The first rendering also loads what later ones find in memory.
        bpy.ops.render.render(scene=scene.name)
        began = time.perf_counter()
        bpy.ops.render.render(scene=scene.name)
    return time.perf_counter() - began


def render_pixels(scene: bpy.types.Scene) -> NDArray[np.float32]:
    """The radiance (size, size, 3), the first row at the top, at the centres of the pixels.

    The suns are rendered one after another with one sample each: so nothing is left to chance.
    """
    suns = [item for item in scene.objects if item.type == "LIGHT"]
    with _set(scene.cycles, samples=1):
        return sum(_pixels_under(scene, sun, suns) for sun in suns)


def radiance(scene: bpy.types.Scene) -> NDArray[np.float32]:
    """The current frame (rows, columns, 3) as it is rendered, in linear light, from the top."""
    settings = {"file_format": "OPEN_EXR", "color_mode": "RGB", "color_depth": "32"}
    with (
        _set(scene.render.image_settings, **settings),
        tempfile.TemporaryDirectory() as folder,
    ):
        path = Path(folder) / "radiance.exr"
        _render_to(scene, path)
        return _read_pixels(path)


def sphere_mesh(material: bpy.types.Material | None, subdivisions: int = 6) -> bpy.types.Mesh:
    """A smooth unit sphere of the material."""
    mesh = bpy.data.meshes.new("Sphere")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=subdivisions, radius=1.0)
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    # A sphere's own normals; those of the faces around a vertex only come close.
    mesh.normals_split_custom_set_from_vertices([v.co.normalized() for v in mesh.vertices])
    mesh.materials.append(material)
    return mesh


def _pixels_under(scene: bpy.types.Scene, sun: Any, suns: list[Any]) -> NDArray[np.float32]:
    with contextlib.ExitStack() as restored:
        for other in suns:
            restored.enter_context(_set(other, hide_render=other != sun))
        return radiance(scene)


def _render_to(scene: bpy.types.Scene, path: str | os.PathLike[str]) -> None:
    full = os.path.abspath(path)
    with _set(scene.render, filepath=full, use_file_extension=False):
        bpy.ops.render.render(scene=scene.name, write_still=True)


def _read_pixels(path: Path) -> NDArray[np.float32]:
    image = bpy.data.images.load(str(path))
    try:
        image.colorspace_settings.is_data = True
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        columns, rows = image.size
    finally:
        bpy.data.images.remove(image)
    return pixels.reshape(rows, columns, -1)[::-1, :, :3]


def _add(scene: bpy.types.Scene, name: str, data: bpy.types.ID) -> bpy.types.Object:
    item = bpy.data.objects.new(name, data)
    scene.collection.objects.link(item)
    return item


def _camera() -> bpy.types.Camera:
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 2.0
    return camera


def _sun(name: str) -> bpy.types.Light:
    sun = bpy.data.lights.new(name, "SUN")
    # On a convex shape a shadow could only be an error.
    sun.energy, sun.angle, sun.use_shadow = 1.0, 0.0, False
    return sun


def _set_up_cycles(scene: bpy.types.Scene) -> None:
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.seed, cycles.max_bounces = "CPU", 128, 0, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.light_sampling_threshold = 0.0


@contextlib.contextmanager
def _set(owner: Any, **values: Any) -> Iterator[None]:
    """Sets properties of `owner` for as long as the block runs."""
    before = {name: getattr(owner, name) for name in values}
    try:
        for name, value in values.items():
            setattr(owner, name, value)
        yield
    finally:
        for name, value in before.items():
            setattr(owner, name, value)
