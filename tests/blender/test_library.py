"""Asset libraries made in Blender, and what their materials are worth in another file."""

import importlib
import json
import os
import time
from pathlib import Path

import bpy
import lobefit
import numpy as np
import pytest
from conftest import EXTENSION
from lobefit import picture, preview
from lobefit.command_line import main

PATIENCE = 60  # seconds after which what should have happened never will


@pytest.fixture(scope="module")
def record(measured_file):
    return lobefit.closures(measured_file, count=1, norm="cosine-l1")


@pytest.fixture
def folder(tmp_path, record) -> Path:
    """A folder with a record in a sub-folder."""
    (tmp_path / "metals" / "Polished").mkdir(parents=True)
    record.save(tmp_path / "metals" / "Polished" / "nickel.json")
    return tmp_path / "metals"


@pytest.fixture
def library(addon, folder) -> Path:
    """A library that Blender made of the folder, in it and named like it."""
    assert bpy.ops.lobefit.make_library(directory=str(folder), count=1) == {"FINISHED"}
    return folder / "metals.blend"


@pytest.fixture
def no_libraries():
    """The asset libraries of the preferences, none at first and at the end."""
    libraries = bpy.context.preferences.filepaths.asset_libraries

    def clear():
        while len(libraries):
            bpy.ops.preferences.asset_library_remove(index=0)

    clear()
    yield libraries
    clear()


def load(path: Path, link: bool) -> bpy.types.Material:
    """The one asset of a library, in the open file."""
    with bpy.data.libraries.load(str(path), link=link, assets_only=True) as (source, target):
        target.materials = source.materials
    (material,) = target.materials
    return material


def radiance_under_the_lights_of_a_thumbnail(two_lights, material, size):
    scene = two_lights.two_lights_scene(material, size)
    scene.world = two_lights.uniform_world("white", preview.WORLD)
    scene.cycles.samples = 64
    return two_lights.radiance(scene)


def test_a_library_of_a_folder(addon, library, record, no_libraries):
    assert sorted(os.listdir(library.parent)) == [
        "Polished",
        "blender_assets.cats.txt",
        "metals.blend",
        "metals.records",
    ]
    material = load(library, link=False)
    embedded = lobefit.Record.from_json(material["lobefit_record"])
    assert embedded.source["path"] == "nickel.binary"
    assert embedded.source["sha256"] == record.source["sha256"]
    catalogues = (library.parent / "blender_assets.cats.txt").read_text()
    assert f"{material.asset_data.catalog_id}:Polished:Polished" in catalogues
    assert not len(no_libraries)
    # As the file browser gives a folder of which no file was chosen.
    (library.parent / "materials.csv").write_text("file,name\nPolished/nickel,Renamed\n")
    chosen = {"directory": f"{library.parent}/", "filepath": f"{library.parent}/"}
    bpy.ops.lobefit.make_library(files=[{"name": ""}], count=1, **chosen)
    assert load(library, link=False).name == "Renamed"


def test_options_reach_the_command(addon, folder, measured_file, tmp_path):
    place = tmp_path / "other.blend"
    (folder / "bad.json").write_text("{}")
    names = [{"name": "bad.json"}, {"name": "Polished/nickel.json"}]
    options = {"files": names, "library": str(place), "kind": "principled"}
    assert bpy.ops.lobefit.make_library(directory=str(folder), **options) == {"FINISHED"}
    assert load(place, link=False)["lobefit_kind"] == "principled"
    options = {"model": "modified-phong", "norm": "l1", "fresnel": False, "kind": "live"}
    assert bpy.ops.lobefit.make_library(filepath=measured_file, library=str(place), **options) == {
        "FINISHED"
    }
    material = load(place, link=False)
    fitted = json.loads(material["lobefit_record"])
    assert (fitted["model"], fitted["norm"]) == ("modified-phong", "l1")
    assert fitted["parameters"]["ior"] is None


