"""The panel of a measured material, and what its buttons do."""

import importlib
import json
import shutil
from pathlib import Path

import bpy
import lobefit
import lobefit.preview
import numpy as np
import pytest
from recording_layout import drawn, material_tab, panels


@pytest.fixture
def parameters(addon):
    """The module that knows which inputs of a material are parameters."""
    return importlib.import_module(f"{addon.__name__}.nodes.parameters")


@pytest.fixture
def pictures(addon):
    """The module that keeps what was drawn."""
    return importlib.import_module(f"{addon.__name__}.pictures")


@pytest.fixture(scope="session")
def fitted(measured_file):
    """The record of the measurement with two closures, found once for all tests."""
    return lobefit.closures(measured_file, target="measured", count=2, norm="cosine-l1")


@pytest.fixture
def material(addon, fitted):
    """A material as import makes it; there is no other in the file."""
    return addon.build_material(fitted, "measured", "nickel")


@pytest.fixture
def on_a_cube(material):
    """The measured material, on an object that is active and selected."""
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.materials.append(material)
    return material


def record_of(material):
    return lobefit.Record.from_json(material["lobefit_record"])


def group_node(material):
    (node,) = [node for node in material.node_tree.nodes if node.type == "GROUP"]
    return node


def told(layout):
    """All that is written, in one line as if the panel were wide."""
    return " ".join(layout.texts)


def close(number):
    """Of sockets, which are of single precision."""
    return pytest.approx(number, rel=1e-6)


# The panel.


def test_panel_of_a_measured_material(addon, on_a_cube):
    layout = material_tab()
    error = record_of(on_a_cube).closures[0]["error"]
    assert f"{error:.1%} of the reflected light" in told(layout)
    assert "seen at grazing angles" in told(layout)
    for name in ("preview", "render_preview", "two_lights", "set_kind", "fit", "draw_chart"):
        assert name in layout.operators
    for name in ("kind", "count", "cap_albedo", "model", "fresnel", "norm", "threads", "chart"):
        assert name in layout.properties
    # Its file is there.
    assert "relink" not in layout.operators


@pytest.mark.parametrize("kind", ["measured", "lobe", "live", "principled", "auto"])
def test_panel_of_every_kind(addon, on_a_cube, kind):
    assert bpy.ops.lobefit.set_kind(kind=kind) == {"FINISHED"}
    layout = material_tab()
    assert "of the reflected light is off" in told(layout)
    assert ("of the fitted lobe's" in told(layout)) == (kind == "lobe")
    assert "default_value" in layout.properties
    assert "edited" not in told(layout)


def test_all_panels_without_and_with_an_object(addon):
    for space in ("PROPERTIES", "NODE_EDITOR", "VIEW_3D"):
        for panel in panels(space):
            if not hasattr(panel, "poll") or panel.poll(bpy.context):
                drawn(panel)
    bpy.ops.mesh.primitive_cube_add()
    assert "No material is selected" in told(material_tab())


def test_grazing_error_is_that_of_the_closures(addon, material):
    record = record_of(material)
    choice = addon.nodes.material.shown_by(material, record)
    table = record.closures[0]["by_view"]
    errors = [
        e for a, e in zip(table["view_angle"], table["relative_error"], strict=True) if a >= 70
    ]
    assert len(errors) > 3
    assert choice.grazing_error(record) == pytest.approx(np.mean(errors))
    live = addon.nodes.material.choose(record, "live")
    view = record.error_by_angle["view"]
    first = view["view_angle"].index(next(a for a in view["view_angle"] if a >= 70))
    expected = sum(view["misfit"][first:]) / sum(view["measured"][first:])
    assert live.grazing_error(record) == pytest.approx(expected)
    assert addon.nodes.material.choose(record, "principled").grazing_error(record) is None


def test_error_of_a_lobe_is_that_of_the_fit(addon, on_a_cube):
    """And not of its closures, which only tell how near they are to the lobe."""
    assert bpy.ops.lobefit.set_kind(kind="lobe") == {"FINISHED"}
    record, choose = record_of(on_a_cube), addon.nodes.material.choose
    lobe, live = choose(record, "lobe"), choose(record, "live")
    assert lobe.error(record) == live.error(record) > lobe.closures["error"]
    assert lobe.grazing_error(record) == live.grazing_error(record)


