"""Asset libraries on the command line: what is told of each file, and whatever ends on the way."""

import csv
import dataclasses
import json
import os
import resource
import struct
import uuid
from pathlib import Path

import numpy as np
import pytest
from commands import PATIENCE, await_that, finished, refuse, start
from lobefit import InputError, Record, _native, catalogues, closures, preview
from lobefit.catalogues import Catalogues
from lobefit.command_line import main
from lobefit.library import UNKNOWN, UNSORTED, items_of

MANY = 6


def library(*arguments) -> int:
    return main(["library", *map(str, arguments)])


def opened(path: Path) -> dict[str, object]:
    """The assets of a Blender file by their names."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(path))
    return {item.name: item for item in bpy.data.materials if item.asset_data}


def pixels_of(material) -> np.ndarray:
    """The picture of an asset from the top, (size, size, 4)."""
    columns, rows = material.preview.image_size
    pixels = np.empty(rows * columns * 4, np.float32)
    material.preview.image_pixels_float.foreach_get(pixels)
    return pixels.reshape(rows, columns, 4)[::-1]


def content(path: Path) -> dict[str, object]:
    """All of a library's assets that does not depend on how long it took."""

    def told(material):
        record = json.loads(material["lobefit_record"])
        kept = {key: record[key] for key in ("source", "parameters", "error", "principled")}
        data = material.asset_data
        return kept, data.catalog_id, data.description, pixels_of(material).tobytes()

    return {name: told(material) for name, material in opened(path).items()}


@pytest.fixture
def folder(tmp_path, table) -> Path:
    """A folder with a table in it and one in a sub-folder."""
    place = tmp_path / "measured"
    (place / "Metal" / "Polished").mkdir(parents=True)
    (place / "loose.binary").symlink_to(table)
    (place / "Metal" / "Polished" / "chrome.binary").symlink_to(table)
    return place


@pytest.fixture(scope="module")
def fitted(tmp_path_factory, table) -> Record:
    """The record of `table` with measured closures; its measurement is elsewhere."""
    record = closures(table, count=1, norm="cosine-l1")
    return dataclasses.replace(record, source=record.source | {"path": "/elsewhere/truth.binary"})


@pytest.fixture
def records(tmp_path, fitted) -> Path:
    """A folder of three records that were computed elsewhere."""
    place = tmp_path / "records"
    place.mkdir()
    for name in ("a", "b", "c"):
        fitted.save(place / f"{name}.json")
    return place


def test_a_folder_becomes_a_library(tmp_path, folder, capfd):
    (folder / "materials.csv").write_text(
        "file,name,catalogue,tags,author,licence,source\n"
        'loose.binary,Loose Paint,Paint: car,"red; glossy",A. Uthor,CC0,"Own work, 2026"\n'
    )
    out = tmp_path / "made" / "lib.blend"
    out.parent.mkdir()
    assert library(folder, "--closures", "1", "-o", out) == 0
    told, err = capfd.readouterr()
    assert err == ""
    assert "2 materials in Metal/Polished, Paint- car; opens in Blender 4.2 and later" in told
    assets = opened(out)
    assert sorted(assets) == ["Loose Paint", "chrome"]
    paint, chrome = assets["Loose Paint"].asset_data, assets["chrome"].asset_data
    assert (paint.author, paint.license) == ("A. Uthor", "CC0")
    assert [tag.name for tag in paint.tags] == ["red", "glossy"]
    assert "Own work, 2026" in paint.description and "loose.binary" in paint.description
    assert (chrome.author, chrome.license, len(chrome.tags)) == ("", UNKNOWN, 0)
    lines = (out.parent / catalogues.FILE).read_text().splitlines()
    assert f"{paint.catalog_id}:Paint- car:Paint- car" in lines
    assert f"{chrome.catalog_id}:Metal/Polished:Metal-Polished" in lines
    assert sorted(os.listdir(out.parent)) == [catalogues.FILE, "lib.blend", "lib.records"]
    for name, material in assets.items():
        record = Record.from_json(material["lobefit_record"])
        assert record.source["path"] == ("chrome.binary" if name == "chrome" else "loose.binary")
        assert str(tmp_path) not in out.read_text(errors="replace")
        drawn = preview.thumbnail(("closures", record.closures[0]))
        # Blender keeps a byte of each channel.
        assert np.abs(pixels_of(material) - drawn).max() <= 0.5 / 255 + 1e-4
        assert pixels_of(material)[..., :3].mean() > 0.1


