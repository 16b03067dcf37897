"""The group Classic Phong / Blinn-Phong: Cycles' pixels against the formula, and its lights."""

import bpy
import lobefit
import numpy as np
import pytest
from facets import UP, add, light_at, new_scene, sphere_normals
from mathutils import Euler
from surroundings import described, group_node

# Every light has a colour of its own, and another for its highlights; one grazes the rim from
# behind, and no direction is of unit length.
LIGHTS = [
    ((1.0, 1.0, 1.2), (0.9, 0.5, 0.1), (1.0, 0.9, 0.3)),
    ((-1.0, -1.0, -0.55), (0.1, 0.4, 0.9), (0.2, 0.6, 2.5)),
    ((-0.9, 0.8, 0.1), (0.2, 0.8, 0.3), (0.9, 0.1, 0.8)),
    ((0.0, -3.0, 0.5), (0.3, 0.3, 0.3), (0.5, 1.5, 0.5)),
]
AMBIENT, DIFFUSE, SPECULAR = (0.3, 0.2, 0.1), (0.6, 0.5, 0.7), (0.9, 0.8, 0.4)
AMBIENT_LIGHT = (0.2, 0.5, 0.4)


def unit(vector):
    return np.array(vector) / np.linalg.norm(vector)


def terms(normals, light, exponent, half_vector):
    """L.N and the specular power of a light seen from above, each cut where the model cuts it."""
    direction = unit(light)
    incidence = normals @ direction
    mirrored = 2 * incidence[:, None] * normals - direction
    cosine = normals @ unit(direction + UP) if half_vector else mirrored @ UP
    power = np.maximum(cosine, 0) ** exponent * (cosine > 0) * (incidence > 0)
    return np.maximum(incidence, 0), power


def formula(normals, exponent, half_vector, lights=LIGHTS):
    """The classic model's pixels (N, 3)."""
    total = np.array(AMBIENT) * AMBIENT_LIGHT
    for light, diffuse, specular in lights:
        incidence, power = terms(normals, light, exponent, half_vector)
        total = total + incidence[:, None] * np.array(DIFFUSE) * diffuse
        total = total + power[:, None] * np.array(SPECULAR) * specular
    return total


@pytest.fixture
def classic(addon):
    """Makes a classic material with these inputs: the material and the node of its group."""

    def made(lights=LIGHTS, **inputs):
        item = add(new_scene(8), bpy.data.meshes.new("sphere"))
        bpy.context.view_layer.objects.active = item
        assert bpy.ops.lobefit.make_classic() == {"FINISHED"}
        material = item.active_material
        node = group_node(material)
        values = {
            "Ambient Color": (*AMBIENT, 1),
            "Diffuse Color": (*DIFFUSE, 1),
            "Specular Color": (*SPECULAR, 1),
            "Ambient Light": (*AMBIENT_LIGHT, 1),
        }
        for number, (light, diffuse, specular) in enumerate(lights, 1):
            values[f"Light {number} Direction"] = light
            values[f"Light {number} Diffuse"] = (*diffuse, 1)
            values[f"Light {number} Specular"] = (*specular, 1)
        for name, value in (values | inputs).items():
            node.inputs[name].default_value = value
        return material, node

    return made


def clear_of_cuts(normals, lights=LIGHTS):
    """Where no dot product is so near zero that single precision may cut otherwise."""
    clear = np.ones(len(normals), bool)
    for light, _, _ in lights:
        direction = unit(light)
        incidence = normals @ direction
        clear &= abs(incidence) > 1e-5
        clear &= abs(2 * incidence * normals[:, 2] - direction[2]) > 1e-5
    return clear


@pytest.mark.parametrize("exponent", [0.0, 0.4, 3.0, 20.0, 300.0])
@pytest.mark.parametrize("half_vector", [False, True])
def test_cycles_renders_the_formula(classic, render, exponent, half_vector):
    material, _ = classic(**{"Exponent": exponent, "Blinn-Phong": float(half_vector)})
    normals = sphere_normals()
    # A sun of the scene adds nothing: the group knows its own lights alone.
    rendered = render(material, light_at(30))
    apart = np.abs(rendered - formula(normals, exponent, half_vector))
    # Powers of small exponents rise steeply where the term is cut, so that even there the cut must
    # be at the same place.
    assert apart[clear_of_cuts(normals)].max() < 1e-4
    assert clear_of_cuts(normals).mean() > 0.99


def test_the_two_models_blend(classic, render):
    material, _ = classic(**{"Exponent": 9.0, "Blinn-Phong": 0.25})
    both = [formula(sphere_normals(), 9.0, half_vector) for half_vector in (False, True)]
    expected = 0.75 * both[0] + 0.25 * both[1]
    assert np.abs(render(material, light_at(30)) - expected).max() < 1e-4