def test_panel_tells_of_more_light_than_arrives(addon, on_a_cube):
    record = json.loads(on_a_cube["lobefit_record"])
    albedos = record["closures"][0]["by_view"]["target_albedo"]
    assert max(map(max, albedos)) < 1 and "measurement reflects" not in told(material_tab())
    albedos[-1] = [1.25, 1.0, 1.0]
    shown = record["closures"][0]["by_view"]["closures_albedo"]
    shown[-1] = [1.2, 1.0, 1.0]
    on_a_cube["lobefit_record"] = json.dumps(record)
    assert "reflects 125.0% of the light" in told(material_tab())
    assert "the material at most 120.0%" in told(material_tab())


def test_panel_of_a_damaged_record(addon, on_a_cube):
    record = json.loads(on_a_cube["lobefit_record"])
    del record["parameters"]["diffuse"]
    on_a_cube["lobefit_record"] = json.dumps(record)
    layout = material_tab()
    assert "expected parameters.diffuse to be" in told(layout) and layout.operators == []


# Pictures.


def test_preview_is_shown(addon, on_a_cube, pictures):
    assert bpy.ops.lobefit.preview(size=64) == {"FINISHED"}
    titles = ["Measured", "As in Cycles", f"Error x{lobefit.preview.AMPLIFIED}"]
    layout = material_tab()
    assert [text for text in layout.texts if text in titles] == titles
    assert len(layout.icons) == 3
    kept = pictures.kept(on_a_cube, "spheres")
    record = record_of(on_a_cube)
    measurement = lobefit.read(record.source["path"])
    expected = lobefit.preview.compared(measurement, ("closures", record.closures[0]), 64)
    assert list(kept.pictures) == titles
    for found, image in zip(kept.pictures.values(), expected.values(), strict=True):
        assert np.array_equal(found[..., :3], image)
        # Around the sphere nothing is drawn.
        assert found[32, 32, 3] == 1 and found[0, 0, 3] == 0


def test_preview_is_of_one_material(addon, on_a_cube):
    bpy.ops.lobefit.preview(size=32)
    assert material_tab(material=bpy.data.materials.new("other")).icons == []


def test_preview_says_when_it_is_old(addon, on_a_cube):
    bpy.ops.lobefit.preview(size=32)
    assert "before the last change" not in told(material_tab())
    group_node(on_a_cube).inputs["Strength"].default_value = 0.5
    assert "before the last change" in told(material_tab())


def test_preview_of_what_was_edited_tells_its_error(addon, on_a_cube, pictures):
    bpy.ops.lobefit.preview(size=32)
    as_fitted = pictures.kept(on_a_cube, "spheres")
    assert not as_fitted.caption
    group_node(on_a_cube).inputs["Strength"].default_value = 0.5
    bpy.ops.lobefit.preview(size=32)
    edited = pictures.kept(on_a_cube, "spheres")
    error = float(edited.caption.split("%")[0].rpartition(" ")[2])

    def light(drawn):
        return drawn.pictures["As in Cycles"][..., :3].sum()

    # Half of the light is off, but for the error of the fit itself.
    assert error == pytest.approx(50, abs=3)
    assert light(edited) < 0.8 * light(as_fitted)


def test_picture_as_an_image(addon, on_a_cube):
    assert not bpy.ops.lobefit.open_picture.poll()
    bpy.ops.lobefit.preview(size=32)
    assert bpy.ops.lobefit.open_picture() == {"FINISHED"}
    image = bpy.data.images["Lobefit Preview"]
    assert tuple(image.size) == (96, 32)
    with pytest.raises(RuntimeError, match="drawn before"):
        bpy.ops.lobefit.open_picture(picture="charts")


def test_preview_by_cycles_is_that_of_the_formulas(addon, on_a_cube, pictures):
    bpy.ops.lobefit.preview(size=48)
    formula = pictures.kept(on_a_cube, "spheres").pictures["As in Cycles"]
    assert bpy.ops.lobefit.render_preview(size=48) == {"FINISHED"}
    rendered = pictures.kept(on_a_cube, "spheres").pictures
    assert list(rendered)[1] == "By Cycles"
    # sRGB levels; at the rim the pixels' centres of the mesh are inside or not.
    assert np.abs(rendered["By Cycles"] - formula).mean() < 0.01


