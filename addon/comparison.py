"""The scene of the pictures with a user's material in it, beside the measurement."""

import math
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from .images import for_blender
from .nodes.tree import empty_shader_tree

BLEND = Path(__file__).parent / "blend_files" / "two_lights.blend"
_SCENE = "Two Lights"
_APART = 1.05  # half of the way between the two spheres, of radius 1
# What is up for an artist (z) is up in the picture (y), and their front is toward the camera.
_UPRIGHT = Matrix.Rotation(-math.pi / 2, 4, "X")


def open_scene(
    context: bpy.types.Context,
    material: bpy.types.Material,
    subject: bpy.types.Object | None,
    reference: np.ndarray | None,
) -> bpy.types.Scene:
    """Brings the scene of the extension into this file, as the current one seen by its camera.

    It shows a copy of the subject, or else a sphere of the material, and beside it the light of a
    measured sphere (rows from the top, linear RGB), if that is given.
    """
    depsgraph = context.evaluated_depsgraph_get()
    scene = _appended()
    sphere = next(item for item in scene.objects if item.type == "MESH")
    shown = sphere
    if subject is not None:
        shown = _fitted_copy(subject, depsgraph)
        scene.collection.objects.link(shown)
        bpy.data.objects.remove(sphere)
    else:
        sphere.data.materials[0] = material
    _remove_unused()
    if reference is not None:
        _put_beside(scene, shown, reference, material.name)
    context.window.scene = scene
    shown.select_set(True)
    context.view_layer.objects.active = shown
    _look_through_camera(context)
    return scene


def _appended() -> bpy.types.Scene:
    with bpy.data.libraries.load(str(BLEND)) as (_, ours):
        ours.scenes = [_SCENE]
    return ours.scenes[0]


def _remove_unused() -> None:
    """Removes what came with the scene to be replaced."""
    for material in [m for m in bpy.data.materials if m.users == 0 and m.name == "Material"]:
        bpy.data.materials.remove(material)


def _fitted_copy(item: bpy.types.Object, depsgraph: Any) -> bpy.types.Object:
    """A copy of an object that shares its data, upright within a sphere of radius 1."""
    corners = [
        item.matrix_world @ Vector(corner) for corner in item.evaluated_get(depsgraph).bound_box
    ]
    centre = sum(corners, Vector()) / len(corners)
    radius = max((corner - centre).length for corner in corners) or 1.0
    copy = item.copy()
    copy.animation_data_clear()
    copy.parent = None
    copy.constraints.clear()
    copy.hide_render = copy.hide_viewport = False
    copy.matrix_world = (
        Matrix.Scale(1 / radius, 4) @ _UPRIGHT @ Matrix.Translation(-centre) @ item.matrix_world
    )
    return copy


def _put_beside(
    scene: bpy.types.Scene, shown: bpy.types.Object, reference: np.ndarray, name: str
) -> None:
    """Makes room in the picture for the measured sphere, to the left of what is shown."""
    shown.matrix_world = Matrix.Translation((_APART, 0, 0)) @ shown.matrix_world
    image = _image(f"{name} measured", reference)
    mesh = bpy.data.meshes.new("Measured")
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new()
    for loop, (x, y, _) in zip(layer.data, corners, strict=True):
        loop.uv = ((x + 1) / 2, (y + 1) / 2)
    mesh.materials.append(_picture_material(image))
    plane = bpy.data.objects.new("Measured", mesh)
    plane.location = (-_APART, 0, 0)
    # It is for the camera: its light, which is brightest in the highlights, is not to fall on what
    # stands beside it.
    for ray in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(plane, f"visible_{ray}", False)
    scene.collection.objects.link(plane)
    scene.camera.data.ortho_scale = 4 * _APART
    scene.render.resolution_x = 2 * scene.render.resolution_y


def _image(name: str, light: np.ndarray) -> bpy.types.Image:
    size = len(light)
    place = (np.arange(size) + 0.5) * 2 / size - 1
    cover = np.hypot(place, place[:, None]) < 1
    pixels = for_blender(np.dstack([np.nan_to_num(light), cover]))
    image = bpy.data.images.new(name, size, size, alpha=True, float_buffer=True, is_data=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


def _picture_material(image: bpy.types.Image) -> bpy.types.Material:
    """Shows the light of a picture as it is, and nothing where there is none in it."""
    material = bpy.data.materials.new(image.name)
    material.cycles.emission_sampling = "NONE"
    tree = empty_shader_tree(material)
    picture, light, nothing, mix, output = (
        tree.nodes.new(f"ShaderNode{name}")
        for name in ("TexImage", "Emission", "BsdfTransparent", "MixShader", "OutputMaterial")
    )
    picture.image = image
    for place, node in enumerate((picture, light, nothing, mix, output)):
        node.location = (250.0 * place, 0.0)
    tree.links.new(picture.outputs["Color"], light.inputs["Color"])
    tree.links.new(picture.outputs["Alpha"], mix.inputs[0])
    tree.links.new(nothing.outputs[0], mix.inputs[1])
    tree.links.new(light.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def _look_through_camera(context: bpy.types.Context) -> None:
    for area in context.window.screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.region_3d.view_perspective = "CAMERA"
