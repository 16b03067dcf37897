"""The live group: what Cycles renders against the formula, and against the C++ mirror."""

import json
from types import SimpleNamespace

import bpy
import lobefit._native
import numpy as np
import pytest
from facets import SIZE, UP, light_at, local, sphere_normals
from mathutils import Matrix, Vector
from surroundings import described, group_node, white_world_albedo

PRINCIPLED = {
    "base_color": [0.1, 0.2, 0.3],
    "metallic": 0.0,
    "roughness": 0.4,
    "ior": 1.5,
    "specular_tint": [1.0, 1.0, 1.0],
}


def lobe(**changes):
    """Parameters of an interpolated lobe."""
    return {
        "model": "interpolated",
        "diffuse": [0.3, 0.2, 0.1],
        "specular": [2.0, 1.5, 1.0],
        "exponent": 50.0,
        "interpolation": 0.5,
        "ior": None,
        **changes,
    }


def record(parameters):
    """As much of a record as a material needs."""
    return SimpleNamespace(
        name="Measured",
        parameters=parameters,
        principled=PRINCIPLED,
        to_json=lambda: json.dumps({"parameters": parameters}),
    )


@pytest.fixture
def build(addon):
    """Builds the material of parameters."""
    return lambda **changes: addon.nodes.material.build_material(record(lobe(**changes)))


def mirrored(parameters, light, normals):
    """What the C++ mirror of the group computes for the same pixels."""
    wi, wo = local(normals, light), local(normals, UP)
    return lobefit._native.evaluate_live(parameters, wi, wo)


def test_inputs_are_those_that_saved_files_hold(addon):
    items = addon.nodes.live.live_group().interface.items_tree
    inputs = [item for item in items if item.in_out == "INPUT"]
    assert [item.name for item in inputs] == [
        "Base Color",
        "Specular Color",
        "Specular Strength",
        "Exponent",
        "Interpolation",
        "IOR",
        "Fresnel",
        "Normal",
        "Conserve Energy",
    ]
    # The output has number 8: what came later leaves the identifiers as they were.
    numbers = [int(item.identifier.removeprefix("Socket_")) for item in inputs]
    assert numbers == [*range(8), 9]


def test_one_group_for_all_materials(addon, build):
    first, second = build(), build(exponent=9.0)
    assert group_node(first).node_tree == group_node(second).node_tree
    assert [group.name for group in bpy.data.node_groups] == ["Lobefit Live"]


def test_a_group_of_another_version_is_left_alone(addon, build):
    old = group_node(build()).node_tree
    old[addon.nodes.live.VERSION_KEY] = 0
    assert group_node(build()).node_tree != old


def test_the_same_source_makes_the_same_tree(addon):
    group = addon.nodes.live.live_group
    assert described(group()) == described(group())


def test_two_outputs_and_the_record(build):
    material = build()
    outputs = {node.target: node for node in material.node_tree.nodes if "Output" in node.bl_idname}
    assert outputs["ALL"].is_active_output and not outputs["CYCLES"].is_active_output
    assert outputs["ALL"].inputs[0].links[0].from_node.type == "BSDF_PRINCIPLED"
    assert outputs["CYCLES"].inputs[0].links[0].from_node.type == "GROUP"
    assert json.loads(material["lobefit_record"])["parameters"]["exponent"] == 50


@pytest.mark.parametrize("exponent", [0.5, 5.0, 700.0, 3e6])
@pytest.mark.parametrize("interpolation", [0.0, 0.4, 1.0])
def test_specular_coefficient_comes_back(addon, build, exponent, interpolation):
    material = build(exponent=exponent, interpolation=interpolation, specular=[1e7, 2.0, 0.0])
    inputs = group_node(material).inputs
    strength = inputs["Specular Strength"].default_value
    albedo = np.array(inputs["Specular Color"].default_value[:3]) * strength
    stored = inputs["Exponent"].default_value, inputs["Interpolation"].default_value
    k_s = albedo / addon.nodes.live.normal_albedo(*stored)
    # Sockets are single precision: six digits each.
    assert k_s == pytest.approx([1e7, 2.0, 0.0], rel=1e-6)