def test_preview_by_cycles_is_of_the_material_as_it_is(addon, on_a_cube, pictures):
    group_node(on_a_cube).inputs["Tint"].default_value = (1, 0, 0, 1)
    assert bpy.ops.lobefit.render_preview(size=32) == {"FINISHED"}
    rendered = pictures.kept(on_a_cube, "spheres").pictures["By Cycles"]
    assert rendered[..., 0].max() > 0.1 and rendered[..., 1:3].max() < 1e-3


@pytest.mark.parametrize(
    ("chart", "kind"),
    [
        ("ERROR_MAP", "measured"),
        ("ERROR_MAP", "principled"),
        ("LOBE", "live"),
        ("ALBEDO", "measured"),
        ("ALBEDO", "principled"),
    ],
)
def test_charts(addon, on_a_cube, pictures, chart, kind):
    bpy.ops.lobefit.set_kind(kind=kind)
    assert bpy.ops.lobefit.draw_chart(chart=chart) == {"FINISHED"}
    (picture,) = pictures.kept(on_a_cube, "charts").pictures.values()
    assert min(picture.shape[:2]) > 400 and picture.min() >= 0 and picture.max() <= 1
    # More than one color is drawn on the page.
    assert np.unique((picture * 255).astype(int).reshape(-1, 3), axis=0).shape[0] > 20
    assert len(material_tab().icons) == 1


# Kinds.


def test_kind_without_fitting_anew(addon, on_a_cube):
    before = record_of(on_a_cube)
    assert bpy.ops.lobefit.set_kind(kind="measured", count=1) == {"FINISHED"}
    after = record_of(on_a_cube)
    assert on_a_cube["lobefit_kind"] == "measured" and on_a_cube["lobefit_closures"] == 1
    assert after.parameters == before.parameters and after.seconds == before.seconds
    assert {entry["count"] for entry in after.closures} == {1, 2}


def test_kind_of_many_materials(addon, on_a_cube, fitted):
    plain = bpy.data.materials.new("plain")
    other, outside = (addon.build_material(fitted, "measured", name) for name in ("b", "c"))
    for material in (other, plain):
        bpy.context.object.data.materials.append(material)
    assert bpy.ops.lobefit.set_kind(kind="principled", scope="SELECTED") == {"FINISHED"}
    kinds = [material["lobefit_kind"] for material in (on_a_cube, other, outside)]
    assert kinds == ["principled", "principled", "measured"]
    assert "lobefit_kind" not in plain


def test_kind_of_many_of_which_one_has_lost_its_file(addon, on_a_cube, fitted):
    other = addon.build_material(fitted, "measured", "other")
    record = json.loads(other["lobefit_record"])
    record["source"]["path"] = "/nowhere/gone.binary"
    other["lobefit_record"] = json.dumps(record)
    bpy.context.object.data.materials.append(other)
    assert bpy.ops.lobefit.set_kind(kind="measured", count=0, scope="SELECTED") == {"FINISHED"}
    assert on_a_cube["lobefit_closures"] == 0 and other["lobefit_closures"] == 2


def test_kind_needs_a_measured_material(addon):
    assert not bpy.ops.lobefit.set_kind.poll()


# Parameters.


def test_parameters_go_live_and_are_reset(addon, on_a_cube, parameters):
    assert bpy.ops.lobefit.edit_parameters() == {"FINISHED"}
    assert on_a_cube["lobefit_kind"] == "live"
    assert not bpy.ops.lobefit.edit_parameters.poll()
    assert not bpy.ops.lobefit.reset_parameters.poll()
    node = group_node(on_a_cube)
    fitted = node.inputs["Exponent"].default_value
    node.inputs["Exponent"].default_value = 7.0
    image = on_a_cube.node_tree.nodes.new("ShaderNodeTexImage")
    on_a_cube.node_tree.links.new(image.outputs["Color"], node.inputs["Base Color"])
    assert "were edited" in told(material_tab()) and "from another node" in told(material_tab())
    assert bpy.ops.lobefit.reset_parameters() == {"FINISHED"}
    assert node.inputs["Exponent"].default_value == close(fitted)
    assert not node.inputs["Base Color"].is_linked
    assert image.name in on_a_cube.node_tree.nodes
    assert "were edited" not in told(material_tab())


