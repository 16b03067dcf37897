"""The scene with two lights: in a file, rendered by Cycles, and drawn by the C++ preview."""

import json
from pathlib import Path

import bpy
import lobefit._native
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SIZE = 96


def inside(radius):
    """The pixels of the picture up to this share of the sphere's radius."""
    place = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    return np.hypot(place, place[:, None]) < radius


def test_preview_is_what_cycles_renders(two_lights, material):
    closures = json.loads(material["lobefit_record"])["closures"][0]
    preview = lobefit._native.preview(("closures", closures), SIZE)
    rendered = two_lights.render_pixels(two_lights.two_lights_scene(material, SIZE))
    difference = np.abs(preview - rendered)[inside(0.97)]
    # What differs is the mesh: its facets move a sharp highlight by a small part of a pixel.
    assert difference.max() < 0.01 * preview.max()
    assert difference.sum() < 0.01 * preview[inside(0.97)].sum()


def white_material():
    """Diffuse white for all renderers."""
    material = bpy.data.materials.new("white")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    nodes = material.node_tree.nodes
    white = nodes.new("ShaderNodeBsdfDiffuse")
    white.inputs["Color"].default_value = (1, 1, 1, 1)
    output = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
    material.node_tree.links.new(white.outputs[0], output.inputs[0])
    return material


def test_a_white_diffuse_sphere(two_lights):
    parameters = {
        "model": "modified-phong",
        "diffuse": [1, 1, 1],
        "specular": [0, 0, 0],
        "exponent": 1.0,
        "interpolation": None,
        "ior": None,
    }
    scene = two_lights.two_lights_scene(white_material(), SIZE)
    rendered = two_lights.render_pixels(scene)
    difference = np.abs(lobefit._native.preview(parameters, SIZE) - rendered)
    assert difference[inside(0.97)].max() < 1e-3
    assert rendered[~inside(1.05)].max() == 0


def test_a_picture_in_a_file(two_lights, material, tmp_path):
    two_lights.render(two_lights.two_lights_scene(material, 32), tmp_path / "picture")
    assert (tmp_path / "picture").read_bytes().startswith(b"\x89PNG")


def test_the_scene_of_the_user_is_left_alone(two_lights, material):
    bpy.ops.mesh.primitive_cube_add()
    mine = bpy.context.scene
    before = len(mine.objects)
    assert two_lights.two_lights_scene(material, 32) == bpy.context.scene != mine
    assert len(mine.objects) == before


def test_the_file_holds_the_same_scene(two_lights):
    expected = two_lights.render_pixels(two_lights.two_lights_scene(white_material(), 32))
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "blend_files/two_lights.blend"))
    scene = bpy.context.scene
    scene.objects["Sphere"].active_material = white_material()
    scene.render.resolution_x = scene.render.resolution_y = 32
    # Releases round the normals of a mesh differently.
    assert np.abs(two_lights.render_pixels(scene) - expected).max() < 1e-3 * expected.max()
