"""Where an import goes: slots, node trees and fake users; what linked data-blocks allow."""

import importlib
import json
from types import SimpleNamespace

import bpy
import lobefit
import pytest
from conftest import EXTENSION
from mathutils import Matrix
from test_import import data_blocks


@pytest.fixture
def picking(addon):
    """The module that finds what is under the cursor."""
    return importlib.import_module(f"{EXTENSION}.picking")


def add(make=bpy.ops.mesh.primitive_cube_add, slots=0, **options):
    """An object at the origin, 2 units wide, with so many different materials."""
    make(**options)
    item = bpy.context.object
    for index in range(slots):
        item.data.materials.append(bpy.data.materials.new(f"slot {index}"))
    return item


def editor(kind):
    """The area of a window, as an editor of this kind."""
    area = bpy.context.window_manager.windows[0].screen.areas[0]
    area.type = kind
    return area


def overriding(area, **members):
    """The context that an operator has in this editor."""
    window = bpy.context.window_manager.windows[0]
    (region,) = [region for region in area.regions if region.type == "WINDOW"]
    return bpy.context.temp_override(window=window, area=area, region=region, **members)


def quick_import(path, **options):
    """Imports a file as the kind that takes the least time, if no other is asked for."""
    options = {"kind": "principled"} | options
    return bpy.ops.lobefit.import_measured(filepath=path, **options)


@pytest.fixture
def from_above(picking):
    """Looks straight down at a place of the plane z = 0, 10 units wide, seen in 100 pixels."""
    space = editor("VIEW_3D").spaces.active
    view = Matrix.Translation((0, 0, -10))
    projection = Matrix.Diagonal((1 / 5, 1 / 5, -1 / 100, 1))
    context = SimpleNamespace(
        region=SimpleNamespace(width=100, height=100),
        region_data=SimpleNamespace(
            is_perspective=False,
            view_matrix=view,
            window_matrix=projection,
            perspective_matrix=projection @ view,
            view_perspective="ORTHO",
        ),
        space_data=space,
    )

    def look(x, y):
        bpy.context.view_layer.update()
        context.scene, context.view_layer = bpy.context.scene, bpy.context.view_layer
        context.evaluated_depsgraph_get = bpy.context.evaluated_depsgraph_get
        return picking.slot_under(context, (50 + 10 * x, 50 + 10 * y))

    yield look
    space.show_object_viewport_mesh = True


def paint_right_half(mesh):
    """Gives the second material to the faces at x > 0."""
    for face in mesh.polygons:
        face.material_index = int(face.center.x > 0)