@pytest.mark.parametrize("kind", ["measured", "principled"])
def test_reset_of_a_tree_without_its_nodes(addon, on_a_cube, kind):
    bpy.ops.lobefit.set_kind(kind=kind)
    on_a_cube.node_tree.nodes.clear()
    assert "no longer those of the fit" in told(material_tab())
    assert bpy.ops.lobefit.reset_parameters() == {"FINISHED"}
    assert on_a_cube["lobefit_kind"] == kind
    assert not bpy.ops.lobefit.reset_parameters.poll()


def test_edited_parameters_as_formulas(addon, on_a_cube, parameters):
    """What is drawn of an edited live group is what the record would hold of these values."""
    bpy.ops.lobefit.edit_parameters()
    record = record_of(on_a_cube)
    shown = parameters.edited_shown(on_a_cube, ("live", record.parameters))
    for name in ("diffuse", "specular", "exponent", "interpolation", "ior"):
        assert shown[1][name] == close(record.parameters[name])
    node = group_node(on_a_cube)
    node.inputs["Fresnel"].default_value = 0.0
    assert parameters.edited_shown(on_a_cube, ("live", record.parameters))[1]["ior"] is None
    node.inputs["Fresnel"].default_value = 0.5
    assert parameters.edited_shown(on_a_cube, ("live", record.parameters)) is None


# The measured file.


@pytest.fixture
def moved(addon, on_a_cube, measured_file, tmp_path):
    """The material and the place of a copy of its file, which is gone from where it was."""
    place = tmp_path / "elsewhere" / "deep" / Path(measured_file).name
    place.parent.mkdir(parents=True)
    shutil.copy(measured_file, place)
    record = json.loads(on_a_cube["lobefit_record"])
    record["source"]["path"] = f"/nowhere/{place.name}"
    on_a_cube["lobefit_record"] = json.dumps(record)
    return on_a_cube, place


@pytest.mark.parametrize("by", ["file", "folder"])
def test_relink(addon, moved, by, tmp_path):
    material, place = moved
    assert "relink" in material_tab().operators
    path = place if by == "file" else tmp_path
    assert bpy.ops.lobefit.relink(filepath=str(path)) == {"FINISHED"}
    assert record_of(material).source["path"] == str(place)
    assert "relink" not in material_tab().operators
    assert bpy.ops.lobefit.set_kind(kind="measured", count=1) == {"FINISHED"}


def test_relink_of_all_in_a_folder(addon, moved, tmp_path):
    material, place = moved
    other = material.copy()
    assert bpy.ops.lobefit.relink(filepath=str(place), all_materials=False) == {"FINISHED"}
    assert record_of(other).source["path"].startswith("/nowhere")
    assert bpy.ops.lobefit.relink(filepath=str(place)) == {"FINISHED"}
    assert record_of(other).source["path"] == str(place)


def test_relink_to_another_file(addon, moved):
    material, place = moved
    before = material["lobefit_record"]
    lobefit._native.sample("violet-rubber").write(str(place))
    with pytest.raises(RuntimeError, match="found another one; Fit"):
        bpy.ops.lobefit.relink(filepath=str(place))
    with pytest.raises(RuntimeError, match="found no such file"):
        bpy.ops.lobefit.relink(filepath=str(place.parent))
    with pytest.raises(RuntimeError, match="found no such file"):
        bpy.ops.lobefit.relink(filepath=str(place.with_name("none.binary")))
    assert material["lobefit_record"] == before


def test_the_folder_of_the_preferences_is_looked_at(addon, moved):
    _, place = moved
    preferences = bpy.context.preferences.addons[addon.__name__].preferences
    preferences.measured_folder = str(place.parent)
    try:
        assert "relink" not in material_tab().operators
        assert bpy.ops.lobefit.preview(size=32) == {"FINISHED"}
        assert len(material_tab().icons) == 3
    finally:
        preferences.property_unset("measured_folder")


# Preferences.