def test_a_black_material_has_a_picture_that_is_not_black():
    darkest = {"base_color": [0.002] * 3, "metallic": 0.0, "roughness": 0.05, "ior": 1.0}
    light = {"base_color": [0.8] * 3, "metallic": 0.0, "roughness": 0.5, "ior": 1.5}
    dark, bright = (
        preview.thumbnail(("principled", surface | {"specular_tint": [1.0] * 3}))
        for surface in (darkest, light)
    )
    inside = dark[..., 3] == 1
    # An albedo of .002 alone would be .03 in sRGB, which looks black.
    assert 0.1 < dark[inside][:, :3].mean() < bright[inside][:, :3].mean() / 2
    assert dark[0, 0, 3] == 0
    # Pixels at the rim have the colour of the sphere, and not a share of the black around it.
    rim = (bright[..., 3] > 0.2) & (bright[..., 3] < 0.8)
    assert bright[rim][:, :3].min() > 0.3


def test_records_from_elsewhere(tmp_path, records, fitted, capfd):
    out = tmp_path / "lib.blend"
    assert library(records, "--closures", "1", "--json", "-o", out) == 0
    told, err = capfd.readouterr()
    assert err == ""
    lines = [json.loads(line) for line in told.splitlines()]
    shares = [line["progress"] for line in lines if "progress" in line]
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert [line["file"] for line in lines if "file" in line] == [
        str(records / name) for name in ("a.json", "b.json", "c.json")
    ]
    assert lines[-1]["library"] == str(out) and lines[-1]["materials"] == 3
    assert sorted(opened(out)) == ["truth", "truth.001", "truth.002"]


@pytest.mark.parametrize("kind", ["lobe", "live", "principled"])
def test_other_kinds(tmp_path, records, kind):
    out = tmp_path / "lib.blend"
    assert library(records / "a.json", "--kind", kind, "--closures", "1", "-o", out) == 0
    (material,) = opened(out).values()
    assert material["lobefit_kind"] == kind
    assert kind in material.asset_data.description
    assert pixels_of(material)[..., :3].mean() > 0.1


def test_a_bad_file_is_told_and_the_others_done(tmp_path, records, capfd):
    (records / "bad.json").write_text("{}")
    out = tmp_path / "lib.blend"
    assert library(records, "--closures", "1", "-o", out) == 1
    assert capfd.readouterr().err.startswith(f"lobefit: {records / 'bad.json'}: ")
    assert len(opened(out)) == 3


def test_nothing_is_written_where_all_is_bad(tmp_path, capfd):
    (tmp_path / "bad.json").write_text("{}")
    refuse(capfd, "library", tmp_path / "bad.json", "-o", tmp_path / "lib.blend")
    assert not (tmp_path / "lib.blend").exists()


def test_wrong_use(tmp_path, records, table, capfd):
    out = tmp_path / "lib.blend"
    (tmp_path / "empty").mkdir()
    assert "ends in .blend" in refuse(capfd, "library", records, "-o", tmp_path / "lib")
    assert "*.json, found none" in refuse(capfd, "library", tmp_path / "empty", "-o", out)
    assert "does not exist" in refuse(capfd, "library", records, "-o", tmp_path / "x" / "l.blend")
    both = [tmp_path / "a" / "t.binary", tmp_path / "b" / "t.binary"]
    for path in both:
        path.parent.mkdir()
        path.symlink_to(table)
    assert f"found {both[0]} and {both[1]}" in refuse(capfd, "library", *both, "-o", out)
    assert "--norm" in refuse(capfd, "library", records, "--norm", "l2", "-o", out)
    assert not out.exists()


