"""A fit that is left in the middle leaves no thread, no timer and no data-block."""

import time

import pytest
from window import PATIENCE

FILES = ("nickel.binary", "violet-rubber.binary")
STATE = """
import os
import sys
run = sys.modules['bl_ext.user_default.lobefit.operators.run']
result = {
    'running': run.current() is not None,
    'measured': sum('lobefit_record' in m for m in bpy.data.materials),
    'groups': len(bpy.data.node_groups),
    'threads': len(os.listdir('/proc/self/task')),
}
"""


@pytest.fixture
def begun(shared):
    """The window with an import under way, and how things stood before."""
    # The first one also starts what Blender keeps, as the threads of its own scheduler.
    if not shared.ask("result = bpy.app.driver_namespace.get('warm', False)"):
        shared.drop(*FILES)
        shared.ask("bpy.app.driver_namespace['warm'] = result = True")
        while shared.ask(STATE)["running"]:
            pass
        shared.key("Escape")
        shared.ask("for m in list(bpy.data.materials): bpy.data.materials.remove(m)")
        shared.ask("for g in list(bpy.data.node_groups): bpy.data.node_groups.remove(g)")
    # Blender drops the handler of an operator that is gone with the next event, and 4.3 crashes on
    # another modal operator before that.
    shared.move((500, 300))
    shared.move((600, 400))
    before = shared.ask(STATE)
    assert not before["running"]
    assert shared.drop(*FILES) == ["RUNNING_MODAL"]
    assert shared.ask(STATE)["running"]
    return shared, before


def test_escape(begun):
    window, before = begun
    window.move((600, 400))
    window.key("Escape")
    assert window.ask(STATE) == before


def test_the_button(begun):
    window, before = begun
    window.shot("progress")
    window.click((1581, 989))
    assert window.ask(STATE) == before


def test_another_file(begun):
    window, before = begun
    window.tell("bpy.ops.wm.read_homefile(use_factory_startup=False)")
    time.sleep(1)
    state = window.ask(STATE)
    assert not state["running"] and not state["measured"]
    assert state["threads"] <= before["threads"]


def test_the_extension_disabled(begun):
    window, before = begun
    window.ask(
        "run = __import__('bl_ext.user_default.lobefit', fromlist=['x']).operators.run\n"
        "bpy.ops.preferences.addon_disable(module='bl_ext.user_default.lobefit')\n"
        "result = run.current() is None"
    )
    threads = window.ask("import os; result = len(os.listdir('/proc/self/task'))")
    assert threads <= before["threads"]
    assert (
        window.ask("result = [m.name for m in bpy.data.materials if 'lobefit_record' in m]") == []
    )
    assert window.ask("result = hasattr(bpy.types, 'LOBEFIT_OT_import_measured')") is False
    window.ask("bpy.ops.preferences.addon_enable(module='bl_ext.user_default.lobefit')")


def test_quitting(begun):
    window, _before = begun
    window.tell("bpy.ops.wm.quit_blender()")
    end = time.monotonic() + PATIENCE
    while window.is_alive() and time.monotonic() < end:
        time.sleep(0.1)
    assert not window.is_alive()
    assert "crash" not in window.log() and "Error" not in window.log()