def test_options_follow_the_preferences_until_they_are_chosen(addon, measured_file):
    preferences = bpy.context.preferences.addons[addon.__name__].preferences
    preferences.kind = "live"
    try:
        bpy.ops.lobefit.import_measured(filepath=measured_file)
        bpy.ops.lobefit.import_measured(filepath=measured_file, kind="principled")
        kinds = sorted(material["lobefit_kind"] for material in bpy.data.materials)
        assert kinds == ["live", "principled"]
        last = bpy.context.window_manager.operator_properties_last("lobefit.set_kind")
        addon.preferred.take_preferred(last)
        assert last.kind == "live"
        last.kind = "lobe"
        addon.preferred.take_preferred(last)
        assert last.kind == "lobe"
        preferences.kind = "principled"
        addon.preferred.take_preferred(last)
        assert last.kind == "principled"
    finally:
        preferences.property_unset("kind")
        addon.preferred.forget_chosen(bpy.context)


def test_libraries_go_where_the_preferences_tell(addon, tmp_path):
    preferences = bpy.context.preferences.addons[addon.__name__].preferences
    assert addon.preferred.library_folder(tmp_path) == tmp_path
    preferences.library_folder = str(tmp_path / "libraries")
    try:
        assert addon.preferred.library_folder(tmp_path) == tmp_path / "libraries"
    finally:
        preferences.property_unset("library_folder")


# Materials of other versions.


def test_update_keeps_what_was_edited(addon, on_a_cube):
    assert not bpy.ops.lobefit.update_materials.poll()
    node = group_node(on_a_cube)
    node.inputs["Strength"].default_value = 0.5
    noise = on_a_cube.node_tree.nodes.new("ShaderNodeTexNoise")
    on_a_cube.node_tree.links.new(noise.outputs["Color"], node.inputs["Tint"])
    old, name = node.node_tree, node.node_tree.name
    old.nodes.clear()
    del on_a_cube["lobefit_version"]
    assert "older version" in told(material_tab())
    assert bpy.ops.lobefit.update_materials() == {"FINISHED"}
    assert group_node(on_a_cube) == node and node.node_tree.nodes
    assert node.node_tree.name == name and len(bpy.data.node_groups) == 1
    assert node.inputs["Strength"].default_value == 0.5
    assert node.inputs["Tint"].links[0].from_node == noise
    assert "older version" not in told(material_tab())


def test_update_of_an_older_live_group(addon, on_a_cube):
    bpy.ops.lobefit.edit_parameters()
    node = group_node(on_a_cube)
    node.node_tree["lobefit_version"] = 2
    node.inputs["Exponent"].default_value = 7.0
    assert "older version" in told(material_tab())
    assert bpy.ops.lobefit.update_materials() == {"FINISHED"}
    assert node.node_tree["lobefit_version"] == addon.nodes.live.VERSION
    assert node.inputs["Exponent"].default_value == 7.0
    live = [group for group in bpy.data.node_groups if "lobefit_version" in group]
    assert live == [node.node_tree]


def test_update_leaves_linked_materials(addon, on_a_cube, tmp_path):
    del on_a_cube["lobefit_version"]
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {on_a_cube}, fake_user=True)
    name = on_a_cube.name
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, ours):
        ours.materials = [name]
    (linked,) = bpy.data.materials
    layout = material_tab(material=linked)
    assert "Linked from library.blend" in told(layout) and "update it there" in told(layout)
    assert "update_materials" not in layout.operators
    before = linked["lobefit_record"]
    with pytest.raises(RuntimeError, match="it is linked from another file"):
        bpy.ops.lobefit.update_materials()
    assert linked["lobefit_record"] == before and "lobefit_version" not in linked
    with bpy.context.temp_override(material=linked):
        for operator in ("edit_parameters", "reset_parameters", "fit", "relink"):
            assert not getattr(bpy.ops.lobefit, operator).poll()
        assert bpy.ops.lobefit.preview(size=32) == {"FINISHED"}


def test_material_of_a_later_version_is_left_alone(addon, on_a_cube):
    record = json.loads(on_a_cube["lobefit_record"])
    on_a_cube["lobefit_record"] = json.dumps({"schema": record["schema"] + 1})
    layout = material_tab()
    assert "later version" in told(layout) and layout.operators == []
    assert not bpy.ops.lobefit.update_materials.poll()