def test_the_slot_of_the_face_under_the_cursor(from_above):
    grid = add(bpy.ops.mesh.primitive_grid_add, slots=2, x_subdivisions=2, y_subdivisions=2)
    paint_right_half(grid.data)
    assert from_above(0.5, 0.5) == (grid, 1)
    assert from_above(-0.5, 0.5) == (grid, 0)
    assert from_above(3, 3) is None
    grid.modifiers.new("finer", "SUBSURF")
    assert from_above(0.3, 0.3) == (grid, 1)
    bpy.ops.object.mode_set(mode="EDIT")
    assert from_above(0.5, 0.5) == (grid, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    grid.data.materials.pop()
    assert from_above(0.5, 0.5) == (grid, 0)


def test_surfaces_that_are_no_meshes(from_above):
    ball = add(bpy.ops.surface.primitive_nurbs_surface_sphere_add, slots=1)
    # Blender 4.2 sends its rays at meshes and metaballs alone.
    found = (ball, 0) if bpy.app.version >= (4, 3) else None
    assert from_above(0.1, 0.1) == found


def test_an_instance_stands_for_its_object(from_above):
    cube = add()
    inside = bpy.data.collections.new("inside")
    inside.objects.link(cube)
    bpy.context.scene.collection.objects.unlink(cube)
    bpy.ops.object.collection_instance_add(collection=inside.name)
    assert from_above(0, 0) == (cube, 0)


def test_what_the_viewport_does_not_show_is_seen_through(from_above):
    add(location=(0, 0, 3))
    ball = add(bpy.ops.object.metaball_add, type="BALL")
    editor("VIEW_3D").spaces.active.show_object_viewport_mesh = False
    assert from_above(0.1, 0.1) == (ball, 0)


def test_no_object(measured_file):
    cube = add(slots=1)
    quick_import(measured_file, place="NONE")
    assert [slot.material.name for slot in cube.material_slots] == ["slot 0"]
    (material,) = [item for item in bpy.data.materials if "lobefit_record" in item]
    assert material.use_fake_user


def test_a_slot_by_its_object_and_number(measured_file):
    cube = add(slots=2)
    add()
    quick_import(measured_file, object=cube.name, slot=1)
    assert cube.material_slots[0].material.name == "slot 0"
    material = cube.material_slots[1].material
    assert "lobefit_record" in material and not material.use_fake_user
    assert not bpy.context.object.material_slots


def test_an_object_that_takes_no_material(measured_file):
    bpy.ops.object.light_add()
    before = data_blocks()
    with pytest.raises(RuntimeError, match="found 'nobody'"):
        quick_import(measured_file, object="nobody")
    assert data_blocks() == before
    # As the active object it is none that was asked for.
    assert quick_import(measured_file) == {"FINISHED"}


def test_of_several_files_none_is_assigned(measured_file, tmp_path):
    cube = add()
    names = [{"name": f"{index}.binary"} for index in range(2)]
    for item in names:
        (tmp_path / item["name"]).hardlink_to(measured_file)
    bpy.ops.lobefit.import_measured(directory=str(tmp_path), files=names, kind="principled")
    assert not cube.material_slots
    assert [material.use_fake_user for material in bpy.data.materials] == [True, True]


def dropped_on(addon, area, **members):
    """The operator after a file was dropped on an editor, which takes a window to be done."""
    operator = addon.operators.import_measured.LOBEFIT_OT_import_measured

    class Dropped(SimpleNamespace):
        _place_by_editor = operator._place_by_editor
        _aim_at = operator._aim_at

    dropped = Dropped(directory="/", place="", location=None)
    with overriding(area, **members):
        dropped._place_by_editor(bpy.context, SimpleNamespace(mouse_x=0, mouse_y=0))
    return dropped


def test_a_drop_on_the_material_tab_fills_the_active_slot(addon):
    cube, dropped = add(slots=3), bpy.data.materials.new("dropped")
    cube.active_material_index = 1
    assert dropped_on(addon, editor("PROPERTIES"), object=cube)._aimed.put(dropped) == ""
    assert [slot.material.name for slot in cube.material_slots] == ["slot 0", "dropped", "slot 2"]


def test_a_drop_on_the_material_tab_of_no_object(addon):
    assert dropped_on(addon, editor("PROPERTIES"), object=None).place == "NONE"


@pytest.fixture
def shader_editor():
    """A shader editor that shows a tree, given its material."""

    def show(material):
        area = editor("NODE_EDITOR")
        area.ui_type = "ShaderNodeTree"
        space = area.spaces.active
        space.pin = True
        space.node_tree = material.node_tree
        return area

    return show


def plain_material():
    material = bpy.data.materials.new("plain")
    if not material.node_tree:
        material.use_nodes = True
    return material


def test_where_files_can_be_dropped(shader_editor):
    handler = bpy.types.LOBEFIT_FH_measured

    def takes(area):
        with overriding(area):
            return handler.poll_drop(bpy.context)

    assert takes(editor("VIEW_3D"))
    properties = editor("PROPERTIES")
    assert not takes(properties)
    assert not takes(editor("TEXT_EDITOR"))
    shader = shader_editor(plain_material())
    assert takes(shader)
    shader.spaces.active.shader_type = "WORLD"
    assert not takes(shader)
    shader.spaces.active.shader_type = "OBJECT"
    shader.ui_type = "CompositorNodeTree"
    assert not takes(shader)


@pytest.mark.parametrize("kind", ["measured", "lobe", "live", "principled", "auto"])
def test_a_group_in_the_shader_editor(shader_editor, measured_file, kind):
    material = plain_material()
    before = set(material.node_tree.nodes)
    with overriding(shader_editor(material)):
        options = {"place": "NODES", "location": (30, -40), "kind": kind}
        quick_import(measured_file, **options)
    (node,) = set(material.node_tree.nodes) - before
    assert (node.type == "GROUP") == (kind != "principled" and node["lobefit_kind"] != "principled")
    assert tuple(node.location) == (30, -40)
    assert [item for item in material.node_tree.nodes if item.select] == [node]
    assert material.node_tree.nodes.active == node
    assert lobefit.Record.from_json(node["lobefit_record"]).source["path"] == measured_file
    assert list(bpy.data.materials) == [material] and "lobefit_record" not in material


def test_a_lobe_of_several_exponents_keeps_its_shape(addon, shader_editor, measured_file):
    record = lobefit.fit(measured_file, channels="separate")
    tree = plain_material().node_tree
    node = addon.nodes.material.add_to_tree(tree, record, (30, -40), "live")
    added = [item for item in tree.nodes if item.select]
    assert node.type == "ADD_SHADER" and "lobefit_record" in node
    assert len(added) == 2 * len(set(record.parameters["exponent"])) - 1
    assert len({tuple(item.location) for item in added}) == len(added)


def test_a_drop_on_the_shader_editor(addon, shader_editor):
    dropped = dropped_on(addon, shader_editor(plain_material()))
    assert dropped.place == "NODES" and len(dropped.location) == 2


def test_a_group_needs_a_shader_editor(measured_file):
    with pytest.raises(RuntimeError, match="Expected a shader editor"):
        quick_import(measured_file, place="NODES")


def test_add_live(shader_editor):
    assert not bpy.ops.lobefit.add_live.poll()
    material = plain_material()
    with overriding(shader_editor(material)):
        assert bpy.ops.lobefit.add_live(location=(5, 6)) == {"FINISHED"}
        assert bpy.ops.lobefit.add_live() == {"FINISHED"}
    first, second = [node for node in material.node_tree.nodes if node.type == "GROUP"]
    assert tuple(first.location) == (5, 6)
    assert first.node_tree == second.node_tree and material.node_tree.nodes.active == second


def test_half_an_import_is_taken_back(addon, measured_file):
    operators = addon.operators.import_measured
    record = lobefit.closures(measured_file, count=1)
    outcomes = [importlib.import_module(f"{addon.__name__}.jobs").Outcome("", record=record)] * 3
    before = data_blocks()
    stand_in = SimpleNamespace(_target=None, report=None)
    made = operators.LOBEFIT_OT_import_measured._make_materials(
        stand_in, outcomes, {"kind": "measured"}
    )
    for _ in range(3):
        next(made)
    assert len(bpy.data.materials) == 2
    made.close()
    assert data_blocks() == before


# Data-blocks of other files


@pytest.fixture
def library(material, tmp_path):
    """A file with an object that has a measured material and an empty slot, and one without any."""
    mesh = bpy.data.meshes.new("mesh")
    mesh.materials.append(material)
    mesh.materials.append(None)
    for name, data in (("object", mesh), ("bare", bpy.data.meshes.new("bare mesh"))):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, data))
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return path