def test_what_cannot_be_made_is_said(addon, folder, tmp_path):
    with pytest.raises(RuntimeError, match="none chosen"):
        bpy.ops.lobefit.make_library()
    with pytest.raises(RuntimeError, match="its folder does not exist"):
        bpy.ops.lobefit.make_library(directory=str(folder), library=str(tmp_path / "x" / "l.blend"))
    (folder / "materials.csv").write_text("file,colour\n")
    with pytest.raises(RuntimeError, match="found 'colour'"):
        bpy.ops.lobefit.make_library(directory=str(folder), count=1)
    assert sorted(os.listdir(folder)) == ["Polished", "materials.csv"]


@pytest.mark.parametrize("link", [False, True])
def test_a_material_of_a_library_in_another_file(two_lights, library, link):
    material = load(library, link)
    (group,) = [n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeGroup"]
    assert {socket.name for socket in group.inputs} == {"Tint", "Strength", "Normal"}
    assert any(n.bl_idname == "ShaderNodeBsdfAnisotropic" for n in group.node_tree.nodes)
    assert (material.library is not None) == link
    rendered = radiance_under_the_lights_of_a_thumbnail(two_lights, material, 128)
    (closures,) = json.loads(material["lobefit_record"])["closures"]
    shown = preview.thumbnail(("closures", closures), 128)
    pixels = np.empty(256 * 256 * 4, np.float32)
    material.preview.image_pixels_float.foreach_get(pixels)
    asset = pixels.reshape(256, 256, 4)[::-1]
    # The asset's picture, the picture of 128 pixels, and that by Cycles have the same mean colour.
    exposed = preview.exposed(rendered)
    inside = shown[..., 3] == 1
    mean = picture.encode(exposed)[inside].mean(0)
    # The noise of 64 samples is less than a hundredth, as are the bytes that Blender keeps.
    assert np.abs(shown[inside][:, :3].mean(0) - mean).max() < 0.015
    assert np.abs(asset[asset[..., 3] == 1][:, :3].mean(0) - mean).max() < 0.02


def test_one_click_adds_a_folder_to_the_asset_libraries(addon, folder, no_libraries):
    options = {"directory": str(folder), "count": 1, "add_to_preferences": True}
    assert bpy.ops.lobefit.make_library(**options) == {"FINISHED"}
    assert [Path(item.path) for item in no_libraries] == [folder]
    # Nor does it matter how the folder is written.
    assert bpy.ops.lobefit.add_asset_library(directory=f"{folder}/../metals/") == {"FINISHED"}
    assert len(no_libraries) == 1
    with pytest.raises(RuntimeError, match="Expected the folder of a library"):
        bpy.ops.lobefit.add_asset_library(directory=str(folder / "none"))


def test_an_asset_is_fitted_anew_from_its_file(addon, library, measured_file, tmp_path):
    material = load(library, link=False)
    with bpy.context.temp_override(material=material):
        with pytest.raises(RuntimeError, match=r"nickel\.binary"):
            bpy.ops.lobefit.fit(kind="live")
        assert bpy.ops.lobefit.fit(filepath=measured_file, kind="live") == {"FINISHED"}
    assert json.loads(material["lobefit_record"])["source"]["path"] == measured_file
    # A file beside the .blend is found by its name.
    material = load(library, link=False)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    (tmp_path / "nickel.binary").symlink_to(measured_file)
    with bpy.context.temp_override(material=material):
        assert bpy.ops.lobefit.fit(kind="live") == {"FINISHED"}
    assert json.loads(material["lobefit_record"])["source"]["path"] == str(
        tmp_path / "nickel.binary"
    )


def test_export_of_the_open_file(addon, material, tmp_path):
    material.name = "not saved"
    out = tmp_path / "out"
    assert bpy.ops.lobefit.export_measured(directory=str(out), gltf=True) == {"FINISHED"}
    names = ["not saved.glb", "not saved.json", "parameters.csv"]
    assert sorted(os.listdir(out)) == names
    exported = lobefit.Record.load(out / "not saved.json")
    assert exported.to_json() == material["lobefit_record"]
    nothing = {kind: False for kind in ("records", "csv")}
    with pytest.raises(RuntimeError, match="found none chosen"):
        bpy.ops.lobefit.export_measured(directory=str(out), **nothing)
    (tmp_path / "file").write_text("")
    with pytest.raises(RuntimeError, match="expected a folder, found a file"):
        bpy.ops.lobefit.export_measured(directory=str(tmp_path / "file"))
    bpy.data.materials.remove(material)
    assert not bpy.ops.lobefit.export_measured.poll()


def drawn(menu):
    """The texts and operators of our entries in a menu of Blender's."""
    shown = []

    class Layout:
        def operator(self, idname, text="", icon="NONE"):
            shown.append((idname, text))
            return type("Options", (), {})()

        def separator(self):
            pass

    for entry in menu.draw._draw_funcs:
        if entry.__module__.startswith(EXTENSION):
            entry(type("Menu", (), {"layout": Layout()})(), bpy.context)
    return shown


def test_menus(addon, library, no_libraries):
    assert ("lobefit.make_library", "Measured BRDF Library") in drawn(
        bpy.types.TOPBAR_MT_file_import
    )
    assert drawn(bpy.types.TOPBAR_MT_file_export) == [("lobefit.export_measured", "Measured BRDFs")]
    make, add = drawn(bpy.types.ASSETBROWSER_MT_catalog)
    assert make[0] == "lobefit.make_library"
    assert add == ("lobefit.add_asset_library", "Add metals to Asset Libraries")
    bpy.ops.lobefit.add_asset_library(directory=str(library.parent))
    assert drawn(bpy.types.ASSETBROWSER_MT_catalog) == [make]


@pytest.fixture
def child(addon, folder, measured_file):
    """A library of many tables under way in another Blender."""
    for index in range(8):
        (folder / f"{index}.binary").symlink_to(measured_file)
    module = importlib.import_module(f"{EXTENSION}.child")
    place = folder.parent / "lib.blend"
    work = module.Child(["library", str(folder), "-o", str(place), "--json", "--jobs", "2"])
    end = time.monotonic() + PATIENCE
    while not any(".binary" in result.get("file", "") for result in work.results):
        assert not work.advance(0.1) and time.monotonic() < end
    yield work
    work.stop()


def test_cancelling_ends_the_other_blender(child, tmp_path):
    assert 0 < child.progress < 1 and child.text
    process = child._process.pid
    child.stop()
    assert child.done and child.problems == ["interrupted"]
    assert not Path(f"/proc/{process}").exists()
    assert not list(tmp_path.glob(".*")) and not (tmp_path / "lib.blend").exists()
    # What was found so far is kept.
    assert list((tmp_path / "lib.records").glob("*.json"))


def test_another_blender_that_is_lost_is_noticed(child):
    child._process.kill()
    end = time.monotonic() + PATIENCE
    while not child.advance(0.1):
        assert time.monotonic() < end
    assert child.problems == ["The Blender that was at work ended early (exit code -9)."]


def test_a_command_leaves_the_preferences_alone(addon, folder, tmp_path):
    # Blender deletes the modules of all extensions that are not enabled, as none is where it reads
    # its factory settings; this Blender and the one that a command runs in have the same ones.
    record = str(folder / "Polished" / "nickel.json")
    for words in (
        ["material", record, "--closures", "1", "-o", str(tmp_path / "a.blend")],
        ["library", record, "--closures", "1", "-o", str(tmp_path / "b.blend")],
        ["export", str(tmp_path / "a.blend"), "--usd", "-o", str(tmp_path / "out")],
    ):
        assert main(words) == 0
        assert addon.__name__ in bpy.context.preferences.addons
        assert Path(lobefit.__file__).is_file()
