"""What becomes of files that are dropped on the editors, and that each drop is one undo step."""

import time

import pytest
from window import HEIGHT, PATIENCE, FileBrowser

STATE = """
import bl_ext.user_default.lobefit as lobefit
measured = [m for m in bpy.data.materials if 'lobefit_record' in m]
cube = bpy.data.objects['Cube']
result = {
    'idle': lobefit.operators.run.current() is None,
    'kept': sorted(m.name for m in measured if m.use_fake_user),
    'slots': [slot.material and slot.material.name for slot in cube.material_slots],
}
"""
CUBE = """
from bpy_extras.view3d_utils import location_3d_to_region_2d
area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == 'VIEW_3D')
region = next(r for r in area.regions if r.type == 'WINDOW')
place = location_3d_to_region_2d(region, area.spaces.active.region_3d, (0, 0, 0))
result = [region.x + place.x, region.y + place.y]
"""


@pytest.fixture(scope="module")
def files(shared):
    return FileBrowser(shared)


def settled(window):
    """How things stand when nothing is fitted any more."""
    window.wait_for("bool(bpy.context)")
    while not (state := window.ask(STATE))["idle"]:
        pass
    return {key: state[key] for key in ("kept", "slots")}


def undone(window, place):
    """The same after one step was undone."""
    window.move(place)
    window.key("ctrl+z")
    return settled(window)


def push_undo(window):
    """Ends an undo step, as soon as Blender allows it: what a drop left may still be drawn."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return window.ask("bpy.ops.ed.undo_push()")
        except RuntimeError as refused:
            if "(drawing/rendering)" not in str(refused) or time.monotonic() > end:
                raise


BEFORE = {"kept": [], "slots": ["Material"]}


@pytest.fixture
def cube(shared, files):
    """Where the cube is on the display; there is no measured material yet."""
    # Each test takes its drop back itself: Blender 4.3 comes to an end where a script removes a
    # material whose icon is being drawn, while undoing ends that first.
    assert settled(shared) == BEFORE
    push_undo(shared)
    x, y = shared.ask(CUBE)
    return x, HEIGHT - y


def test_on_an_object(shared, files, cube):
    shared.drag(files.place("nickel.binary"), cube, picture="drop_on_an_object")
    assert settled(shared) == {"kept": [], "slots": ["nickel"]}
    assert undone(shared, cube) == BEFORE


def test_beside_all_objects(shared, files, cube):
    shared.drag(files.place("nickel.binary"), (cube[0] + 300, cube[1]))
    assert settled(shared) == {"kept": ["nickel"], "slots": ["Material"]}
    assert undone(shared, cube) == BEFORE


def test_several_files(shared, files, cube):
    shared.move(cube)
    shared.drop("nickel.binary", "violet-rubber.binary")
    state = settled(shared)
    shared.shot("several_files")
    assert state == {"kept": ["nickel", "violet-rubber"], "slots": ["Material"]}
    shared.key("Escape")
    assert undone(shared, (cube[0] + 300, cube[1])) == BEFORE


def test_on_the_material_tab(shared, files, cube):
    shared.ask(
        "areas = bpy.context.window_manager.windows[0].screen.areas\n"
        "space = next(a for a in areas if a.type == 'PROPERTIES').spaces.active\n"
        "space.context = 'MATERIAL'"
    )
    left, top, width, height = shared.area("PROPERTIES")
    shared.drag(files.place("nickel.binary"), (left + width * 0.6, top + height * 0.8))
    assert settled(shared) == {"kept": [], "slots": ["nickel"]}
    shared.shot("drop_on_the_material_tab")
    assert undone(shared, cube) == BEFORE


def test_on_the_shader_editor(shared, files, cube):
    shared.ask(
        "areas = bpy.context.window_manager.windows[0].screen.areas\n"
        "next(a for a in areas if a.type == 'VIEW_3D').ui_type = 'ShaderNodeTree'"
    )
    left, top, width, height = shared.area("NODE_EDITOR")
    place = left + width // 2, top + height // 2
    shared.drag(files.place("nickel.binary"), place)
    assert settled(shared) == BEFORE
    shared.shot("drop_on_the_shader_editor")
    found, expected = shared.ask(
        "nodes = bpy.data.materials['Material'].node_tree.nodes\n"
        "node = next(n for n in nodes if 'lobefit_record' in n)\n"
        "areas = bpy.context.window_manager.windows[0].screen.areas\n"
        "area = next(a for a in areas if a.type == 'NODE_EDITOR')\n"
        "region = next(r for r in area.regions if r.type == 'WINDOW')\n"
        f"x, y = {place[0]} - region.x, {HEIGHT - place[1]} - region.y\n"
        "scale = bpy.context.preferences.system.ui_scale\n"
        "seen = [place / scale for place in region.view2d.region_to_view(x, y)]\n"
        "result = [list(node.location), seen]"
    )
    # The mouse is at whole pixels.
    assert found == pytest.approx(expected, abs=5)