def test_killed_half_way_and_resumed(tmp_path, table):
    names = [f"{index}.binary" for index in range(MANY)]
    measured = tmp_path / "measured"
    measured.mkdir()
    for name in names:
        (measured / name).symlink_to(table)
    out, whole = tmp_path / "lib.blend", tmp_path / "whole.blend"
    command = ["library", measured, "--kind", "principled", "--jobs", "2", "-o"]
    process = start(*command, out)
    await_that(lambda: finished(tmp_path / "lib.records"), process)
    process.kill()
    process.communicate(timeout=PATIENCE)
    before = finished(tmp_path / "lib.records")
    assert 0 < len(before) < MANY and not out.exists()
    again = start(*command, out)
    assert f"{len(before)} of {MANY} kept" in again.communicate(timeout=PATIENCE)[1]
    assert again.returncode == 0
    after = finished(tmp_path / "lib.records")
    assert len(after) == MANY and {name: after[name] for name in before} == before
    assert main([str(word) for word in [*command, whole]]) == 0
    assert content(out) == content(whole)


def test_closures_of_records_are_not_found_twice(tmp_path, records, table, capfd):
    record = Record.load(records / "a.json")
    bare = dataclasses.replace(record, closures=[], source=record.source | {"path": str(table)})
    bare.save(records / "a.json")
    command = [records, "--closures", "1", "-o", tmp_path / "lib.blend"]
    assert library(*command) == 0
    before = finished(tmp_path / "lib.records")
    assert library(*command) == 0
    assert "3 of 3 kept" in capfd.readouterr().err
    assert finished(tmp_path / "lib.records") == before
    # Another fit is another record.
    dataclasses.replace(bare, norm="l1").save(records / "a.json")
    assert library(*command) == 0
    assert "2 of 3 kept" in capfd.readouterr().err


# How much of a library there is space for; Blender itself does not notice that its end is missing.
@pytest.mark.parametrize("share", [0.5, 0.95])
def test_a_full_disk_leaves_the_old_library(tmp_path, records, share):
    out = tmp_path / "lib.blend"
    command = [records, "--closures", "1", "-o", out]
    assert library(*command) == 0
    old = out.read_bytes()
    limit = (int(share * len(old)),) * 2
    assert limit[0] > max(path.stat().st_size for path in records.iterdir())
    process = start(
        "library", *command, before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    )
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    kept, problem = err.splitlines()
    assert "3 of 3 kept" in kept
    assert problem.startswith(f"lobefit: {out}: cannot be written, ")
    assert out.read_bytes() == old
    assert sorted(os.listdir(tmp_path)) == [catalogues.FILE, "lib.blend", "lib.records", "records"]
    assert library(*command) == 0
    assert len(opened(out)) == 3


def test_what_was_written_is_looked_at(tmp_path, records, capfd, monkeypatch):
    from lobefit_addon import assets

    out = tmp_path / "lib.blend"
    out.write_bytes(b"old")
    monkeypatch.setattr(assets, "set_picture", lambda material, pixels: None)
    assert library(records, "--closures", "1", "-o", out) == 2
    assert "found it lost" in capfd.readouterr().err
    assert out.read_bytes() == b"old"
    assert not (tmp_path / catalogues.FILE).exists()


