"""The extension as a whole: its coming and going, its panel, a module that is missing."""

import importlib
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import lobefit
import lobefit._native
import pytest
from recording_layout import RecordingLayout, drawn, material_tab

OPERATORS = [
    "add_asset_library",
    "add_live",
    "cancel_fit",
    "copy_diagnostics",
    "draw_chart",
    "edit_parameters",
    "export_measured",
    "find_normals",
    "fit",
    "import_measured",
    "make_classic",
    "make_library",
    "open_manual",
    "open_picture",
    "preview",
    "relink",
    "render_preview",
    "reset_parameters",
    "restore_scene",
    "set_kind",
    "simplify_scene",
    "take_lights",
    "two_lights",
    "update_materials",
]

# What costs too much to be loaded as Blender starts, besides what makes nodes. Some of it `bpy` has
# loaded already, or other add-ons have, so it is forgotten first.
HEAVY = ["numpy", "lobefit", "tempfile", "subprocess", "tomllib", "hashlib", "multiprocessing"]
START = """
import sys
import bpy

class Refusing:
    def find_spec(self, name, path, target=None):
        if name.partition(".")[0] in sys.argv[2:] or name.startswith("started_addon.nodes."):
            raise AssertionError(f"{name} was loaded")

for name in [name for name in sys.modules if name.partition(".")[0] in sys.argv[2:]]:
    del sys.modules[name]
sys.meta_path.insert(0, Refusing())
sys.path.insert(0, sys.argv[1])
import started_addon
started_addon.register()
print("registered")
started_addon.unregister()
"""


@pytest.fixture
def native(addon):
    """The module that looks for the compiled one, without what it remembers."""
    addon.native.problem.cache_clear()
    yield addon.native
    addon.native.problem.cache_clear()


def drawing_functions():
    """The functions that each of Blender's menus, headers and panels was given by add-ons."""
    for name in dir(bpy.types):
        draw = getattr(getattr(bpy.types, name), "draw", None)
        yield from getattr(draw, "_draw_funcs", [])


def ours(addon):
    """All that Blender knows of the extension, by where it is kept."""

    def of_us(functions):
        return sorted(f"{f.__module__}.{f.__qualname__}" for f in functions if _is_of(addon, f))

    handlers = (getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers))
    keymaps = bpy.context.window_manager.keyconfigs.addon.keymaps
    owners = (bpy.types.WindowManager, bpy.types.Scene, bpy.types.Material, bpy.types.Object)
    return {
        "types": [name for name in dir(bpy.types) if name.startswith("LOBEFIT_")],
        "operators": dir(bpy.ops.lobefit),
        "drawn": of_us(drawing_functions()),
        "handlers": of_us(f for found in handlers if isinstance(found, list) for f in found),
        "keys": [item.idname for keymap in keymaps for item in keymap.keymap_items],
        "properties": [name for owner in owners for name in dir(owner) if "lobefit" in name],
    }


def _is_of(addon, function):
    return (function.__module__ or "").startswith(addon.__name__)


def test_registering_again_leaves_nothing(addon):
    before = ours(addon)
    keys = before["keys"]
    assert before["operators"] == OPERATORS and before["drawn"]
    nothing = {name: [] for name in before} | {"keys": keys}
    for _ in range(10):
        addon.unregister()
        assert ours(addon) == nothing
        addon.register()
    assert ours(addon) == before
    assert not any("lobefit" in key for key in keys) and not before["handlers"]


def test_enabling_again_leaves_nothing(addon):
    before = ours(addon)
    for _ in range(3):
        bpy.ops.preferences.addon_disable(module=addon.__name__)
        assert ours(addon) == {name: [] for name in before} | {"keys": before["keys"]}
        bpy.ops.preferences.addon_enable(module=addon.__name__)
    assert ours(addon) == before


def test_registering_loads_nothing_heavy(addon, tmp_path):
    shutil.copytree(Path(addon.__file__).parent, tmp_path / "started_addon")
    command = [sys.executable, "-c", START, str(tmp_path), *HEAVY]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "registered" in answer.stdout.splitlines(), answer.stderr


def test_unregister_ends_a_fit(addon, measured_file):
    run = addon.operators.run
    batch = importlib.import_module(f"{addon.__name__}.jobs").Batch([measured_file], {})
    batch.advance(0.0)
    run._current = run.Run(bpy.context, batch)
    try:
        assert material_tab().operators == ["cancel_fit"]
        assert not bpy.ops.lobefit.import_measured.poll()
    finally:
        addon.unregister()
        addon.register()
    assert run.current() is None


def test_panel_without_a_material(addon):
    layout = material_tab()
    assert layout.operators == ["import_measured", "make_classic"]
    assert "No material is selected" in " ".join(layout.texts)


def test_panel_with_another_material(addon):
    layout = material_tab(material=bpy.data.materials.new("plain"))
    assert layout.operators == ["import_measured", "make_classic"]


class _Executed(SimpleNamespace):
    """Stands in for an operator and its context: Blender without a window has no clipboard."""

    def report(self, _kind, _text):
        pass


