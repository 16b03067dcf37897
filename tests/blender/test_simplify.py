"""What a camera sees of materials, the kinds chosen for it, and what the picture loses by them."""

import importlib
import json

import bpy
import lobefit
import numpy as np
import pytest
from conftest import EXTENSION
from mathutils import Vector

SAMPLES = ("nickel", "violet-rubber")
SUNS = ((0.3, -0.5, 1), (-0.8, -0.6, 0.9), (0.9, 0.4, 0.7), (-0.3, 1, 0.8), (0.1, -1, 0.4))


@pytest.fixture(scope="session")
def records(tmp_path_factory):
    """A record for each of the samples, with closures of the measurement."""
    folder = tmp_path_factory.mktemp("samples")
    closures = [lobefit.Closures("measured", count) for count in range(4)]
    found = {}
    for name in SAMPLES:
        lobefit._native.sample(name).write(str(folder / f"{name}.binary"))
        source = folder / f"{name}.binary"
        # The quickest fit: nothing here depends on how good the lobe is.
        job = lobefit.start_fit(
            source, model="modified-phong", fresnel=False, norm="cosine-l1", closures=closures
        )
        found[name] = job.record()
    return found


@pytest.fixture
def nickel(records):
    """The record of a metal."""
    return records["nickel"]


@pytest.fixture
def view(addon):
    """The module that looks through the camera."""
    return importlib.import_module(f"{addon.__name__}.scene_view")


@pytest.fixture
def ways(addon):
    """The module that lists the ways to show a record."""
    return importlib.import_module(f"{addon.__name__}.ways")


@pytest.fixture
def swaps(addon):
    """The module that changes materials and puts them back."""
    return importlib.import_module(f"{addon.__name__}.swaps")


@pytest.fixture
def simplification(addon):
    """The module that changes a scene."""
    return importlib.import_module(f"{addon.__name__}.simplification")


def add(data, material=None, location=(0, 0, 0), name="thing"):
    """A new object in the scene."""
    item = bpy.data.objects.new(name, data)
    if material is not None:
        data.materials.append(material)
    item.location = location
    bpy.context.scene.collection.objects.link(item)
    return item


def sphere(material, location=(0, 0, 0), radius=1.0):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=radius, location=location)
    item = bpy.context.object
    item.data.shade_smooth()
    item.data.materials.append(material)
    return item


