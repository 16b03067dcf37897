"""The extension as a whole: its coming and going, its panel, a module that is missing."""

import sys
from types import SimpleNamespace

import bpy
import lobefit
import lobefit._native
import pytest
from recording_layout import drawn, material_tab

OPERATORS = [
    "add_asset_library",
    "cancel_fit",
    "copy_diagnostics",
    "draw_chart",
    "edit_parameters",
    "export_measured",
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


@pytest.fixture
def native(addon):
    """The module that looks for the compiled one, without what it remembers."""
    addon.native.problem.cache_clear()
    yield addon.native
    addon.native.problem.cache_clear()


def test_registering_again_leaves_nothing(addon):
    def ours():
        names = ("MT_file_import", "MT_file_export")
        drawn = [getattr(bpy.types, f"TOPBAR_{name}") for name in names]
        drawn += [bpy.types.STATUSBAR_HT_header, bpy.types.ASSETBROWSER_MT_catalog]
        functions = [f.__module__ for menu in drawn for f in menu.draw._draw_funcs]
        types = [name for name in dir(bpy.types) if name.startswith("LOBEFIT_")]
        return types, [name for name in functions if name.startswith(addon.__name__)]

    before = ours()
    for _ in range(10):
        addon.unregister()
        assert ours() == ([], [])
        assert dir(bpy.ops.lobefit) == []
        addon.register()
    assert ours() == before
    assert sorted(dir(bpy.ops.lobefit)) == OPERATORS


def test_unregister_ends_a_fit(addon, measured_file):
    run = addon.operators.run
    batch = addon.jobs.Batch([measured_file], {})
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
