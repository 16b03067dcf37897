"""Importing measured files, and what the materials are worth without the extension."""

import json
import os
import re
import struct
import subprocess
import sys
from pathlib import Path

import bpy
import lobefit
import numpy as np
import pytest
import rgl_file

RENDER = """
import sys
import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
scene = bpy.context.scene
scene.cycles.samples = 4
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = sys.argv[2]
bpy.ops.render.render(write_still=True)
"""


def data_blocks():
    """How many there are of every kind."""
    collections = (getattr(bpy.data, name) for name in dir(bpy.data))
    return [len(c) for c in collections if isinstance(c, bpy.types.bpy_prop_collection)]


def test_import_makes_a_material(addon, measured_file):
    assert bpy.ops.lobefit.import_measured(filepath=measured_file) == {"FINISHED"}
    (material,) = bpy.data.materials
    record = lobefit.Record.from_json(material["lobefit_record"])
    assert record.source["path"] == measured_file
    assert record.norm == "cosine-l1"
    outputs = [node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL"]
    assert sorted(node.target for node in outputs) == ["ALL", "CYCLES"]
    assert [node.target for node in outputs if node.is_active_output] == ["ALL"]
    assert material.use_fake_user


@pytest.mark.parametrize("phi_i", [(0.0,), (-1.6, -0.8, 0.0)], ids=["isotropic", "anisotropic"])
def test_an_rgl_file_ends_in_a_material(addon, tmp_path, phi_i):
    fields = rgl_file.glossy_fields(phi_i, elevations=4, size=16)
    path = rgl_file.write_tensor_file(tmp_path / "glossy.bsdf", fields)
    assert bpy.ops.lobefit.import_measured(filepath=str(path)) == {"FINISHED"}
    (material,) = bpy.data.materials
    record = lobefit.Record.from_json(material["lobefit_record"])
    assert record.source["format"] == "RGL"
    assert any("anisotropic" in warning for warning in record.warnings) == (len(phi_i) > 1)
    assert any(node.type == "GROUP" for node in material.node_tree.nodes)


def test_both_formats_can_be_chosen_and_dropped(addon):
    (handler,) = (h for h in bpy.types.FileHandler.__subclasses__() if "measured" in h.bl_idname)
    assert handler.bl_file_extensions == ".binary;.bsdf"
    operator = bpy.ops.lobefit.import_measured.get_rna_type()
    assert operator.properties["filter_glob"].default == "*.binary;*.bsdf"


def test_import_into_the_active_object(addon, measured_file):
    cube = bpy.data.objects.new("cube", bpy.data.meshes.new("cube"))
    bpy.context.scene.collection.objects.link(cube)
    bpy.context.view_layer.objects.active = cube
    bpy.ops.lobefit.import_measured(filepath=measured_file, model="modified-phong", fresnel=False)
    record = json.loads(cube.active_material["lobefit_record"])
    assert record["model"] == "modified-phong"
    assert record["parameters"]["ior"] is None
    assert not cube.active_material.use_fake_user


def test_several_files_of_which_one_is_bad(addon, measured_file, capfd):
    folder = Path(measured_file).parent
    (folder / "bad.binary").write_bytes(b"no measurement")
    names = [{"name": name} for name in ("bad.binary", Path(measured_file).name)]
    assert bpy.ops.lobefit.import_measured(directory=str(folder), files=names) == {"FINISHED"}
    assert len(bpy.data.materials) == 1
    told = capfd.readouterr()[0]
    assert "bad.binary: expected" in told
    assert "% off, fitted in" in told and "1 of 2 files fitted" in told


VALUES = 3 * 90 * 90 * 180
BAD_FILES = {
    "empty": b"",
    "text": b"this is no measurement" * 100,
    "dimensions": struct.pack("<3i", 90, 90, 7) + bytes(8 * 3 * 90 * 90 * 7),
    "permuted": struct.pack("<3i", 90, 180, 90) + bytes(8 * VALUES),
    "negative": struct.pack("<3i", -90, -90, 180) + bytes(8 * VALUES),
    "big_endian": struct.pack(">3i", 90, 90, 180) + bytes(8 * VALUES),
    "truncated": struct.pack("<3i", 90, 90, 180) + bytes(1000),
    "too_long": struct.pack("<3i", 90, 90, 180) + bytes(8 * VALUES + 8),
    "invalid": struct.pack("<3i", 90, 90, 180) + struct.pack("<d", -1.0) * VALUES,
    "nan": struct.pack("<3i", 90, 90, 180) + struct.pack("<d", float("nan")) * VALUES,
    "of_zemax": b"Source  Measured\r\nSymmetry  PlaneSymmetrical\r\n",
    "cut_tensor_file": b"tensor_file\0\1\0\x0b\0\0\0\x07\0",
}


@pytest.mark.parametrize("kind", [*BAD_FILES, "missing", "folder", "suffix"])
def test_bad_input_changes_nothing(addon, tmp_path, kind):
    path = tmp_path / f"{kind}.binary"
    if kind in BAD_FILES:
        path.write_bytes(BAD_FILES[kind])
    elif kind == "folder":
        path.mkdir()
    elif kind == "suffix":
        path = tmp_path / "table.brdf"
        path.write_bytes(b"something")
    with pytest.raises(lobefit.InputError) as native:
        lobefit.read(str(path))
    before = data_blocks()
    with pytest.raises(RuntimeError) as error:
        bpy.ops.lobefit.import_measured(filepath=str(path))
    assert str(native.value) in str(error.value)
    assert data_blocks() == before


def test_no_file_chosen(addon):
    with pytest.raises(RuntimeError, match="none chosen"):
        bpy.ops.lobefit.import_measured()


def test_fit_anew_keeps_the_material(addon, material):
    material["note"] = "kept"
    mesh = bpy.data.meshes.new("user")
    mesh.materials.append(material)
    name = material.name
    with bpy.context.temp_override(material=material):
        assert bpy.ops.lobefit.fit(model="modified-blinn-phong") == {"FINISHED"}
    (fitted,) = bpy.data.materials
    assert mesh.materials[0] == fitted == material and fitted.name == name
    assert fitted["note"] == "kept"
    assert json.loads(fitted["lobefit_record"])["model"] == "modified-blinn-phong"


def test_fit_anew_without_the_file(addon, material):
    record = json.loads(material["lobefit_record"])
    record["source"]["path"] = "/nowhere/gone.binary"
    material["lobefit_record"] = json.dumps(record)
    with (
        bpy.context.temp_override(material=material),
        pytest.raises(RuntimeError, match="gone"),
    ):
        bpy.ops.lobefit.fit()
    assert list(bpy.data.materials) == [material]


def test_fit_needs_a_measured_material(addon):
    with bpy.context.temp_override(material=bpy.data.materials.new("plain")):
        assert not bpy.ops.lobefit.fit.poll()
        assert not bpy.ops.lobefit.preview.poll()
    assert not bpy.ops.lobefit.cancel_fit.poll()


def read_exr(path):
    image = bpy.data.images.load(str(path))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels


def test_renders_the_same_without_the_extension(addon, two_lights, material, tmp_path):
    two_lights.two_lights_scene(material, 48)
    blend, script = tmp_path / "material.blend", tmp_path / "render.py"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    script.write_text(RENDER)
    (tmp_path / "profile").mkdir()
    arguments = [sys.executable, "-P", str(script), str(blend), str(tmp_path / "without.exr")]
    factory = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "profile")}
    subprocess.run(arguments, env=factory, check=True, capture_output=True, timeout=300)
    sys.argv[1:], arguments = [str(blend), str(tmp_path / "with.exr")], sys.argv[1:]
    try:
        exec(RENDER, {})
    finally:
        sys.argv[1:] = arguments
    with_extension = read_exr(tmp_path / "with.exr")
    assert with_extension.max() > 0.01
    assert np.array_equal(with_extension, read_exr(tmp_path / "without.exr"))