@pytest.mark.parametrize(
    "changes",
    [
        {"exponent": 5.0, "interpolation": 0.0},
        {"exponent": 2.0, "interpolation": 0.7, "ior": 1.2},
        {"exponent": 0.2, "interpolation": 0.3, "ior": 1.5},
        {"exponent": 60.0, "interpolation": 1.0, "ior": 1.5},
        {"exponent": 900.0, "interpolation": 0.5, "ior": 2.5, "specular": [90.0, 70.0, 50.0]},
        {"exponent": [20.0, 80.0, 20.0], "interpolation": 0.2, "ior": 1.4},
        {"model": "modified-phong", "exponent": 30.0, "interpolation": None},
        {"model": "modified-blinn-phong", "exponent": 90.0, "interpolation": None, "ior": 1.6},
    ],
)
def test_cycles_computes_what_the_mirror_does(build, render, changes):
    material, normals = build(**changes), sphere_normals()
    for phase in (8, 47, 101, 152):
        expected = mirrored(lobe(**changes), light_at(phase), normals)
        difference = np.abs(render(material, light_at(phase)) - expected)
        # Single precision against double: 1e-4 of a peak. But Cycles leaves out a closure whose
        # weight is below 1e-5, which is up to 2e-3 where the broad one ends.
        assert difference.max() < 2e-3 * expected.max()


@pytest.mark.parametrize(
    ("exponent", "interpolation", "ior", "bound"),
    # About a tenth above what is left: two closures leave out what grows as 1 / exponent,
    # most of it at the last phase, where only light that all but grazes is seen.
    [
        (0.3, 0.5, 1.5, 0.099),
        (1.0, 0.0, None, 0.128),
        (1.0, 0.5, 1.5, 0.073),
        (5.0, 0.0, None, 0.066),
        (5.0, 0.5, None, 0.052),
        (5.0, 1.0, 1.5, 0.046),
        (15.0, 0.0, None, 0.053),
        (50.0, 0.0, None, 0.0275),
        (50.0, 0.5, None, 0.0123),
        (50.0, 1.0, 1.5, 0.0178),
        (500.0, 0.5, None, 0.0008),
        (5000.0, 1.0, 1.5, 0.001),
    ],
)
def test_cycles_renders_the_formula(build, render, exponent, interpolation, ior, bound):
    parameters = lobe(
        diffuse=[0.0] * 3,
        specular=[1.0] * 3,
        exponent=exponent,
        interpolation=interpolation,
        ior=ior,
    )
    material, normals = build(**parameters), sphere_normals()
    errors = []
    for phase in (12, 41, 72, 103, 134, 157):
        wi, wo = local(normals, light_at(phase)), local(normals, UP)
        reference = lobefit._native.evaluate_model(parameters, wi, wo) * np.maximum(wi[:, 2:], 0)
        on = (normals[:, 2] < 1) & (wi[:, 2] > 0)
        rendered = render(material, light_at(phase))
        errors.append(np.abs(rendered - reference)[on].sum() / reference[on].sum())
    assert np.mean(errors) < bound


def test_an_unconnected_normal_is_the_normal_of_the_surface(build, render):
    material = build(ior=1.5)
    plain = render(material, light_at(60))
    tree = material.node_tree
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    tree.links.new(geometry.outputs["Normal"], group_node(material).inputs["Normal"])
    assert np.abs(render(material, light_at(60)) - plain).max() <= 1e-6 * plain.max()


def test_no_fresnel_is_the_model_without(build, render):
    material = build(ior=1.7)
    without = render(build(), light_at(80))
    assert not np.allclose(render(material, light_at(80)), without, rtol=0.1)
    group_node(material).inputs["Fresnel"].default_value = 0.0
    assert np.array_equal(render(material, light_at(80)), without)


def test_turning_everything_changes_nothing(build, render):
    material = build(ior=1.5)
    turn = Matrix.Rotation(1.1, 4, Vector((0.2, 0.5, -0.7)))
    plain = render(material, light_at(75))
    # Single precision of a turned position moves a normal by about 1e-6.
    assert np.abs(render(material, light_at(75), turn=turn) - plain).max() < 2e-4 * plain.max()


def test_a_connected_normal_is_used(build, render):
    normal = np.array([0.4, 0.0, 1.0]) / np.hypot(0.4, 1.0)
    # Cycles dims a diffuse closure whose normal is not the surface's.
    parameters = lobe(ior=1.5, diffuse=[0.0] * 3)
    material, light = build(**parameters), light_at(30)
    tree = material.node_tree
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    # Not of unit length, as what a user connects may be.
    bent = tree.nodes.new("ShaderNodeVectorMath")
    bent.inputs[1].default_value = (0.4, 0.0, 0.0)
    tree.links.new(geometry.outputs["Normal"], bent.inputs[0])
    tree.links.new(bent.outputs[0], group_node(material).inputs["Normal"])
    flat = np.tile(UP, (SIZE * SIZE, 1))
    expected = mirrored(parameters, light, np.tile(normal, (SIZE * SIZE, 1)))
    assert np.allclose(render(material, light, flat), expected, rtol=1e-3)


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("exponent", [0.5, 50.0])
def test_a_facing_disc_has_no_black_pixels(build, render, exponent, flip):
    flat = np.tile(UP, (SIZE * SIZE, 1))
    expected = mirrored(lobe(ior=1.5, exponent=exponent), light_at(20), flat)
    rendered = render(build(ior=1.5, exponent=exponent), light_at(20), flat, flip=flip)
    assert np.allclose(rendered, expected, rtol=1e-3)