GOOD = "file,name\nloose.binary,Loose\n"
FAULTS = {
    "not text": (b"file,name\n\xff\xfe,x\n", "in UTF-8"),
    "no column file": ("name\nLoose\n", "a column 'file', found none"),
    "empty": ("", "a column 'file', found none"),
    "unknown column": ("file,colour\nloose.binary,red\n", "found 'colour'"),
    "semicolons": ("file;name\nloose.binary;x\n", "found 'file;name'"),
    "column twice": ("file,licence,License\nloose.binary,a,b\n", "'licence' twice"),
    "too few fields": ("file,name\nloose.binary\n", "line 2: expected 2 fields, found 1"),
    "too many fields": (GOOD + "\nloose.binary,a,b\n", "line 4: expected 2 fields, found 3"),
    "no such file": (GOOD + "gone.binary,x\n", "line 3: expected a file"),
    "no file named": (GOOD + ",x\n", "line 3: expected a file"),
    "file twice": (GOOD + "loose.json,x\n", "line 3: expected one line a file"),
    "open quote": ('file,name\nloose.binary,"x\n', "expected comma-separated values"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_a_list_get_one_sentence(tmp_path, folder, capfd, fault):
    text, found = FAULTS[fault]
    place = folder / "materials.csv"
    place.write_bytes(text if isinstance(text, bytes) else text.encode())
    err = refuse(capfd, "library", folder, "-o", tmp_path / "lib.blend")
    assert err.startswith(f"lobefit: {place}") and found in err
    assert os.listdir(tmp_path) == ["measured"]


def assets_of(folder: Path) -> dict[str, object]:
    return {item.file.name: item.asset for item in items_of([str(folder)], Path("r"))}


def test_the_nearest_list_that_names_a_file_counts(folder):
    below = folder / "Metal" / "Polished"
    (folder / "materials.csv").write_text(
        "file,license,catalog\nMetal/Polished/chrome,CC0,\nloose.json,,/A// B /\n"
    )
    assets = assets_of(folder)
    assert assets["chrome.binary"].licence == "CC0"
    assert assets["chrome.binary"].catalogue == "Metal/Polished"
    assert assets["loose.binary"].licence == UNKNOWN
    assert assets["loose.binary"].catalogue == "A/B"
    # As a spreadsheet saves it, with a mark at its start.
    (below / "materials.csv").write_text("File,Author\r\nchrome.binary,me\r\n", "utf-8-sig")
    assert assets_of(folder)["chrome.binary"].author == "me"
    assert assets_of(folder)["chrome.binary"].licence == UNKNOWN
    # A folder that was named itself has no sub-folder to be sorted by, nor a list above it.
    (item,) = items_of([str(below)], Path("r"))
    assert (item.asset.catalogue, item.place) == (UNSORTED, Path("r/chrome.json"))


def test_records_of_libraries_and_hidden_files_are_no_input(folder, record):
    for place in ("lib.records/a.json", ".hidden/b.json", ".c.json"):
        (folder / place).parent.mkdir(exist_ok=True)
        record.save(folder / place)
    assert sorted(assets_of(folder)) == ["chrome.binary", "loose.binary"]


def test_what_is_refused_leaves_nothing(tmp_path, capfd):
    refuse(capfd, "library", tmp_path / "nosuch", "-o", tmp_path / "lib.blend")
    assert os.listdir(tmp_path) == []


def test_catalogues_are_kept_and_extended(tmp_path):
    place = tmp_path / catalogues.FILE
    known = str(uuid.uuid4())
    old = f"# mine\r\nVERSION 1\r\n\r\nnot a line\r\n{known}:Metal:Metal"
    place.write_bytes(old.encode())
    listed = Catalogues(tmp_path)
    assert listed.identifier("Metal") == known
    fresh = listed.identifier("Paint/Car")
    listed.save()
    assert place.read_bytes() == f"{old}\n{fresh}:Paint/Car:Paint-Car\n".encode()
    # The same again changes nothing, and a fresh file elsewhere gets the same identifier.
    written = place.stat().st_mtime_ns
    again = Catalogues(tmp_path)
    assert again.identifier("Paint/Car") == fresh
    again.save()
    assert place.stat().st_mtime_ns == written
    (tmp_path / "other").mkdir()
    assert uuid.UUID(fresh) == uuid.uuid5(uuid.NAMESPACE_URL, "lobefit:Paint/Car")


def test_a_renamed_catalogue_keeps_its_materials(tmp_path):
    first = Catalogues(tmp_path)
    identifier = first.identifier("Paint")
    first.save()
    place = tmp_path / catalogues.FILE
    place.write_text(place.read_text().replace(":Paint:Paint", ":Lacquer:Lacquer"))
    text = place.read_text()
    second = Catalogues(tmp_path)
    assert second.identifier("Paint") == identifier
    second.save()
    assert place.read_text() == text


@pytest.mark.parametrize("text", [b"VERSION 2\n", b"VERSION 1\n\xff\n"])
def test_catalogues_that_cannot_be_read(tmp_path, text):
    (tmp_path / catalogues.FILE).write_bytes(text)
    with pytest.raises(InputError, match=rf"{catalogues.FILE}: expected .*, found .*\.$"):
        Catalogues(tmp_path)


@pytest.fixture(scope="module")
def blend(tmp_path_factory, fitted) -> Path:
    """A Blender file with two measured materials, whose names no file can have, and another."""
    import bpy
    from lobefit_addon import build_material

    bpy.ops.wm.read_factory_settings(use_empty=True)
    for name in ("a/b", "a:b"):
        build_material(fitted, "measured", name).use_fake_user = True
    bpy.data.materials.new("plain").use_fake_user = True
    path = tmp_path_factory.mktemp("scene") / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def gltf_material(path: Path) -> dict:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    (material,) = json.loads(data[20 : 20 + length])["materials"]
    return material


def test_export_writes_all_that_a_material_holds(tmp_path, blend, fitted, capfd):
    out = tmp_path / "out"
    assert main(["export", str(blend), "-o", str(out)]) == 0
    paths = capfd.readouterr().out.splitlines()
    assert sorted(paths) == sorted(str(path) for path in out.iterdir())
    suffixes = (".glb", ".json", ".usdc")
    names = [f"{stem}{suffix}" for stem in ("a_b-2", "a_b") for suffix in suffixes]
    assert sorted(os.listdir(out)) == [*names, "parameters.csv"]
    assert Record.load(out / "a_b.json") == fitted
    with (out / "parameters.csv").open(newline="") as file:
        first, second = csv.DictReader(file)
    assert (first["material"], second["material"]) == ("a/b", "a:b")
    parameters = fitted.parameters
    assert float(first["exponent_green"]) == parameters["exponent"]
    assert [float(first[f"diffuse_{c}"]) for c in ("red", "green", "blue")] == parameters["diffuse"]
    assert float(first["principled_roughness"]) == fitted.principled["roughness"]
    assert float(first["relative_l1"]) == fitted.error["relative_l1"]["pooled"]
    material = gltf_material(out / "a_b.glb")
    assert material["name"] == "a/b"
    surface = material["pbrMetallicRoughness"]
    expected = fitted.principled["roughness"]
    assert surface.get("roughnessFactor", 1.0) == pytest.approx(expected, abs=1e-5)
    assert (out / "a_b.usdc").read_bytes().startswith(b"PXR-USDC")


def test_export_writes_what_is_asked_for(tmp_path, blend, capfd):
    out = tmp_path / "out"
    assert main(["export", str(blend), "--csv", "--json", "-o", str(out)]) == 0
    assert os.listdir(out) == ["parameters.csv"]
    assert json.loads(capfd.readouterr().out) == {"path": str(out / "parameters.csv")}


def test_export_refuses_what_it_cannot_do(tmp_path, blend, capfd):
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(blend))
    bpy.data.materials["a/b"]["lobefit_record"] = "{}"
    damaged = tmp_path / "damaged.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(damaged))
    capfd.readouterr()
    out = tmp_path / "out"
    assert main(["export", str(damaged), "--records", "-o", str(out)]) == 1
    assert f"lobefit: {damaged}, a/b: expected schema" in capfd.readouterr().err
    assert os.listdir(out) == ["a_b-2.json"]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(damaged))
    capfd.readouterr()
    assert "found none" in refuse(capfd, "export", damaged, "-o", tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_render_shows_each_measured_material(tmp_path, blend, fitted, capfd):
    arguments = ["render", str(blend), "--size", "48", "-o"]
    assert main([*arguments, str(tmp_path / "out"), "--linear", "--json"]) == 0
    lines = [json.loads(line) for line in capfd.readouterr().out.splitlines()]
    told = [line for line in lines if "progress" not in line]
    assert [item["material"] for item in told] == ["a/b", "a:b"]
    entry = max(fitted.closures, key=lambda entry: entry["count"])
    formula = _native.preview(("closures", entry), 48)
    for item in told:
        rendered = np.load(item["picture"])
        # The facets of the mesh move a highlight by a small part of a pixel; see test_two_lights.
        assert np.abs(rendered - formula).sum() < 0.03 * formula.sum()
    assert main([*arguments, str(tmp_path / "png")]) == 0
    pictures = [str(tmp_path / "png" / f"{stem}.png") for stem in ("a_b", "a_b-2")]
    assert capfd.readouterr().out.splitlines() == pictures
    assert all(Path(path).read_bytes().startswith(b"\x89PNG") for path in pictures)
    assert "no such file" in refuse(capfd, "render", tmp_path / "gone.blend", "-o", tmp_path)
