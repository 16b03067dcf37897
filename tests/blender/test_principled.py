"""The Principled BSDF that a record holds: as Cycles renders it, and as exporters find it."""

import importlib

import bpy
import lobefit._native
import numpy as np
import pytest
from mathutils import Vector

SIZE = 64

# What the sockets do one by one, and what they do together. Sharper highlights show how accurate
# Cycles' own normals are, not the formula.
MATERIALS = {
    "plastic": ((0.8, 0.3, 0.1), 0.0, 0.5, 1.5, (1.0, 1.0, 1.0)),
    "tinted coat": ((0.8, 0.3, 0.1), 0.0, 0.27, 2.3, (0.2, 0.6, 1.0)),
    "metal": ((0.8, 0.3, 0.1), 1.0, 0.35, 1.5, (0.2, 0.6, 1.0)),
    "half metal": ((0.9, 0.5, 0.0), 0.4, 0.8, 6.0, (0.0, 0.9, 0.3)),
    "densest coat": ((0.9, 0.5, 0.3), 0.1, 1.0, 99.0, (0.5, 0.9, 0.3)),
    "no coat": ((1.0, 1.0, 1.0), 0.0, 0.2, 1.0, (1.0, 1.0, 1.0)),
    "thin coat": ((1.0, 1.0, 1.0), 0.0, 0.93, 1.1, (1.0, 1.0, 1.0)),
}


def record_entry(base_color, metallic, roughness, ior, specular_tint):
    """The `principled` entry of a record."""
    return {
        "base_color": list(base_color),
        "metallic": metallic,
        "roughness": roughness,
        "ior": ior,
        "specular_tint": list(specular_tint),
        "error": 0.0,
    }


@pytest.fixture
def nodes(addon):
    """The module that makes the node."""
    return importlib.import_module(f"{addon.__name__}.nodes.principled")


@pytest.fixture
def scene_tools(addon):
    """The module that sets up Cycles and reads pixels."""
    return importlib.import_module(f"{addon.__name__}.scene")


def principled_material(nodes, entry):
    """A material that shows nothing but the node."""
    material = bpy.data.materials.new("principled")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(nodes.principled_node(tree, entry).outputs[0], output.inputs[0])
    return material


def random_normals(count):
    """(count, 3) unit normals up to 84 degrees from +z, the same ones every time."""
    random = np.random.default_rng(1)
    z = random.uniform(np.cos(np.radians(84)), 1, count)
    azimuth, radius = random.uniform(0, 2 * np.pi, count), np.sqrt(1 - z**2)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], 1)


def facet_mesh(normals, material):
    """SIZE x SIZE facets that fill the picture row by row from the top, each with its normal."""
    row, column = np.divmod(np.arange(SIZE**2), SIZE)
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / SIZE
    centres = np.stack([2 * column + 1 - SIZE, SIZE - 1 - 2 * row], 1) / SIZE
    height = -(normals[:, None, :2] * corners).sum(-1, keepdims=True) / normals[:, None, 2:]
    vertices = np.concatenate([centres[:, None] + corners, height], -1).reshape(-1, 3)
    mesh = bpy.data.meshes.new("facets")
    mesh.from_pydata(vertices.tolist(), [], np.arange(4 * SIZE**2).reshape(-1, 4).tolist())
    mesh.materials.append(material)
    return mesh


def local(normals, direction):
    """The direction in a frame of each normal, whose z axis it is."""
    x = np.cross(normals, np.where(np.abs(normals[:, :1]) < 0.9, (1, 0, 0), (0, 1, 0)))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(normals, x), normals], 1) @ direction


@pytest.mark.parametrize("name", MATERIALS)
def test_cycles_renders_the_formula(nodes, scene_tools, name):
    entry = record_entry(*MATERIALS[name])
    normals = random_normals(SIZE**2)
    scene = scene_tools.two_lights_scene(principled_material(nodes, entry), SIZE)
    sphere = next(item for item in scene.objects if item.type == "MESH")
    sphere.data = facet_mesh(normals, sphere.data.materials[0])
    sun, other = (item for item in scene.objects if item.type == "LIGHT")
    bpy.data.objects.remove(other)
    for angle in (10, 50, 95, 140):
        toward_light = np.array([np.sin(np.radians(angle)), 0, np.cos(np.radians(angle))])
        sun.rotation_euler = Vector(toward_light).to_track_quat("Z", "Y").to_euler()
        rendered = scene_tools.render_pixels(scene).reshape(-1, 3)
        expected = lobefit._native.evaluate_principled(
            entry, local(normals, toward_light), local(normals, np.array([0, 0, 1.0]))
        )
        difference = np.abs(rendered - expected)
        assert difference.max() < 2e-3 * expected.max(), f"light at {angle} degrees"
        assert difference.sum() < 3e-4 * expected.sum(), f"light at {angle} degrees"


def test_values_stand_in_unlinked_sockets(nodes):
    entry = record_entry(*MATERIALS["half metal"])
    tree = principled_material(nodes, entry).node_tree
    node = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    assert not any(socket.is_linked for socket in node.inputs)
    assert node.distribution == "GGX"
    assert node.inputs["Base Color"].default_value[:] == pytest.approx((0.9, 0.5, 0.0, 1.0))
    assert node.inputs["Specular Tint"].default_value[:] == pytest.approx((0.0, 0.9, 0.3, 1.0))
    for name, value in (("Metallic", 0.4), ("Roughness", 0.8), ("IOR", 6.0)):
        assert node.inputs[name].default_value == pytest.approx(value)