def test_the_schema_is_that_of_records(addon):
    assert addon.records.SCHEMA == lobefit.record.SCHEMA


# The scene with two lights.


@pytest.mark.parametrize("subject", ["SPHERE", "OBJECT"])
def test_scene_with_two_lights(addon, on_a_cube, two_lights, subject):
    mine = bpy.context.scene
    count = len(mine.objects)
    assert bpy.ops.lobefit.two_lights(subject=subject) == {"FINISHED"}
    scene = bpy.context.scene
    assert scene != mine and len(mine.objects) == count
    assert bpy.context.object.active_material == on_a_cube
    scene.render.resolution_x, scene.render.resolution_y = 128, 64
    picture = two_lights.render_pixels(scene)
    measurement = lobefit.read(record_of(on_a_cube).source["path"])
    # Each sun shows the emission of the picture once more.
    beside = picture[:, :64] / 2
    expected = lobefit._native.preview(measurement, 64)
    # The camera sees 2.1 radii, and the picture's pixels are smaller than these.
    lit = slice(20, 44)
    assert beside[lit, lit].sum() == pytest.approx(expected[lit, lit].sum(), rel=0.1)
    assert picture[:, 64:].max() > 0
    if subject == "SPHERE":
        ours = picture[:, 64:]
        assert ours[lit, lit].sum() == pytest.approx(expected[lit, lit].sum(), rel=0.15)
        # What stands beside it is seen by the camera alone, and throws no light on it.
        bpy.data.objects.remove(scene.objects["Measured"])
        assert np.array_equal(ours, two_lights.render_pixels(scene)[:, 64:])


def test_scene_without_the_measurement(addon):
    bpy.ops.mesh.primitive_cube_add()
    assert not bpy.ops.lobefit.two_lights.poll()
    plain = bpy.data.materials.new("plain")
    bpy.context.object.data.materials.append(plain)
    assert bpy.ops.lobefit.two_lights() == {"FINISHED"}
    scene = bpy.context.scene
    assert [item.name for item in scene.objects if item.type == "MESH"] == ["Sphere"]
    assert scene.objects["Sphere"].active_material == plain
    assert scene.render.resolution_x == scene.render.resolution_y


# Every class.


def classes():
    return [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("LOBEFIT_")]


def own_properties(cls):
    """The properties that Lobefit itself defines, which are those that are annotated."""
    annotated = {name for base in cls.__mro__ for name in vars(base).get("__annotations__", ())}
    ours = [base for base in cls.__mro__ if base.__module__.startswith("bl_ext")]
    names = {name for base in ours for name in vars(base).get("__annotations__", ())}
    rna = (
        cls.bl_rna.properties
        if not issubclass(cls, bpy.types.Operator)
        else (getattr(bpy.ops.lobefit, cls.bl_idname.split(".")[1]).get_rna_type().properties)
    )
    return [rna[name] for name in names & annotated if name in rna]


def test_every_class_is_described(addon):
    assert len(classes()) > 20
    for cls in classes():
        description = (cls.__doc__ or "").strip()
        assert description and not description.endswith("."), cls
        assert len(description) < 180, cls


def test_every_property_is_described(addon):
    count = 0
    for cls in classes():
        for item in own_properties(cls):
            count += 1
            assert item.description, f"{cls.__name__}.{item.identifier}"
            assert item.name or item.is_hidden, f"{cls.__name__}.{item.identifier}"
            assert not item.description.endswith("."), f"{cls.__name__}.{item.identifier}"
            for choice in getattr(item, "enum_items", ()):
                assert choice.description, f"{cls.__name__}.{item.identifier} {choice.identifier}"
    assert count > 60


def test_greyed_out_buttons_say_why(addon, monkeypatch):
    """Wherever a poll refuses, the operator tells the reason."""
    for cls in classes():
        if not issubclass(cls, bpy.types.Operator) or not hasattr(cls, "poll"):
            continue
        reasons = []
        monkeypatch.setattr(cls, "poll_message_set", reasons.append, raising=False)
        if not cls.poll(bpy.context):
            assert reasons and reasons[-1][0].isupper(), cls