def load(path, kind, name, link=True):
    """A data-block of a file, linked or appended; objects in the scene and active."""
    with bpy.data.libraries.load(str(path), link=link) as (_source, target):
        setattr(target, kind, [name])
    (item,) = getattr(target, kind)
    if kind == "objects":
        bpy.context.scene.collection.objects.link(item)
        bpy.context.view_layer.objects.active = item
    return item


def saved_and_read(path):
    """The open file, after it was written and read."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))


def local_materials():
    return [material for material in bpy.data.materials if material.library is None]


def test_a_linked_object_is_left_alone(library, measured_file, capfd):
    item = load(library, "objects", "object")
    quick_import(measured_file)
    assert item.material_slots[0].material.library
    (material,) = local_materials()
    assert material.use_fake_user
    assert (
        "object was not given the material: it is linked from another file"
        in capfd.readouterr().out
    )


@pytest.mark.parametrize("overridden", [False, True])
def test_an_object_of_linked_data_has_slots_of_its_own(
    library, measured_file, tmp_path, overridden
):
    item = load(library, "objects", "object")
    item = item.override_create(remap_local_usages=True) if overridden else item.copy()
    if not overridden:
        bpy.context.scene.collection.objects.link(item)
    name = item.name
    quick_import(measured_file, object=name, slot=1)
    saved_and_read(tmp_path / "open.blend")
    (item,) = [item for item in bpy.data.objects if item.library is None]
    assert item.material_slots[0].material.library
    assert item.material_slots[1].material in local_materials()
    assert item.material_slots[1].link == "OBJECT"


def test_linked_data_without_a_slot_are_given_none(library, measured_file, capfd):
    item = load(library, "objects", "bare").copy()
    bpy.context.scene.collection.objects.link(item)
    quick_import(measured_file, object=item.name)
    assert not item.material_slots
    (material,) = local_materials()
    assert material.use_fake_user
    assert "it has no slot, and its data belong to another file" in capfd.readouterr().out


def fit_is_refused(material, reason):
    """Whether Fit of this material says no, for this reason."""
    with bpy.context.temp_override(material=material):
        assert not bpy.ops.lobefit.fit.poll()
        with pytest.raises(RuntimeError, match=reason):
            bpy.ops.lobefit.fit(kind="live")
    return True


def test_a_linked_material_is_left_alone(library, shader_editor, measured_file):
    material = load(library, "materials", "nickel")
    nodes = [node.name for node in material.node_tree.nodes]
    assert fit_is_refused(material, "it is linked from another file")
    with overriding(shader_editor(material)):
        assert not bpy.ops.lobefit.add_live.poll()
        with pytest.raises(RuntimeError, match="cannot be edited: it is linked"):
            quick_import(measured_file, place="NODES")
    assert [node.name for node in material.node_tree.nodes] == nodes
    with bpy.context.temp_override(material=material):
        assert bpy.ops.lobefit.preview() == {"FINISHED"}


def test_an_overridden_material_is_left_alone(library, shader_editor):
    material = load(library, "materials", "nickel").override_create(remap_local_usages=True)
    assert fit_is_refused(material, "library override")
    with bpy.context.temp_override(material=material):
        for operator in ("set_kind", "edit_parameters", "reset_parameters", "relink"):
            with pytest.raises(RuntimeError, match="library override"):
                getattr(bpy.ops.lobefit, operator)()
    del material["lobefit_version"]
    with pytest.raises(RuntimeError, match="library override"):
        bpy.ops.lobefit.update_materials()
    with overriding(shader_editor(material)):
        assert not bpy.ops.lobefit.add_live.poll()


@pytest.mark.parametrize("way", ["appended", "made local"])
def test_a_material_of_the_file_s_own_is_fitted_anew(library, tmp_path, way):
    material = load(library, "materials", "nickel", link=way != "appended")
    if way == "made local":
        material = material.make_local()
    with bpy.context.temp_override(material=material):
        assert bpy.ops.lobefit.fit(kind="live") == {"FINISHED"}
    material.use_fake_user = True
    name = material.name
    saved_and_read(tmp_path / "open.blend")
    material = bpy.data.materials[name]
    assert material["lobefit_kind"] == "live"
    assert json.loads(material["lobefit_record"])["source"]["path"].endswith("nickel.binary")


def test_the_slot_of_an_object_that_was_removed(addon):
    targets = importlib.import_module(f"{EXTENSION}.targets")
    cube = add()
    target = targets.SlotTarget(cube, 0)
    bpy.data.objects.remove(cube)
    assert "removed" in target.put(plain_material())
