"""Scenes that Cycles renders exactly, so that its pictures can be held against formulas.

The facet grid shows one flat facet a pixel to a camera that looks down -z, so that every pixel is
one pair of directions, known to single precision, under one sun.
"""

from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

SIZE = 48
UP = np.array([0.0, 0.0, 1.0])


def light_at(phase):
    """A direction at this angle (degrees) from the camera, which looks down -z."""
    a = np.radians(phase)
    return np.array([np.sin(a) * 0.8, np.sin(a) * 0.6, np.cos(a)])


def sphere_normals():
    """The normals (N, 3) of a sphere's pixels, by rows from below; straight up outside of it."""
    place = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    x, y = np.meshgrid(place, place)
    z2 = 1 - x**2 - y**2
    normals = np.stack([x, y, np.sqrt(np.maximum(z2, 0))], -1).reshape(-1, 3)
    return np.where(z2.reshape(-1, 1) > 0.1**2, normals, UP)


def local(normals, direction):
    """One direction (3) or one each (N, 3) in frames whose z axes are the normals: (N, 3)."""
    side = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    tangent = np.cross(side, normals)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = np.stack([tangent, np.cross(normals, tangent), normals], 1)
    return (frame @ np.asarray(direction)[..., None])[..., 0]


def facet_mesh(normals):
    """One flat quadrilateral a pixel with the pixel's normal: so no mesh error enters."""
    size = round(len(normals) ** 0.5)
    row, column = np.divmod(np.arange(len(normals)), size)
    vertices = np.zeros((len(normals), 4, 3))
    for k, (dx, dy) in enumerate([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]):
        vertices[:, k, 0], vertices[:, k, 1] = column + 0.5 + dx, row + 0.5 + dy
        vertices[:, k, 2] = -(normals[:, 0] * dx + normals[:, 1] * dy) / normals[:, 2]
    vertices -= [size / 2, size / 2, 0]
    mesh = bpy.data.meshes.new("facets")
    faces = np.arange(4 * len(normals)).reshape(-1, 4)
    mesh.from_pydata(vertices.reshape(-1, 3).tolist(), [], faces.tolist())
    return mesh


def new_scene(size, samples=1):
    """An empty scene for Cycles whose pictures are the same every time: one sample is exact."""
    bpy.ops.scene.new(type="EMPTY")
    scene = bpy.context.scene
    scene.world = None
    cycles, settings = scene.cycles, scene.render
    settings.engine = "CYCLES"
    cycles.device, cycles.samples, cycles.max_bounces, cycles.seed = "CPU", samples, 0, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.light_sampling_threshold, cycles.pixel_filter_type = 0.0, "BOX"
    settings.resolution_x = settings.resolution_y = size
    settings.resolution_percentage = 100
    settings.image_settings.file_format = "OPEN_EXR"
    settings.image_settings.color_depth, settings.image_settings.color_mode = "32", "RGB"
    return scene


def add(scene, data, place=None):
    """An object of the data at a place (a matrix)."""
    item = bpy.data.objects.new(data.name, data)
    item.matrix_world = place or Matrix.Identity(4)
    scene.collection.objects.link(item)
    return item


def add_sun(scene, light, turn=None):
    """A sun that throws no shadows, in a direction."""
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle, sun.use_shadow = 1.0, 0.0, False
    toward = Vector(light).to_track_quat("Z", "Y").to_matrix().to_4x4()
    add(scene, sun, (turn or Matrix.Identity(4)) @ toward)


def add_camera(scene, place, width=None):
    """The scene's camera; with a width it sees that much by parallel rays."""
    camera = bpy.data.cameras.new("camera")
    camera.clip_end = 1e4
    if width is not None:
        camera.type, camera.ortho_scale = "ORTHO", width
    scene.camera = add(scene, camera, place)


def pixels_of(scene, folder):
    """What the scene's camera sees: (N, 3), by rows from below."""
    settings = scene.render
    settings.filepath = str(Path(folder) / "picture.exr")
    bpy.ops.render.render(write_still=True, scene=scene.name)
    image = bpy.data.images.load(settings.filepath)
    image.colorspace_settings.is_data = True
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(settings.resolution_x * settings.resolution_y, -1)[:, :3].astype(float)


def render_facets(folder, mesh, light, turn=None):
    """f cos of a mesh of facets under one sun, exactly; `turn` turns all of the scene."""
    turn = turn or Matrix.Identity(4)
    size = round(len(mesh.polygons) ** 0.5)
    scene = new_scene(size)
    add(scene, mesh, turn)
    add_camera(scene, turn @ Matrix.Translation((0, 0, 999)), width=size)
    add_sun(scene, light, turn)
    return pixels_of(scene, folder)