def test_terms_are_cut_where_they_should_be(classic, render):
    lights = [*LIGHTS[1:2], *[((0, 0, 1), (0, 0, 0), (0, 0, 0))] * 3]
    normals, direction = sphere_normals(), unit(LIGHTS[1][0])
    ambient = np.array(AMBIENT) * AMBIENT_LIGHT
    inputs = {"Exponent": 0.0, "Diffuse Color": (0, 0, 0, 1)}
    shown = {}
    for half_vector in (False, True):
        material, _ = classic(lights, **inputs, **{"Blinn-Phong": float(half_vector)})
        shown[half_vector] = np.abs(render(material, UP) - ambient).max(1) > 1e-4
    lit = normals @ direction > 0
    mirrored = 2 * (normals @ direction) * normals[:, 2] - direction[2]
    clear = clear_of_cuts(normals, lights)
    # Phong ends at 90 degrees from the mirrored light, Blinn-Phong with the lit side alone, where
    # N.H is positive too.
    assert (shown[False] == (lit & (mirrored > 0)))[clear].all()
    assert (shown[True] == lit)[clear].all()
    # A light from the side that faces the viewer, mirrored away from it: there they differ.
    side = [((1.0, 0.0, 0.3), (0, 0, 0), (1, 1, 1)), *lights[1:]]
    material, _ = classic(side, **inputs)
    direction = unit(side[0][0])
    lit = normals @ direction > 0
    cut = lit & (2 * (normals @ direction) * normals[:, 2] - direction[2] < 0)
    dark = np.abs(render(material, UP) - ambient).max(1) < 1e-6
    clear = clear_of_cuts(normals, side)
    assert cut.sum() > 50 and dark[cut & clear].all() and not dark[lit & ~cut & clear].any()


def test_matched_exponents_change_blinn_phong_alone(addon, classic, render):
    matched = addon.nodes.classic.matched_exponent(12.0)
    normals = sphere_normals()
    for half_vector, expected in ((False, 12.0), (True, matched)):
        material, _ = classic(
            **{"Exponent": 12.0, "Match Exponent": 1.0, "Blinn-Phong": float(half_vector)}
        )
        rendered = render(material, light_at(30))
        assert np.abs(rendered - formula(normals, expected, half_vector)).max() < 1e-4


@pytest.mark.parametrize(("exponent", "bound"), [(0.1, 0.02), (0.4, 0.02), (1, 0.005), (30, 0.005)])
def test_the_group_s_match_is_near_the_best_one(addon, exponent, bound):
    best = lobefit.match_exponent(exponent).exponent
    assert addon.nodes.classic.matched_exponent(exponent) == pytest.approx(best, rel=bound)


def test_a_connected_normal_is_used_and_the_colour_comes_out(classic, render):
    material, node = classic(**{"Exponent": 7.0})
    tree = material.node_tree
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    # Not of unit length, as what a user connects may be.
    bent = tree.nodes.new("ShaderNodeVectorMath")
    bent.inputs[1].default_value = (0.4, 0.0, 0.0)
    tree.links.new(geometry.outputs["Normal"], bent.inputs[0])
    tree.links.new(bent.outputs[0], node.inputs["Normal"])
    # A colour at a surface output is shown as emission.
    output = next(item for item in tree.nodes if item.type == "OUTPUT_MATERIAL")
    tree.links.new(node.outputs["Color"], output.inputs["Surface"])
    normals = np.tile(unit((0.4, 0.0, 1.0)), (len(sphere_normals()), 1))
    flat = np.tile(UP, (len(normals), 1))
    assert np.abs(render(material, UP, flat) - formula(normals, 7.0, False)).max() < 1e-4


def test_one_group_whose_inputs_are_those_that_saved_files_hold(addon, classic):
    first, second = classic()[1], classic()[1]
    assert first.node_tree == second.node_tree == addon.nodes.classic.classic_group()
    names = [
        "Ambient Color",
        "Diffuse Color",
        "Specular Color",
        "Exponent",
        "Blinn-Phong",
        "Match Exponent",
        "Normal",
        "Ambient Light",
    ]
    lights = [
        f"Light {n} {what}" for n in range(1, 5) for what in ("Direction", "Diffuse", "Specular")
    ]
    assert [socket.name for socket in first.inputs] == names + lights
    # The outputs have the numbers 0 and 1; a panel before each light's inputs has one too.
    numbers = [int(socket.identifier.removeprefix("Socket_")) for socket in first.inputs]
    assert numbers == [*range(2, 10), 11, 12, 13, 15, 16, 17, 19, 20, 21, 23, 24, 25]