def rectangle(material, left, right, bottom, top, z=0.0):
    mesh = bpy.data.meshes.new("rectangle")
    corners = [(left, bottom, z), (right, bottom, z), (right, top, z), (left, top, z)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    return add(mesh, material)


def camera(location=(0, 0, 10), kind="ORTHO", width=2.0, size=(64, 64)):
    """The scene's camera, looking down."""
    data = bpy.data.cameras.new("camera")
    data.type, data.ortho_scale = kind, width
    scene = bpy.context.scene
    scene.camera = add(data, location=location, name="camera")
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.frame_start = scene.frame_end = 1
    return scene.camera


def plain(name="plain"):
    return bpy.data.materials.new(name)


def rays_of(view, material, **options):
    """The rays that meet the material by degree, and their share of the picture."""
    seen = view.look(bpy.context, 1, **options)
    rays = seen.angles.get(material.session_uid, np.zeros(90))
    return rays, rays.sum() / seen.rays


def test_a_sphere_from_far_away(view):
    material = plain()
    sphere(material)
    camera()
    rays, share = rays_of(view, material)
    assert share == pytest.approx(np.pi / 4, abs=0.003)
    expected = np.diff(np.sin(np.radians(np.arange(91))) ** 2)
    assert np.abs(np.cumsum(rays / rays.sum() - expected)).max() < 0.006


def test_a_sphere_from_nearby(view):
    material = plain()
    sphere(material)
    camera(location=(0, 0, 3), kind="PERSP").data.angle = np.radians(60)
    rays, share = rays_of(view, material)
    # The sphere's outline is a cone around the axis, and the frame is tan(30 degrees) high.
    radius = np.tan(np.arcsin(1 / 3)) / np.tan(np.radians(30))
    assert share == pytest.approx(np.pi / 4 * radius**2, abs=0.003)
    # At the view angle t the ray leaves the camera under arcsin(sin(t) / 3).
    outline = np.tan(np.arcsin(np.sin(np.radians(np.arange(91))) / 3)) ** 2
    expected = np.diff(outline) / outline[-1]
    assert np.abs(np.cumsum(rays / rays.sum() - expected)).max() < 0.006


@pytest.mark.parametrize("scale", [(1, 1, 1), (1, 1, -1), (-1, 1, 3)])
def test_a_plane_at_grazing(view, scale):
    material = plain()
    item = rectangle(material, -5, 5, -5, 5)
    item.scale = scale
    item.rotation_euler.x = np.radians(80.5)
    camera(size=(64, 64))
    rays, share = rays_of(view, material)
    assert rays[80] == rays.sum() > 0
    # The plane is 10 cos(80.5 degrees) high, and the frame 2.
    assert share == pytest.approx(10 * np.cos(np.radians(80.5)) / 2, abs=0.01)


@pytest.mark.parametrize(("fit", "size"), [("AUTO", (128, 32)), ("VERTICAL", (32, 128))])
def test_shift_and_sensor_fit(view, fit, size):
    material = plain()
    rectangle(material, -100, 0, -100, 100)
    data = camera(kind="PERSP", size=size).data
    data.sensor_fit = fit
    # The frame moves by a part of its longer side, and the edge of the plane the other way.
    longer = max(size) / size[0]
    data.shift_x = 0.25 / longer
    assert rays_of(view, material)[1] == pytest.approx(0.25, abs=0.02)


def test_objects_that_renders_do_not_show_are_passed(view):
    front, back = plain("front"), plain("back")
    item = rectangle(front, -2, 2, -2, 2, z=1)
    rectangle(back, -2, 2, -2, 2)
    camera()
    assert rays_of(view, front, rays=16)[1] == 1
    item.visible_camera = False
    assert rays_of(view, back, rays=16)[1] == 1
    item.visible_camera, item.hide_render = True, True
    assert rays_of(view, back, rays=16)[1] == 1
    item.hide_render = False
    inner = bpy.data.collections.new("inner")
    bpy.context.scene.collection.children.link(inner)
    bpy.context.scene.collection.objects.unlink(item)
    inner.objects.link(item)
    bpy.context.view_layer.layer_collection.children["inner"].indirect_only = True
    assert rays_of(view, back, rays=16)[1] == 1


def test_instances_modifiers_and_slots(view):
    left, right, slot = plain("left"), plain("right"), plain("slot")
    source = bpy.data.collections.new("source")
    item = rectangle(left, -0.5, 0.5, -1, 1)
    bpy.context.scene.collection.objects.unlink(item)
    source.objects.link(item)
    instance = add(None, location=(-0.5, 0, 0))
    instance.instance_type, instance.instance_collection = "COLLECTION", source
    # Mirrored by a modifier, half of it shows the object's own material.
    half = rectangle(right, 0, 0.5, -1, 1)
    half.data.materials.append(plain("of the mesh"))
    half.location.x = 0.5
    half.modifiers.new("mirror", "MIRROR")
    half.material_slots[0].link = "OBJECT"
    half.material_slots[0].material = slot
    camera()
    seen = view.look(bpy.context, 1, rays=20)
    assert seen.angles[left.session_uid].sum() == seen.rays / 2
    assert seen.angles[slot.session_uid].sum() == seen.rays / 2
    assert right.session_uid not in seen.angles


def test_a_camera_of_a_marker(view):
    material = plain()
    rectangle(material, -2, 2, -2, 2)
    away = camera(location=(0, 0, 10))
    away.rotation_euler.x = np.pi
    scene = bpy.context.scene
    scene.timeline_markers.new("away", frame=0).camera = away
    scene.timeline_markers.new("near", frame=5).camera = camera(location=(0, 0, 10))
    scene.frame_set(1)
    shares = [view.look(bpy.context, frame).angles.get(material.session_uid) for frame in (1, 6)]
    assert shares[0] is None and shares[1].sum() > 0
    assert scene.camera == away and scene.frame_current == 1


def test_frames_are_spread_evenly(view):
    assert view.evenly(1, 250, 3) == [1, 126, 250]
    assert view.evenly(5, 5, 8) == [5]
    assert view.evenly(1, 3, 8) == [1, 2, 3]


def test_lights_are_listed(view):
    for kind in ("SUN", "SUN", "AREA"):
        add(bpy.data.lights.new("light", kind))
    assert view.lights(bpy.context) == {"lights": {"Sun": 2, "Area": 1}, "world": False}
    bpy.context.scene.world = bpy.data.worlds.new("world")
    bpy.context.scene.world.color = (0.1, 0.1, 0.1)
    assert view.lights(bpy.context)["world"]


def test_the_error_of_the_principled_at_angles(ways, nickel):
    (way,) = [way for way in ways.ways_of(nickel) if way.kind == "principled"]
    measured = lobefit.read(nickel.source["path"])
    theta, phi = np.meshgrid(
        (np.arange(600) + 0.5) / 600 * np.pi / 2, (np.arange(60) + 0.5) / 60 * np.pi, indexing="ij"
    )
    cosine, sine = np.cos(theta).ravel(), np.sin(theta).ravel()
    wi = np.stack([sine * np.cos(phi.ravel()), sine * np.sin(phi.ravel()), cosine], 1)
    for angle in (30, 60, 75):
        radians = np.radians(angle + 0.5)
        wo = np.broadcast_to([np.sin(radians), 0.0, np.cos(radians)], wi.shape)
        true = np.nan_to_num(measured.evaluate(wi, wo)) * cosine[:, None]
        off = np.abs(lobefit._native.evaluate_principled(nickel.principled, wi, wo) - true)
        error = (off.sum(1) @ sine) / (true.sum(1) @ sine)
        assert error * 0.9 < way.by_angle[angle] < error + 0.03


def build(addon, record, name, kind="measured", count=None):
    return addon.build_material(record, kind=kind, name=name, count=count)


def looked_at(addon, frames=3):
    """A survey of the scene, waited for."""
    survey = importlib.import_module(f"{addon.__name__}.survey").Survey(bpy.context, frames)
    while not survey.advance(0.1):
        assert 0 <= survey.progress <= 1 and survey.text
    assert survey.problem == ""
    return survey


@pytest.fixture
def small_scene(addon, records):
    """Spheres near and far, planes at grazing, one thing never seen, and a camera that moves."""
    nickel, rubber = records["nickel"], records["violet-rubber"]
    sphere(build(addon, nickel, "near"), (0, 0, 1))
    sphere(build(addon, rubber, "beside"), (-2, 1, 1))
    sphere(build(addon, nickel, "far"), (7, 22, 1))
    sphere(build(addon, rubber, "live", kind="live"), (2.3, 2, 1))
    sphere(build(addon, nickel, "unseen"), (0, -30, 1))
    rectangle(build(addon, rubber, "floor"), -40, 40, -4, 60)
    rectangle(build(addon, nickel, "strip"), -4, -3, -4, 20, z=0.01)
    item = camera(kind="PERSP", size=(96, 54))
    for frame, place in ((1, (0, -7, 2.5)), (11, (4, -6, 4)), (21, (-5, -8, 2.2))):
        item.location = place
        toward = Vector((0, 2, 0.8)) - Vector(place)
        item.rotation_euler = toward.to_track_quat("-Z", "Y").to_euler()
        item.keyframe_insert("location", frame=frame)
        item.keyframe_insert("rotation_euler", frame=frame)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 21
    scene.frame_set(7)
    for direction in SUNS:
        sun = bpy.data.lights.new("sun", "SUN")
        sun.energy, sun.angle = 1.0, 0.0
        add(sun).rotation_euler = Vector(direction).to_track_quat("Z", "Y").to_euler()
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.seed, cycles.max_bounces = "CPU", 0, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    return scene


def rendered(two_lights, scene, frames):
    """The radiance of each frame."""
    pictures = []
    for frame in frames:
        scene.frame_set(frame)
        pictures.append(two_lights.render_pixels(scene))
    return pictures


def test_the_picture_loses_no_more_than_was_asked(
    addon, two_lights, records, small_scene, simplification
):
    frames, fill = [1, 11, 21], importlib.import_module(f"{addon.__name__}.nodes.material")
    live = bpy.data.materials["live"]
    fill.fill_material(live, records["violet-rubber"], "measured")
    best = rendered(two_lights, small_scene, frames)
    fill.fill_material(live, records["violet-rubber"], "live")
    small_scene.frame_set(7)
    survey, drawn = looked_at(addon), []
    for tolerance in (0.01, 0.05):
        result = simplification.simplify(bpy.context, survey, tolerance)
        assert small_scene.frame_current == 7
        assert result["frames"] == frames
        pictures = rendered(two_lights, small_scene, frames)
        small_scene.frame_set(7)
        lost = [
            np.abs(picture - reference).sum() / reference.sum()
            for picture, reference in zip(pictures, best, strict=True)
        ]
        # What is told is what light from all sides would show, and here it is what suns do.
        assert max(lost) < result["error_added"] <= tolerance
        drawn.append(result["closures"]["after"])
        rows = {row["material"]: row for row in result["materials"]}
        assert rows["unseen"]["angles"] is None and rows["unseen"]["share"] == 0
        assert rows["unseen"]["after"]["count"] == 1
        assert rows["floor"]["share"] > rows["far"]["share"] > 0
    assert drawn[0] > drawn[1]


@pytest.fixture
def two_spheres(addon, records):
    """Spheres side by side, a measured one and a live one, before a camera."""
    materials = [
        build(addon, records["nickel"], "metal"),
        build(addon, records["violet-rubber"], "rubber", kind="live"),
    ]
    sphere(materials[0], (-1, 0, 0))
    sphere(materials[1], (1, 0, 0))
    camera(width=4.0, size=(80, 40))
    return materials


def test_restore_after_saving(swaps, two_spheres, tmp_path):
    before = [swaps.tree_content(material.node_tree) for material in two_spheres]
    assert bpy.ops.lobefit.simplify_scene(tolerance=10) == {"FINISHED"}
    assert [material["lobefit_closures"] for material in two_spheres] == [1, 1]
    assert [swaps.tree_content(material.node_tree) for material in two_spheres] != before
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    # Simplified again, a material still remembers what it was at first.
    assert bpy.ops.lobefit.simplify_scene(tolerance=0) == {"FINISHED"}
    assert bpy.ops.lobefit.simplify_scene(tolerance=10) == {"FINISHED"}
    assert bpy.ops.lobefit.restore_scene() == {"FINISHED"}
    materials = [bpy.data.materials[name] for name in ("metal", "rubber")]
    assert [swaps.tree_content(material.node_tree) for material in materials] == before
    assert materials[1]["lobefit_kind"] == "live"
    assert not bpy.ops.lobefit.restore_scene.poll()
    assert "lobefit_simplified" not in bpy.context.scene


def test_other_renderers_see_no_change(two_spheres):
    def principled(material):
        (node,) = (n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        return [tuple(node.inputs["Base Color"].default_value), node.inputs["IOR"].default_value]

    before = list(map(principled, two_spheres))
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    assert list(map(principled, two_spheres)) == before
    for material in two_spheres:
        outputs = [n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL"]
        assert [n.target for n in outputs if n.is_active_output] == ["ALL"]


def test_the_result_is_kept(two_spheres):
    bpy.ops.lobefit.simplify_scene(tolerance=2)
    kept = result()
    assert kept == json.loads(json.dumps(kept))
    metal, rubber = kept["materials"]
    assert metal["before"] == {"kind": "measured", "count": 3, "cost": 3.25}
    assert metal["left_out"].endswith("of 3 lobes")
    assert rubber["before"]["kind"] == "live" and "live sockets" in rubber["left_out"]
    assert metal["share"] == pytest.approx(np.pi / 8, abs=0.01)
    # Nine tenths of a sphere's area are seen between these angles.
    expected = np.degrees(np.arcsin(np.sqrt([0.05, 0.95])))
    assert metal["angles"] == pytest.approx(list(expected), abs=2)
    assert kept["error_added"] <= 0.02
    assert kept["seconds"] == {"before": None, "after": None}


def test_rendering_is_timed(two_spheres):
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    bpy.ops.lobefit.simplify_scene(tolerance=10, timed=True)
    seconds = result()["seconds"]
    assert seconds["before"] > 0 and seconds["after"] > 0
    assert scene.render.resolution_percentage == 100


def test_bounces_on_diffuse_surfaces(swaps, two_spheres):
    before = [swaps.tree_content(material.node_tree) for material in two_spheres]
    bpy.ops.lobefit.simplify_scene(tolerance=10, diffuse_bounces=True)
    for material in two_spheres:
        nodes = material.node_tree.nodes
        (mix,) = (node for node in nodes if node.type == "MIX_SHADER")
        assert mix.inputs[0].links[0].from_socket.name == "Is Diffuse Ray"
        (link,) = mix.outputs[0].links
        assert link.to_node.target == "CYCLES"
        diffuse = mix.inputs[2].links[0].from_node.node_tree.nodes
        assert [n.type for n in diffuse if n.type.startswith("BSDF")] == ["BSDF_DIFFUSE"]
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    assert not any(n.type == "MIX_SHADER" for m in two_spheres for n in m.node_tree.nodes)
    bpy.ops.lobefit.restore_scene()
    assert [swaps.tree_content(material.node_tree) for material in two_spheres] == before


def test_bounces_of_a_material_are_put_back(addon, swaps, records, two_spheres):
    metal, _ = two_spheres
    addon.nodes.material.fill_material(metal, records["nickel"], "measured", diffuse_bounces=True)
    before = swaps.tree_content(metal.node_tree)
    bpy.ops.lobefit.simplify_scene(tolerance=0)
    assert swaps.tree_content(metal.node_tree) != before
    bpy.ops.lobefit.restore_scene()
    assert swaps.tree_content(metal.node_tree) == before


def result():
    """What is kept of the last simplification."""
    records = importlib.import_module(f"{EXTENSION}.records")
    return records.result_of(bpy.context.scene)


def skipped():
    """The reasons by material, of the scene as it is."""
    found = result()["skipped"]
    return {item["material"]: item["reason"] for item in found}


def test_what_a_user_changed_is_left(swaps, two_spheres):
    metal, _ = two_spheres
    metal.node_tree.nodes["metal measured"].inputs["Strength"].default_value = 0.5
    before = swaps.tree_content(metal.node_tree)
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    assert swaps.tree_content(metal.node_tree) == before
    assert skipped() == {"metal": "its nodes were changed by hand"}


def test_what_a_user_changed_in_a_group_is_left(swaps, two_spheres):
    metal, _ = two_spheres
    group = metal.node_tree.nodes["metal measured"].node_tree
    curves = next(node for node in group.nodes if node.type == "CURVE_RGB").mapping.curves
    curves[0].points[0].location.y *= 0.5
    before = swaps.tree_content(metal.node_tree)
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    assert swaps.tree_content(metal.node_tree) == before
    assert skipped() == {"metal": "its nodes were changed by hand"}


def test_what_is_linked_is_left(addon, two_spheres, tmp_path):
    metal, _ = two_spheres
    path = tmp_path / "library.blend"
    metal.name = "linked metal"
    bpy.data.libraries.write(str(path), {metal})
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.materials = ["linked metal"]
    (linked,) = wanted.materials
    metal.name = "own metal"
    sphere(linked, (0, 1, 0), radius=0.3)
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    assert skipped() == {"linked metal": "it is linked from another file"}
    assert linked["lobefit_closures"] == 3 and metal["lobefit_closures"] == 1


def test_what_only_renders_show_is_left(two_spheres):
    bpy.context.scene.objects[0].hide_viewport = True
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    (reason,) = skipped().values()
    assert "the viewport hides" in reason
    assert two_spheres[0]["lobefit_closures"] == 3


def test_materials_of_other_scenes_are_left(addon, records, two_spheres):
    elsewhere = build(addon, records["nickel"], "elsewhere")
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    assert elsewhere["lobefit_closures"] == 3
    assert skipped() == {}


def test_closures_that_are_missing_are_found(addon, records, two_spheres):
    metal, rubber = two_spheres
    for material, path in ((metal, None), (rubber, "kept")):
        record = json.loads(material["lobefit_record"])
        record["closures"] = record["closures"][2:] if material == metal else []
        record["source"]["path"] = path and record["source"]["path"]
        material["lobefit_record"] = json.dumps(record)
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    counts = [
        [entry["count"] for entry in json.loads(material["lobefit_record"])["closures"]]
        for material in two_spheres
    ]
    assert counts == [[2, 3], [0, 1, 2, 3]]
    assert [material["lobefit_closures"] for material in two_spheres] == [2, 1]


def test_missing_closures_keep_the_cap(two_spheres):
    metal, _ = two_spheres
    record = json.loads(metal["lobefit_record"])
    record["closures"] = [record["closures"][3] | {"cap_albedo": True}]
    metal["lobefit_record"] = json.dumps(record)
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    closures = json.loads(metal["lobefit_record"])["closures"]
    assert [entry["cap_albedo"] for entry in closures] == [True] * 4


def test_of_entries_with_as_many_closures_the_shown_one_is_found(two_spheres):
    metal, _ = two_spheres
    record = json.loads(metal["lobefit_record"])
    two, three = record["closures"][2:]
    two["specular"] = [*two["specular"], three["specular"][0]]
    metal["lobefit_record"] = json.dumps(record)
    bpy.ops.lobefit.simplify_scene(tolerance=0)
    assert result()["materials"][0]["before"]["count"] == 3


def test_without_closures_or_a_file(addon, two_spheres):
    for material in two_spheres:
        record = json.loads(material["lobefit_record"])
        record["closures"], record["source"]["path"] = [], None
        addon.nodes.material.fill_material(
            material, lobefit.Record.from_json(json.dumps(record)), "live"
        )
    bpy.ops.lobefit.simplify_scene(tolerance=10)
    assert [material["lobefit_kind"] for material in two_spheres] == ["principled"] * 2


def test_scenes_that_cannot_be_looked_at(addon, two_spheres):
    data = bpy.context.scene.camera.data
    data.type = "PANO"
    with pytest.raises(RuntimeError, match="panoramic"):
        bpy.ops.lobefit.simplify_scene()
    bpy.context.scene.camera = None
    with pytest.raises(RuntimeError, match="expected a scene with a camera"):
        bpy.ops.lobefit.simplify_scene()
    assert [material["lobefit_kind"] for material in two_spheres] == ["measured", "live"]


def test_a_scene_without_measured_materials(addon):
    sphere(plain())
    camera()
    with pytest.raises(RuntimeError, match="found none"):
        bpy.ops.lobefit.simplify_scene()
    assert "lobefit_simplified" not in bpy.context.scene


def test_a_survey_that_is_ended(addon, two_spheres):
    bpy.context.scene.frame_end = 3
    survey = importlib.import_module(f"{addon.__name__}.survey").Survey(bpy.context, 3)
    assert not survey.advance(0.0)
    assert survey.text == "Frame 2" and 0 < survey.progress < 0.5
    run = addon.operators.run
    run._current = run.Run(bpy.context, survey)
    assert not bpy.ops.lobefit.simplify_scene.poll()
    bpy.ops.lobefit.cancel_fit()
    assert run.current() is None
    assert [material["lobefit_kind"] for material in two_spheres] == ["measured", "live"]


def test_nothing_else_is_left_behind(two_spheres):
    bpy.ops.lobefit.simplify_scene(tolerance=0)
    groups = [group.name for group in bpy.data.node_groups]
    bpy.ops.lobefit.simplify_scene(tolerance=0)
    assert [group.name for group in bpy.data.node_groups] == groups
    assert {material.name for material in bpy.data.materials} == {"metal", "rubber"}
