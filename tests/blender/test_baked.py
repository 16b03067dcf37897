"""Baked groups: what Cycles renders against the formula in C++ (native/closures/closure_set.h)."""

import dataclasses
from itertools import product

import bmesh
import bpy
import lobefit
import numpy as np
import pytest
from facets import (
    SIZE,
    UP,
    add,
    add_camera,
    add_sun,
    facet_mesh,
    light_at,
    local,
    new_scene,
    pixels_of,
    render_facets,
    sphere_normals,
)
from lobefit import _native
from mathutils import Matrix, Vector
from surroundings import (
    Crowd,
    albedo,
    bend_as_crowds_do,
    connect_normal,
    group_node,
    unit,
    white_world_albedo,
)

PHASES = (8, 47, 101, 152)
# The tables through which curves are read have 256 steps, and the points of curves stand on them.
COSINES = np.array([0, 13, 26, 51, 102, 153, 204, 230, 250, 256]) / 256


def curve(function):
    """The curve of a function of the cosine of the view angle; of a number, its constant."""
    if not callable(function):
        return [[0.0, function]]
    return [[cosine, float(function(cosine))] for cosine in COSINES]


# Three channels that differ, and differ from view to view.
WEIGHT = [curve(lambda c: 0.9 - 0.5 * c), curve(lambda c: 0.3 + 0.6 * c * c), curve(0.45)]
BLACK = [curve(0.0)] * 3


def lobe(distribution="ggx", roughness=0.3, anisotropy=0.0, bend=0.0, weight=WEIGHT):
    """A specular closure whose parameters vary with the view, isotropic at normal incidence.

    The normal is bent away from the viewer by no more than leaves the mirror direction above the
    horizon, as those of fitted closures are; Cycles would bend it back.
    """

    def bent(c):
        sine = max((1 - c * c) ** 0.5, 1e-3)
        return max(bend, -0.8 * c / (1 + sine) / sine)

    return {
        "distribution": distribution,
        "roughness": curve(lambda c: roughness * (1 - 0.2 * c * (1 - c))),
        "anisotropy": curve(lambda c: anisotropy * min(1, 4 * (1 - c * c))),
        "bend": curve(bent),
        "weight": weight,
    }


def entry(*specular, diffuse=BLACK):
    """An entry of a record's closures."""
    return {
        "target": "measured",
        "count": len(specular),
        "error": 0.0,
        "diffuse": diffuse,
        "specular": list(specular),
    }


def seen(closures, normals, light, viewer=UP):
    """What the formula shows of surfaces with these normals."""
    return _native.evaluate_closures(closures, local(normals, light), local(normals, viewer))


@pytest.fixture(scope="session")
def nickel(measured_file):
    """A record with the closures of a published material."""
    return lobefit.closures(measured_file, count=2)


@pytest.fixture
def build(addon, nickel):
    """Builds the material of an entry, by default of nickel's."""

    def built(closures=None):
        record = nickel
        if closures is not None:
            record = dataclasses.replace(nickel, closures=[closures])
        return addon.nodes.material.build_material(record, kind="measured")

    return built