@pytest.mark.parametrize("exponent", [0.2, 4.0, 300.0])
def test_a_facing_disc_looks_the_same_from_all_sides(build, render, exponent):
    # The tangent turns with the normal, whose direction is what rounding leaves of it here: two
    # roughnesses that differed would make the disc swirl.
    tilts = np.random.default_rng(3).normal(0, 1e-5, (SIZE * SIZE, 3)) * [1, 1, 0]
    rendered = render(build(ior=1.5, exponent=exponent), light_at(35), UP + tilts)
    # A lobe of this exponent changes by so much where the normal turns by 1e-5.
    assert np.ptp(rendered, axis=0).max() < (1e-4 + 2e-4 * exponent**0.5) * rendered.max()


@pytest.mark.parametrize("exponent", [0.0, 0.3, 1e8])
@pytest.mark.parametrize(("ior", "fresnel"), [(1.0, 1.0), (1.01, 0.5), (3.0, 1.0)])
@pytest.mark.parametrize("interpolation", [0.0, 1.0])
@pytest.mark.parametrize("conserve", [0.0, 1.0])
def test_extreme_inputs_stay_finite(build, render, exponent, interpolation, ior, fresnel, conserve):
    material = build(ior=ior, interpolation=interpolation)
    inputs = group_node(material).inputs
    inputs["Exponent"].default_value, inputs["Fresnel"].default_value = exponent, fresnel
    inputs["Conserve Energy"].default_value = conserve
    normals = sphere_normals()
    for phase in (0, 160):
        rendered = render(material, light_at(phase))
        lit = normals @ light_at(phase) > 1e-3
        assert np.isfinite(rendered).all()
        # The diffuse closure alone lights them; NaN in one closure would make a pixel black.
        assert (rendered[lit] > 0).all()


@pytest.fixture
def white_world(build, two_lights, tmp_path):
    """What a white world shows of the group, which is all specular, at a view angle: RGB."""
    material, white = build(diffuse=[0.0] * 3), two_lights.uniform_world("White", 1.0)
    inputs = group_node(material).inputs

    def albedo(angle, **values):
        for name, value in values.items():
            inputs[name.replace("_", " ")].default_value = value
        return white_world_albedo(tmp_path, material, white, angle)

    return albedo


COLOR = np.array([0.8, 0.5, 0.2])
CONSERVED = {"Specular_Color": (*COLOR, 1.0), "Specular_Strength": 1.0, "Conserve_Energy": 1.0}


@pytest.mark.parametrize("exponent", [1.0, 5.0, 50.0, 5000.0])
@pytest.mark.parametrize("interpolation", [0.0, 0.5, 1.0])
def test_conserved_energy_is_the_specular_color(white_world, exponent, interpolation):
    for angle in (0, 40, 65, 78, 85):
        shown = white_world(
            angle, Exponent=exponent, Interpolation=interpolation, Fresnel=0.0, **CONSERVED
        )
        # The table of addon/nodes/live_energy.py is within 0.8 %, and Cycles' sampling of Beckmann
        # closures within 0.3 % of their formula.
        assert np.abs(shown / COLOR - 1).max() < 0.01


def test_energy_is_conserved_as_far_as_asked_for(white_world):
    none = white_world(80, **CONSERVED | {"Conserve_Energy": 0.0})
    assert (none < 0.2 * COLOR).all()
    half, all_of_it = (white_world(80, Conserve_Energy=share) for share in (0.5, 1.0))
    # The weights are linear in it; noise is below 1e-4.
    assert half == pytest.approx((none + all_of_it) / 2, rel=1e-3)


@pytest.mark.parametrize("angle", [0, 60, 82])
def test_fresnel_takes_its_part_of_conserved_energy(white_world, angle):
    shown = white_world(angle, Exponent=20.0, IOR=1.5, Fresnel=1.0, **CONSERVED)
    cosine = np.cos(np.radians(angle))
    g = np.sqrt(1.5**2 - 1 + cosine**2)
    s = (g - cosine) / (g + cosine)
    reflectance = s**2 / 2 * (1 + ((cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)) ** 2)
    # R_F is taken at the view angle, and shapes the closures; the table is for those without.
    assert shown == pytest.approx(COLOR * reflectance, rel=0.06)