def test_the_same_source_makes_the_same_tree(addon):
    group = addon.nodes.classic.classic_group
    assert described(group()) == described(group())


def add_sun(angles, energy, colour=(1.0, 1.0, 1.0)):
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.color = energy, colour
    item = add(bpy.context.scene, sun)
    item.rotation_euler = Euler(angles)
    bpy.context.view_layer.update()
    return item


def test_lights_are_taken_from_the_scene(classic, two_lights):
    _, node = classic()
    for energy in (1.0, 2.0):
        add_sun((0.0, np.pi / 2, 0.0), energy, (0.5, 1.0, 0.25))
    brightest = add_sun((np.pi / 2, 0.0, 0.0), 5.0)
    brightest.data.diffuse_factor, brightest.data.specular_factor = 0.5, 0.1
    add_sun((0.0, 0.0, 0.0), 99.0).hide_render = True
    bpy.context.scene.world = two_lights.uniform_world("grey", 0.3)
    assert bpy.ops.lobefit.take_lights() == {"FINISHED"}

    def taken(light, what):
        return list(node.inputs[f"Light {light} {what}"].default_value)[:3]

    # Suns shine along -z of their own. i_d = strength / pi, as a diffuse closure would show it.
    assert taken(1, "Direction") == pytest.approx([0, -1, 0], abs=1e-6)
    assert taken(1, "Diffuse") == pytest.approx([2.5 / np.pi] * 3)
    assert taken(1, "Specular") == pytest.approx([0.5 / np.pi] * 3)
    assert taken(2, "Direction") == pytest.approx([1, 0, 0], abs=1e-6)
    assert taken(2, "Diffuse") == pytest.approx(np.array([1, 2, 0.5]) / np.pi)
    assert taken(3, "Specular") == pytest.approx(np.array([0.5, 1, 0.25]) / np.pi)
    assert taken(4, "Diffuse") == taken(4, "Specular") == [0, 0, 0]
    assert list(node.inputs["Ambient Light"].default_value)[:3] == pytest.approx([0.3] * 3)


def test_a_new_material_takes_the_brightest_suns(addon):
    item = add(new_scene(8), bpy.data.meshes.new("sphere"))
    for energy in (3.0, 6.0, 1.0, 5.0, 2.0, 4.0):
        add_sun((0.0, 0.0, 0.0), energy)
    bpy.context.view_layer.objects.active = item
    assert bpy.ops.lobefit.make_classic() == {"FINISHED"}
    node = group_node(item.active_material)
    reds = [node.inputs[f"Light {n} Diffuse"].default_value[0] for n in range(1, 5)]
    assert np.array(reds) * np.pi == pytest.approx([6, 5, 4, 3])


def test_without_a_sun_nothing_is_taken(classic):
    _, node = classic()
    before = [tuple(node.inputs["Light 1 Diffuse"].default_value)]
    with pytest.raises(RuntimeError, match="Expected a sun in the scene, found none"):
        bpy.ops.lobefit.take_lights()
    assert [tuple(node.inputs["Light 1 Diffuse"].default_value)] == before


def test_a_world_of_many_colours_leaves_the_ambient_light(classic, two_lights):
    _, node = classic()
    add_sun((0.0, 0.0, 0.0), 1.0)
    world = two_lights.uniform_world("sky", 1.0)
    sky = world.node_tree.nodes.new("ShaderNodeTexGradient")
    background = next(item for item in world.node_tree.nodes if item.type == "BACKGROUND")
    world.node_tree.links.new(sky.outputs[0], background.inputs["Color"])
    bpy.context.scene.world = world
    assert bpy.ops.lobefit.take_lights() == {"FINISHED"}
    assert list(node.inputs["Ambient Light"].default_value)[:3] == pytest.approx(AMBIENT_LIGHT)


def test_a_taken_sun_shows_the_diffuse_closure_s_picture(addon, classic, render):
    material, node = classic(**{"Specular Color": (0, 0, 0, 1), "Ambient Color": (0, 0, 0, 1)})
    add_sun((0.4, 0.3, 0.2), 1.0)
    bpy.ops.lobefit.take_lights()
    direction = np.array(node.inputs["Light 1 Direction"].default_value)
    plain = bpy.data.materials.new("diffuse")
    tree = addon.nodes.tree.empty_shader_tree(plain)
    closure = tree.nodes.new("ShaderNodeBsdfDiffuse")
    closure.inputs["Color"].default_value = (*DIFFUSE, 1)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(closure.outputs[0], output.inputs["Surface"])
    expected = render(plain, direction)
    assert np.abs(render(material, direction) - expected).max() < 1e-5 and expected.max() > 0.1
