"""What earlier versions have saved, opened, appended, linked and overridden in this release.

The files are blend_files/saved/*.blend, written by Blender 4.2 (make_saved.py beside them), each
with the pictures that 4.2 rendered of its materials. A file is data: nothing in it is executed.
"""

import importlib
import json
from collections.abc import Callable
from pathlib import Path

import bpy
import lobefit
import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "blend_files" / "saved"
FILES = sorted(FOLDER.glob("*.blend"))
NEWEST = [FOLDER / f"{name}.blend" for name in ("material-1", "classic-1")]
SIZE = 24  # as in make_saved.py
# The suns are points and a pixel is one ray, so that nothing is left to chance. Until Blender 5.0
# single precision shows, 2e-5 of the brightest pixel; 5.2 shows Beckmann closures 1.6e-4 off.
SAME = 5e-4


@pytest.fixture(params=FILES, ids=lambda file: file.stem)
def file(request) -> Path:
    return request.param


def items_of(material: bpy.types.Material) -> dict:
    """The properties of a material; where the lines of its record break counts for nothing."""
    return dict(material.items()) | {"lobefit_record": json.loads(material["lobefit_record"])}


def pictures(file: Path) -> dict[str, np.ndarray]:
    """What Blender 4.2 rendered of each material of a file, (SIZE, SIZE, 3)."""
    with np.load(file.with_suffix(".npz"), allow_pickle=False) as stored:
        return dict(stored)


def load(file: Path, link: bool) -> list[bpy.types.Material]:
    with bpy.data.libraries.load(str(file), link=link) as (source, target):
        target.materials = source.materials
    return target.materials


def from_open(file: Path) -> list[bpy.types.Material]:
    assert bpy.ops.wm.open_mainfile(filepath=str(file), load_ui=False) == {"FINISHED"}
    return [material for material in bpy.data.materials if material.use_fake_user]


def overridden(file: Path) -> list[bpy.types.Material]:
    linked = load(file, link=True)
    local = [material.override_create(remap_local_usages=True) for material in linked]
    assert all(material.override_library and not material.library for material in local)
    return local


def scene_of(two_lights, file: Path) -> bpy.types.Scene:
    """The scene of the file where it is open, or the same made anew around its sphere."""
    if "Sphere" not in bpy.context.scene.objects:
        with bpy.data.libraries.load(str(file)) as (_, target):
            target.meshes = ["Sphere"]
        scene = two_lights.two_lights_scene(None, SIZE)
        scene.objects["Sphere"].data = target.meshes[0]
    return bpy.context.scene


@pytest.mark.parametrize(
    "way",
    [
        from_open,
        lambda file: load(file, link=False),
        lambda file: load(file, link=True),
        overridden,
    ],
    ids=["open", "append", "link", "override"],
)
def test_saved_materials_look_as_they_did(two_lights, file, way: Callable):
    expected = pictures(file)
    materials = {material.name: material for material in way(file)}
    assert sorted(materials) == sorted(expected)
    scene = scene_of(two_lights, file)
    for name, material in materials.items():
        scene.objects["Sphere"].data.materials[0] = material
        difference = np.abs(two_lights.render_pixels(scene) - expected[name])
        assert difference.max() < SAME * expected[name].max(), name


def test_an_object_of_a_saved_file_is_overridden(two_lights, file):
    with bpy.data.libraries.load(str(file), link=True) as (_, target):
        target.objects = ["Sphere"]
    (linked,) = target.objects
    scene = two_lights.two_lights_scene(None, SIZE)
    bpy.data.objects.remove(scene.objects["Sphere"])
    scene.collection.objects.link(linked)
    sphere = linked.override_create(remap_local_usages=True)
    (material,) = sphere.data.materials
    assert material.library and sphere.override_library
    expected = pictures(file)[material.name]
    difference = np.abs(two_lights.render_pixels(scene) - expected)
    assert difference.max() < SAME * expected.max()


def test_saved_records_are_read(file):
    materials = load(file, link=False)
    records = [json.loads(m["lobefit_record"]) for m in materials if "lobefit_record" in m]
    assert records or file.stem == "classic-1"
    for record in records:
        read = json.loads(lobefit.Record.from_json(json.dumps(record)).to_json())
        assert {key: read[key] for key in record} == record


def test_nothing_that_is_saved_can_be_executed(file):
    bpy.ops.wm.open_mainfile(filepath=str(file), load_ui=False)
    assert not bpy.data.texts and not bpy.data.libraries
    trees = [*bpy.data.node_groups, *(material.node_tree for material in bpy.data.materials)]
    owners = [*bpy.data.materials, *bpy.data.objects, *bpy.data.scenes, *trees]
    assert not any(owner.animation_data for owner in owners)
    assert not any(node.type == "SCRIPT" for tree in trees for node in tree.nodes)


@pytest.mark.skipif(
    bpy.app.version[:2] != (4, 2), reason="nodes that Blender 4.2 has saved get new sockets later"
)
@pytest.mark.parametrize("file", NEWEST, ids=lambda file: file.stem)
def test_the_newest_files_are_what_is_saved_now(addon, file):
    """Whoever changes what is saved adds a file, so that the one before stays tried."""
    tree_content = importlib.import_module(f"{addon.__name__}.swaps").tree_content
    for material in from_open(file):
        if material.name == "classic":
            (node,) = addon.operators.classic.classic_nodes(material)
            saved = tree_content(node.node_tree)
            bpy.data.node_groups.remove(node.node_tree)
            assert saved == tree_content(addon.nodes.classic.classic_group())
            continue
        record = lobefit.Record.from_json(material["lobefit_record"])
        kind, bounces = material["lobefit_kind"], bool(material["lobefit_diffuse_bounces"])
        built = addon.build_material(record, kind, "built", diffuse_bounces=bounces)
        assert tree_content(built.node_tree) == tree_content(material.node_tree)
        assert items_of(built) == items_of(material)