@pytest.fixture
def on_a_cube(material):
    """An object with the material, and the values of its best-fit Principled BSDF."""
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.materials.append(material)
    return json.loads(material["lobefit_record"])["principled"]


def test_gltf_carries_the_principled_values(on_a_cube, tmp_path):
    path = tmp_path / "cube.gltf"
    bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLTF_SEPARATE")
    (material,) = json.loads(path.read_text())["materials"]
    surface = material["pbrMetallicRoughness"]
    # glTF leaves out factors that are 1, the default.
    assert surface.get("metallicFactor", 1.0) == pytest.approx(on_a_cube["metallic"], abs=1e-5)
    assert surface.get("roughnessFactor", 1.0) == pytest.approx(on_a_cube["roughness"], abs=1e-5)
    color = surface.get("baseColorFactor", [1.0] * 4)
    assert color[:3] == pytest.approx(on_a_cube["base_color"], abs=1e-5)


def test_usd_carries_the_principled_values(on_a_cube, tmp_path):
    path = tmp_path / "cube.usda"
    bpy.ops.wm.usd_export(filepath=str(path))
    found = dict(re.findall(r"(?:float|color3f) inputs:(\w+) = (.+)", path.read_text()))
    for name in ("metallic", "roughness"):
        assert float(found[name]) == pytest.approx(on_a_cube[name], abs=1e-5)
    color = [float(number) for number in found["diffuseColor"].strip("()").split(",")]
    assert color == pytest.approx(on_a_cube["base_color"], abs=1e-5)