@pytest.fixture
def copied(addon):
    """What Copy Diagnostics copies."""

    def copy():
        context = SimpleNamespace(window_manager=SimpleNamespace(clipboard=""))
        operator = addon.preferences.LOBEFIT_OT_copy_diagnostics
        assert operator.execute(_Executed(), context) == {"FINISHED"}
        return context.window_manager.clipboard

    return copy


def test_preferences_copy_diagnostics(addon, copied):
    layout = drawn(addon.preferences.LOBEFIT_AP_preferences)
    assert layout.operators == ["open_manual", "copy_diagnostics"]
    assert layout.properties == ["kind", "threads", "measured_folder", "library_folder"]
    text = copied()
    assert bpy.app.version_string in text and lobefit._native.build_id in text
    assert text.count("passed") == 3 and "FAILED" not in text


def test_diagnostics_without_the_compiled_module(native, copied, monkeypatch):
    monkeypatch.setitem(sys.modules, "lobefit", None)
    text = copied()
    assert native.problem() in text
    assert bpy.app.version_string in text and native.own_identity()["version"] in text


def test_panel_of_the_scene(addon, material):
    panel = bpy.types.LOBEFIT_PT_simplify_scene
    assert drawn(panel).operators == ["simplify_scene"]
    # Without its file the record is not given closures, which would take time.
    record = lobefit.Record.from_json(material["lobefit_record"])
    record.source["path"], record.closures = None, []
    addon.nodes.material.fill_material(material, record, "live")
    bpy.ops.mesh.primitive_uv_sphere_add()
    bpy.context.object.data.materials.append(material)
    bpy.ops.object.camera_add(location=(0, 0, 9), rotation=(0, 0, 0))
    bpy.context.scene.camera = bpy.context.object
    bpy.ops.lobefit.simplify_scene()
    layout = drawn(panel)
    assert layout.operators == ["simplify_scene", "restore_scene"]
    assert layout.properties == ["tolerance", "frames", "diffuse_bounces", "timed"]
    assert f"{material.name}: live > principled" in layout.texts


def test_panel_of_the_shader_editor(addon, measured_file):
    panel, tree = bpy.types.LOBEFIT_PT_shader_editor, bpy.data.materials.new("plain").node_tree
    tree = tree or bpy.data.node_groups.new("tree", "ShaderNodeTree")
    node = addon.nodes.material.add_to_tree(tree, lobefit.fit(measured_file), (0, 0))
    empty = drawn(panel, active_node=None)
    assert empty.operators == ["import_measured", "add_live"] and not empty.texts
    layout = drawn(panel, active_node=node)
    assert layout.operators == empty.operators
    assert "% of the reflected light" in " ".join(layout.texts)


def test_every_panel_and_menu_entry_is_drawn(addon):
    """Those of the extension, so that none is forgotten in this file."""
    panels = [name for name in dir(bpy.types) if name.startswith("LOBEFIT_PT_")]
    known = ("measured_brdf", "import_measured", "simplify_scene", "shader_editor")
    assert panels == sorted(f"LOBEFIT_PT_{name}" for name in known)
    space = SimpleNamespace(
        type="NODE_EDITOR", tree_type="ShaderNodeTree", shader_type="OBJECT", params=None
    )
    for function in filter(lambda function: _is_of(addon, function), drawing_functions()):
        layout = RecordingLayout()
        function(SimpleNamespace(layout=layout), SimpleNamespace(space_data=space))
        assert layout.operators or function.__name__ == "_draw_status"


def test_without_the_compiled_module(native, monkeypatch, measured_file):
    monkeypatch.setitem(sys.modules, "lobefit", None)
    assert "is not installed" in native.problem()
    assert native.problem() in " ".join(material_tab().texts)
    with pytest.raises(RuntimeError, match="is not installed"):
        bpy.ops.lobefit.import_measured(filepath=measured_file)
    assert not bpy.data.materials


def test_command(native, addon, monkeypatch, measured_file, capsys):
    assert addon.cli._run(["info", measured_file]) == 0
    assert "MERL" in capsys.readouterr().out
    native.problem.cache_clear()
    monkeypatch.setitem(sys.modules, "lobefit", None)
    assert addon.cli._run(["info", measured_file]) == 2
    assert native.problem() in capsys.readouterr().err


def test_with_a_compiled_module_that_does_not_load(native, monkeypatch):
    def refuse(name):
        raise ImportError("version `GLIBC_9.9' not found\n")

    monkeypatch.setattr(native.importlib, "import_module", refuse)
    assert "GLIBC_9.9" in native.problem()
    assert "\n" not in native.problem()


@pytest.mark.parametrize(
    ("owner", "name"), [(lobefit, "__version__"), (lobefit._native, "build_id")]
)
def test_after_an_update_without_a_restart(native, monkeypatch, owner, name):
    assert native.problem() == ""
    native.problem.cache_clear()
    monkeypatch.setattr(owner, name, "0.0.1")
    assert "restart Blender" in native.problem()