def bend_normal(material, offset):
    """Connects the surface's normal plus an offset."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    # Not of unit length, as what a user connects may be.
    bent = nodes.new("ShaderNodeVectorMath")
    bent.inputs[1].default_value = offset
    links.new(nodes.new("ShaderNodeNewGeometry").outputs["Normal"], bent.inputs[0])
    connect_normal(material, bent.outputs[0])


def brightest(closures, light, rng):
    """256 normals, half of them where the closures are brightest, the others anywhere."""
    half = (light + UP) / np.linalg.norm(light + UP)
    cosine, azimuth = rng.uniform(0.1, 1, 20000), rng.uniform(0, 2 * np.pi, 20000)
    sine = np.sqrt(1 - cosine**2)
    anywhere = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], -1)
    near = unit(half + rng.normal(0, 0.2, anywhere.shape))
    near = near[near[:, 2] > 0.1]
    order = np.argsort(seen(closures, near, light).sum(1))
    return np.concatenate([near[order[-128:]], anywhere[:128]])


SHAPES = list(
    product(("ggx", "beckmann"), (0.1, 0.3, 0.6, 1.0), (-0.6, 0.0, 0.8), (-0.3, 0.0, 0.6))
)


# Roughness and how far off a pixel may be, as a part of the peak: single precision. Cycles finds
# how far the half vector is off the normal in the last digits of a cosine near 1, so that a lobe
# with the roughness 0.1, which is 0.01 wide, is off by 0.9 %; twice what was found is allowed.
PRECISION = ((0.1, 2e-2), (0.3, 3e-4), (0.6, 2e-5), (1.0, 1e-5))


@pytest.mark.parametrize("phase", PHASES)
def test_every_shape_is_the_formula(build, tmp_path, phase):
    entries = [entry(lobe(*shape)) for shape in SHAPES]
    rng, light = np.random.default_rng(phase), light_at(phase)
    normals = [brightest(closures, light, rng) for closures in entries]
    size = int(np.ceil((256 * len(entries)) ** 0.5))
    mesh = facet_mesh(np.resize(np.concatenate(normals), (size**2, 3)))
    for closures in entries:
        mesh.materials.append(build(closures))
    which = (np.arange(size**2) // 256 % len(entries)).astype(np.int32)
    mesh.polygons.foreach_set("material_index", which)
    rendered = render_facets(tmp_path, mesh, light)
    for k, shape in enumerate(SHAPES):
        expected = seen(entries[k], normals[k], light)
        difference = np.abs(rendered[256 * k : 256 * (k + 1)] - expected).max()
        assert difference <= dict(PRECISION)[shape[1]] * expected.max(), shape


@pytest.mark.parametrize("phase", PHASES)
def test_a_sum_of_closures_is_the_formula(build, render, phase):
    closures = entry(
        lobe("beckmann", 0.4, 0.5, 0.2), lobe("ggx", 0.7, weight=[curve(0.2)] * 3), diffuse=WEIGHT
    )
    expected = seen(closures, sphere_normals(), light_at(phase))
    difference = np.abs(render(build(closures), light_at(phase)) - expected)
    assert difference.max() < 1e-5 * expected.max()


@pytest.mark.parametrize("phase", PHASES)
def test_a_fitted_material_is_the_formula(build, render, nickel, phase):
    expected = seen(nickel.closures[0], sphere_normals(), light_at(phase))
    difference = np.abs(render(build(), light_at(phase)) - expected)
    # Single precision of a highlight that is 0.03 wide.
    assert difference.max() < 3e-4 * expected.max()


def test_an_unconnected_normal_is_the_normal_of_the_surface(build, render):
    material = build()
    plain = render(material, light_at(60))
    geometry = material.node_tree.nodes.new("ShaderNodeNewGeometry")
    connect_normal(material, geometry.outputs["Normal"])
    # The same up to the last digit of the normal.
    assert np.abs(render(material, light_at(60)) - plain).max() <= 1e-5 * plain.max()


def test_a_connected_normal_is_used(build, render, nickel):
    # Cycles dims a diffuse closure whose normal is not the surface's.
    closures = nickel.closures[0] | {"diffuse": BLACK}
    material, light = build(closures), light_at(30)
    bend_normal(material, (0.4, 0.0, 0.0))
    flat = np.tile(UP, (SIZE * SIZE, 1))
    normal = np.array([0.4, 0.0, 1.0]) / np.hypot(0.4, 1.0)
    expected = seen(closures, np.tile(normal, (SIZE * SIZE, 1)), light)
    assert np.allclose(render(material, light, flat), expected, rtol=1e-4)


def test_turning_everything_changes_nothing(build, render):
    material = build()
    turn = Matrix.Rotation(1.1, 4, Vector((0.2, 0.5, -0.7)))
    plain = render(material, light_at(75))
    difference = np.abs(render(material, light_at(75), turn=turn) - plain)
    # Single precision of a turned position moves a normal by about 1e-6, a 30000th of this width.
    assert difference.max() < 5e-4 * plain.max()


def test_tint_and_strength_scale(build, render):
    material = build()
    plain = render(material, light_at(75))
    inputs = group_node(material).inputs
    inputs["Tint"].default_value, inputs["Strength"].default_value = (0.2, 0.5, 0.8, 1.0), 3.0
    expected = plain * [0.6, 1.5, 2.4]
    # Products in another order; and the closures of less than 1e-5 that Cycles leaves out.
    assert np.abs(render(material, light_at(75)) - expected).max() < 2e-5 * expected.max()


def test_a_back_face_shows_the_front_of_its_flipped_normal(build, render):
    material = build()
    front = render(material, light_at(75))
    back = render(material, light_at(75), flip=True)
    # The corners come in another order.
    assert np.abs(back - front).max() < 2e-4 * front.max()


@pytest.mark.parametrize("light", [light_at(0), light_at(40)])
@pytest.mark.parametrize("distribution", ["fitted", "ggx", "beckmann"])
def test_a_facing_disc_does_not_swirl(build, render, nickel, distribution, light):
    closures = nickel.closures[0]
    if distribution != "fitted":
        # Anisotropic as soon as the surface turns away.
        closures = entry(lobe(distribution, 0.4, 0.8, 0.3), diffuse=WEIGHT)
    azimuth = np.tile(np.linspace(0, 2 * np.pi, SIZE, endpoint=False), SIZE)
    tilt = np.repeat(np.radians(3) * np.linspace(0, 1, SIZE) ** 2, SIZE)
    normals = np.stack(
        [np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)], -1
    )
    rendered = render(build(closures), light, normals)
    # The formula knows no azimuth. Where the light is at the viewer, rings are all of one colour.
    expected = seen(closures, normals, light)
    assert np.abs(rendered / expected - 1).max() < 1e-3
    if light[2] == 1:
        rings = rendered.reshape(SIZE, SIZE, 3)
        assert (np.ptp(rings, axis=1) / rings.mean(1)).max() < 1e-3


def smooth_sphere(material):
    """A unit sphere of 64 by 32 faces, its poles aside."""
    shape = bmesh.new()
    bmesh.ops.create_uvsphere(
        shape, u_segments=64, v_segments=32, radius=1, matrix=Matrix.Rotation(1.0, 4, "X")
    )
    mesh = bpy.data.meshes.new("sphere")
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    mesh.materials.append(material)
    return mesh


def relative_l1(picture, expected, where):
    return np.abs(picture - expected)[where].sum() / expected[where].sum()


# What the mesh's own normals, interpolated between vertices, are off: a highlight that all but
# grazes is seen through them. Below, with the normals that Cycles tells, 1e-4 is left.
@pytest.mark.parametrize(("phase", "bound"), [(8, 0.02), (47, 0.02), (101, 0.035)])
def test_a_smooth_sphere_is_the_formula(build, tmp_path, nickel, phase, bound):
    scene = new_scene(SIZE)
    add(scene, smooth_sphere(build()))
    add_camera(scene, Matrix.Translation((0, 0, 9)), width=2.0)
    add_sun(scene, light_at(phase))
    normals = sphere_normals()
    expected = seen(nickel.closures[0], normals, light_at(phase))
    # Away from the silhouette: the mesh is smaller than the sphere.
    where = (normals[:, 2] > 0.25) & (normals[:, 2] < 1)
    assert relative_l1(pixels_of(scene, tmp_path), expected, where) < bound


@pytest.mark.parametrize("phase", (8, 47, 80))
def test_a_normal_map_bends_the_closures(build, render, tmp_path, nickel, phase):
    # Cycles dims a diffuse closure whose normal is not the surface's.
    closures = nickel.closures[0] | {"diffuse": BLACK}
    material = build(closures)
    assert material.cycles.use_bump_map_correction
    nodes, links = material.node_tree.nodes, material.node_tree.links
    attribute = nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "encoded"
    bent = nodes.new("ShaderNodeNormalMap")
    bent.space = "WORLD"
    links.new(attribute.outputs["Vector"], bent.inputs["Color"])
    connect_normal(material, bent.outputs["Normal"])
    normals = sphere_normals()
    mesh = facet_mesh(np.tile(UP, (SIZE * SIZE, 1)))
    mesh.materials.append(material)
    encoded = mesh.attributes.new("encoded", "FLOAT_VECTOR", "FACE")
    encoded.data.foreach_set("vector", (normals / 2 + 0.5).ravel().astype(np.float32))
    rendered = render_facets(tmp_path, mesh, light_at(phase))
    # Cycles bends a normal back whose mirror direction, twice as far, is below the surface.
    where = (normals[:, 2] > np.cos(np.radians(40))) & (normals[:, 2] < 1)
    expected = seen(closures, normals, light_at(phase))
    # Single precision; the bound of a picture anyone could tell apart would be 0.02.
    assert relative_l1(rendered, expected, where) < 1e-3


@pytest.mark.parametrize("angle", [0, 20, 40, 60, 70, 80])
@pytest.mark.parametrize("kind", ["fitted", "hand-made"])
def test_a_white_world_shows_the_albedo(two_lights, build, tmp_path, nickel, kind, angle):
    closures = nickel.closures[0]
    if kind == "hand-made":
        closures = entry(lobe("beckmann", 0.4, 0.6, 0.3), lobe("ggx", 0.5, -0.6, -0.3))
    white = two_lights.uniform_world("white", 1.0)
    rendered = white_world_albedo(tmp_path, build(closures), white, angle)
    expected = albedo(closures, np.cos(np.radians(angle)))
    # Noise is below 1e-4; but between the horizon of the surface and that of a closure bent toward
    # the viewer Cycles samples light that it does not evaluate, which is up to 0.7 % here.
    assert np.allclose(rendered, expected, rtol=0.01)


def crowd_entries(nickel):
    """Closures as extreme as any on a bright diffuse one."""
    return [
        nickel.closures[0] | {"diffuse": WEIGHT},
        entry(lobe("ggx", 0.05, 0.9, 3.0), diffuse=WEIGHT),
        entry(lobe("beckmann", 0.05, 0.9, -3.0), diffuse=WEIGHT),
        entry(lobe("beckmann", 1.0, -0.9, 3.0), diffuse=WEIGHT),
    ]


@pytest.mark.parametrize("phase", (0, 35, 120))
def test_nothing_is_black_or_infinite(build, tmp_path, nickel, phase):
    materials = [bend_as_crowds_do(build(closures)) for closures in crowd_entries(nickel)]
    wrong, black, lit = Crowd(materials, 200, phase).faults(tmp_path, light_at(phase))
    assert lit > 1000
    assert (wrong, black) == (0, 0)


def shows(geometry_output):
    """A material that shines as an output of the Geometry node says, from 0 for -1 to 1 for 1."""
    material = bpy.data.materials.new(geometry_output)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    scaled = nodes.new("ShaderNodeVectorMath")
    scaled.operation = "MULTIPLY_ADD"
    scaled.inputs[1].default_value = scaled.inputs[2].default_value = (0.5, 0.5, 0.5)
    emission = nodes.new("ShaderNodeEmission")
    links.new(nodes.new("ShaderNodeNewGeometry").outputs[geometry_output], scaled.inputs[0])
    links.new(scaled.outputs[0], emission.inputs["Color"])
    links.new(emission.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def add_mirror(scene):
    """A mirror below everything."""
    mirror = bpy.data.materials.new("mirror")
    mirror.use_nodes = True
    nodes = mirror.node_tree.nodes
    nodes.clear()
    glossy = nodes.new("ShaderNodeBsdfAnisotropic")
    glossy.distribution, glossy.inputs["Roughness"].default_value = "GGX", 0.0
    glossy.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    surface = nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]
    mirror.node_tree.links.new(glossy.outputs[0], surface)
    mesh = bpy.data.meshes.new("mirror")
    mesh.from_pydata([(-9, -9, -4), (9, -9, -4), (9, 9, -4), (-9, 9, -4)], [], [(0, 1, 2, 3)])
    mesh.materials.append(mirror)
    add(scene, mesh)


def sphere_scene(mesh, light, mirrored):
    """A picture of a sphere in perspective, or of its image in a mirror alone."""
    scene = new_scene(SIZE)
    scene.cycles.max_bounces = 1
    add(scene, mesh)
    add_sun(scene, light)
    if mirrored:
        add_mirror(scene)
    eye, centre = Vector((3.0, 0.5, 2.5)), Vector((0, 0, -8 if mirrored else 0))
    place = (eye - centre).to_track_quat("Z", "Y").to_matrix().to_4x4()
    add_camera(scene, Matrix.Translation(eye) @ place)
    scene.camera.data.angle = 2.2 / (eye - centre).length
    return scene


@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("phase", (8, 47, 101))
def test_a_smooth_sphere_in_perspective_is_the_formula(
    build, tmp_path, nickel, bent, mirrored, phase
):
    offset = np.array([0.1, 0.2, 0.0]) * bent
    # Cycles dims a diffuse closure whose normal is not the surface's.
    closures = nickel.closures[0] | ({"diffuse": BLACK} if bent else {})
    material = build(closures)
    if bent:
        bend_normal(material, offset)
    mesh = smooth_sphere(material)
    light = light_at(phase) * [1, 1, -1 if mirrored else 1]
    scene = sphere_scene(mesh, light, mirrored)
    rendered = pixels_of(scene, tmp_path)
    # What each pixel sees, as Cycles tells it.
    pictures = []
    for name in ("Normal", "Incoming"):
        mesh.materials[0] = shows(name)
        pictures.append(pixels_of(scene, tmp_path))
    hit = pictures[0].any(1)
    surface, viewers = (unit(2 * picture - 1) for picture in pictures)
    normals = unit(surface + offset)
    # Away from the silhouette, and where Cycles does not bend a normal back because its mirror
    # direction is below the surface.
    facing = (normals * viewers).sum(1)
    mirror = 2 * facing[:, None] * normals - viewers
    where = hit & (facing > 0.25) & ((mirror * surface).sum(1) > 0.1) & (surface @ light > 0)
    assert where.sum() > 50
    expected = seen(closures, normals, light, viewers)
    # Single precision, 6e-5 at most; a hundredth would be seen.
    assert relative_l1(rendered, expected, where) < 1e-3


def test_everything_but_cycles_shows_the_principled_bsdf(build, nickel):
    nodes = build().node_tree.nodes
    outputs = {node.target: node for node in nodes if node.type == "OUTPUT_MATERIAL"}
    assert outputs["ALL"].is_active_output and not outputs["CYCLES"].is_active_output
    principled = outputs["ALL"].inputs["Surface"].links[0].from_node
    assert principled.type == "BSDF_PRINCIPLED"
    for socket, key in (("Metallic", "metallic"), ("Roughness", "roughness"), ("IOR", "ior")):
        stored = principled.inputs[socket].default_value
        assert stored == pytest.approx(nickel.principled[key], rel=1e-6)
    colour = principled.inputs["Base Color"].default_value[:3]
    assert list(colour) == pytest.approx(nickel.principled["base_color"], rel=1e-6)
    assert outputs["CYCLES"].inputs["Surface"].links[0].from_node.type == "GROUP"


def described(tree):
    """All of a tree that a saved file holds, and of the groups in it."""
    nodes = []
    for node in tree.nodes:
        values = [
            tuple(value) if hasattr(value := socket.default_value, "__len__") else value
            for socket in node.inputs
            if hasattr(socket, "default_value")
        ]
        curves = [
            [(*point.location, point.handle_type) for point in mapped.points]
            for mapped in (node.mapping.curves if hasattr(node, "mapping") else ())
        ]
        inner = described(node.node_tree) if node.type == "GROUP" else None
        place = tuple(node.location), node.parent and node.parent.name
        nodes.append((node.name, node.bl_idname, node.label, place, values, curves, inner))
    ends = [
        (k.from_node.name, k.from_socket.identifier, k.to_node.name, k.to_socket.identifier)
        for k in tree.links
    ]
    return tree.name, nodes, ends


def names_in(description):
    name, nodes, _ = description
    yield name
    for node in nodes:
        yield node[0]
        if node[-1]:
            yield from names_in(node[-1])


def test_the_same_record_makes_the_same_tree(build):
    first = described(build().node_tree)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert described(build().node_tree) == first
    assert not [name for name in names_in(first) if ".0" in name]


def test_a_material_fitted_anew_keeps_the_name_of_its_group(addon, build, nickel):
    material = build()
    first = described(material.node_tree)
    addon.nodes.material.fill_material(material, nickel, kind="measured")
    assert described(material.node_tree) == first
    assert len(bpy.data.node_groups) == 1
