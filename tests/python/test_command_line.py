"""The command line as a user meets it: exit codes, messages, files left behind."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from commands import refuse
from lobefit import Record
from lobefit.command_line import main

SHAPE = (90, 90, 180)
BYTES = 34_992_012


def write_table(path: Path, dimensions=SHAPE, fill=0.5, order="<") -> Path:
    values = np.full((3, *SHAPE), fill, order + "f8")
    path.write_bytes(np.array(dimensions, order + "i4").tobytes() + values.tobytes())
    return path


def cut(path: Path, size: int) -> Path:
    with write_table(path).open("rb+") as file:
        file.truncate(size)
    return path


def written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def folder(path: Path) -> Path:
    path.mkdir()
    return path


BAD_FILES = {
    "empty": (lambda path: written(path, b""), "empty"),
    "text": (lambda path: written(path, b"diffuse 0.1 0.2 0.3\n" * 20), "found text"),
    "cut in its head": (lambda path: written(path, b"\x5a\0\0\0"), "bytes"),
    "truncated": (lambda path: cut(path, BYTES // 2), "34,992,012 bytes, found 17,496,006"),
    "a byte short": (lambda path: cut(path, BYTES - 1), "found 34,992,011"),
    "too long": (lambda path: cut(path, BYTES + 8), "found 34,992,020"),
    "permuted": (lambda path: write_table(path, (180, 90, 90)), "theta_h = 180"),
    "negative": (lambda path: write_table(path, (-90, -90, 180)), "theta_h = -90"),
    "huge": (lambda path: write_table(path, (2**31 - 1,) * 3), "2147483647"),
    "big-endian": (lambda path: write_table(path, order=">"), "big-endian"),
    "all bins invalid": (lambda path: write_table(path, fill=-1.0), "no valid bin"),
    "all NaN": (lambda path: write_table(path, fill=np.nan), "not finite"),
    "missing": (lambda path: path, "no such file"),
}


@pytest.mark.parametrize("kind", BAD_FILES)
def test_bad_files_get_one_sentence(tmp_path, capfd, kind):
    make, found = BAD_FILES[kind]
    path = make(tmp_path / "bad.binary")
    err = refuse(capfd, "info", path)
    assert str(path) in err
    assert found in err


@pytest.mark.parametrize("command", ["fit", "preview", "report"])
def test_a_bad_file_leaves_no_output(tmp_path, capfd, command):
    path = written(tmp_path / "bad.binary", b"")
    output = tmp_path / {"fit": "out.json", "preview": "out.png", "report": "out"}[command]
    assert str(path) in refuse(capfd, command, path, "-o", output)
    assert os.listdir(tmp_path) == ["bad.binary"]


@pytest.mark.parametrize("command", ["fit", "closures", "material"])
def test_other_files_are_not_written_over(tmp_path, capfd, command):
    """A record or a Blender file in the place of a measured file would be a slip."""
    table, other = write_table(tmp_path / "a.binary"), written(tmp_path / "b.binary", b"measured")
    assert "expected a name that ends in ." in refuse(capfd, command, table, "-o", other)
    assert other.read_bytes() == b"measured"


def test_a_refused_folder_is_not_made(tmp_path, capfd):
    twice = [write_table(folder(tmp_path / name) / "a.binary") for name in ("one", "two")]
    assert "expected one file to make it of" in refuse(capfd, "fit", *twice, "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_tolerance_that_nothing_heeds_is_refused(tmp_path, capfd):
    arguments = ["material", write_table(tmp_path / "a.binary"), "--kind", "measured"]
    told = refuse(capfd, *arguments, "--tolerance", 0.1, "-o", tmp_path / "a.blend")
    assert "--tolerance: expected the kind auto, found measured." in told


def test_a_folder_is_no_measurement(tmp_path, capfd):
    assert "found a folder" in refuse(capfd, "info", folder(tmp_path / "bad.binary"))


def test_another_format_is_told_by_what_is_in_it(tmp_path, capfd):
    picture = written(tmp_path / "picture.exr", b"v/1\1\2\0\0\0channels\0chlist\0")
    assert "is this another format?" in refuse(capfd, "info", picture)


def test_a_file_without_permission_is_named(tmp_path, capfd):
    if os.geteuid() == 0:
        pytest.skip("root may read everything")
    path = write_table(tmp_path / "mine.binary")
    path.chmod(0)
    assert "ermission" in refuse(capfd, "info", path)


OPTIONS_OF_FITS = [
    ["--uncertainty"],
    ["--no-fresnel"],
    ["--norm", "cosine-l1"],  # which is the default
    ["--max-angle", "80"],
]


@pytest.mark.parametrize("option", OPTIONS_OF_FITS, ids=lambda option: option[0])
def test_an_option_of_a_fit_is_refused_where_nothing_is_fitted(tmp_path, record, capfd, option):
    place, output = tmp_path / "gold.json", tmp_path / "out.json"
    record.save(place)
    err = refuse(capfd, "closures", place, *option, "-o", output)
    assert str(place) in err and option[0] in err and "found a record" in err
    assert not output.exists()


@pytest.mark.parametrize("command", ["preview", "report"])
def test_a_norm_does_not_change_the_picture_of_a_record(tmp_path, record, capfd, command):
    record.save(tmp_path / "gold.json")
    output = tmp_path / "out"
    assert "--norm" in refuse(capfd, command, tmp_path / "gold.json", "--norm", "l2", "-o", output)
    assert not output.exists()


def test_an_empty_folder_has_nothing_to_fit(tmp_path, capfd):
    err = refuse(capfd, "fit", tmp_path, "-o", tmp_path / "out")
    assert "expected files named *.binary" in err


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["polish"],
        ["fit"],
        ["fit", "x.binary"],
        ["fit", "x.binary", "-o", "x.json", "--model", "ward"],
        ["fit", "x.binary", "-o", "x.json", "--max-angle", "91"],
        ["fit", "x.binary", "-o", "x.json", "--max-angle", "nan"],
        ["fit", "x.binary", "-o", "x.json", "--threads", "-1"],
        ["fit", "x.binary", "-o", "x.json", "--threads", "many"],
        ["preview", "x.json", "-o", "x.png", "--size", "0"],
        ["sample", "folder", "unobtainium"],
    ],
    ids=" ".join,
)
def test_wrong_use_gets_one_sentence(capfd, arguments):
    refuse(capfd, *arguments)


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_help_is_no_error(capfd, option):
    with pytest.raises(SystemExit) as ended:
        main([option])
    assert ended.value.code == 0
    assert "lobefit" in capfd.readouterr().out


def test_samples_say_what_they_are(tmp_path, capfd):
    assert main(["sample", str(tmp_path), "nickel"]) == 0
    assert "nickel (from Low et al.'s ABC fit)" in capfd.readouterr().out
    assert sorted(os.listdir(tmp_path)) == ["nickel.binary", "samples.csv"]
    assert main(["info", "--json", str(tmp_path / "nickel.binary")]) == 0
    facts = json.loads(capfd.readouterr().out)
    assert facts["name"] == "nickel (from Low et al.'s ABC fit)"
    assert facts["bytes"] == BYTES


def test_a_sample_takes_no_other_file_s_place(tmp_path, capfd):
    other = written(tmp_path / "nickel.binary", b"measured")
    told = refuse(capfd, "sample", tmp_path, "chrome", "nickel")
    assert "expected a free name for a sample, found another file" in told
    assert other.read_bytes() == b"measured" and os.listdir(tmp_path) == ["nickel.binary"]
    other.unlink()
    for _ in range(2):  # it takes its own place
        assert main(["sample", str(tmp_path), "nickel"]) == 0


def test_a_sample_is_listed_before_it_is_there(tmp_path, monkeypatch):
    """A run that is killed between the two could not be made again otherwise."""
    replace = os.replace

    def killed(source, target):
        if str(target).endswith(".binary"):
            raise KeyboardInterrupt
        replace(source, target)

    monkeypatch.setattr(os, "replace", killed)
    assert main(["sample", str(tmp_path), "nickel"]) == 130
    assert "nickel.binary" in (tmp_path / "samples.csv").read_text()


def test_another_file_does_not_inherit_the_name_of_a_sample(tmp_path, table, capfd):
    assert main(["sample", str(tmp_path), "nickel"]) == 0
    (tmp_path / "nickel.binary").write_bytes(table.read_bytes())
    capfd.readouterr()
    assert main(["info", "--json", str(tmp_path / "nickel.binary")]) == 0
    assert "name" not in json.loads(capfd.readouterr().out)


def test_a_second_sample_joins_the_list(tmp_path, capfd):
    for name in ("nickel", "chrome"):
        assert main(["sample", str(tmp_path), name]) == 0
    names = (tmp_path / "samples.csv").read_text()
    assert "nickel.binary" in names and "chrome.binary" in names


def test_info_counts_damaged_bins(tmp_path, capfd):
    path = write_table(tmp_path / "damaged.binary")
    with path.open("rb+") as file:
        file.seek(12 + 8 * 90)
        file.write(np.array([-3.0, np.nan]).tobytes())
    assert main(["info", str(path), "--json"]) == 0
    facts = json.loads(capfd.readouterr().out)
    assert facts["bins"]["negative"] == 1
    assert facts["bins"]["non_finite"] == 1
    assert len(facts["warnings"]) == 2


def test_fit_writes_a_record_and_a_line_of_json(tmp_path, table, capfd):
    output = tmp_path / "truth.json"
    assert main(["fit", str(table), "--no-fresnel", "--json", "-o", str(output)]) == 0
    lines = capfd.readouterr().out.splitlines()
    assert len(lines) == 1
    told = json.loads(lines[0])
    assert told.pop("record") == str(output)
    record = Record.load(output)
    assert told == json.loads(record.to_json())
    assert record.parameters["ior"] is None


def test_one_bad_file_does_not_stop_the_others(tmp_path, table, capfd):
    written(tmp_path / "bad.binary", b"")
    (tmp_path / "good.binary").symlink_to(table)
    code = main(["fit", str(tmp_path), "--model", "modified-phong", "-o", str(tmp_path / "out")])
    assert code == 1
    assert "bad.binary" in capfd.readouterr().err
    assert os.listdir(tmp_path / "out") == ["good.json"]


def test_a_folder_goes_on_where_it_stopped(tmp_path, table, capfd):
    for name in ("one", "two"):
        (tmp_path / f"{name}.binary").symlink_to(table)
    out = tmp_path / "out"
    command = ["fit", str(tmp_path), "--model", "modified-phong", "-o", str(out)]
    assert main(command) == 0
    assert "kept" not in capfd.readouterr().err
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    (out / "two.json").write_text("{")  # as no kill of ours leaves it
    assert main(command) == 0
    told = capfd.readouterr()
    assert "1 of 2 kept" in told.err
    assert told.out.count("modified-phong") == 2
    assert (out / "one.json").read_bytes() == before["one.json"]
    assert Record.load(out / "two.json").parameters == Record.load(out / "one.json").parameters
    # Another setting, another file, and what is asked for anew are computed.
    assert main([*command, "--norm", "l2"]) == 0
    assert "kept" not in capfd.readouterr().err
    assert Record.load(out / "one.json").norm == "l2"
    (tmp_path / "two.binary").unlink()
    write_table(tmp_path / "two.binary")
    assert main([*command, "--norm", "l2"]) == 0
    assert "1 of 2 kept" in capfd.readouterr().err
    assert main([*command, "--norm", "l2", "--again"]) == 0
    assert "kept" not in capfd.readouterr().err
    # A record without the uncertainty lacks what is asked for, one with it has more than that.
    assert main([*command, "--norm", "l2", "--uncertainty"]) == 0
    assert "kept" not in capfd.readouterr().err
    assert main([*command, "--norm", "l2"]) == 0
    assert "2 of 2 kept" in capfd.readouterr().err


def test_info_tells_what_a_record_holds(tmp_path, table, capfd):
    place = tmp_path / "truth.json"
    assert main(["fit", str(table), "--uncertainty", "-o", str(place)]) == 0
    capfd.readouterr()
    assert main(["info", str(place)]) == 0
    told = capfd.readouterr().out
    for what in ("exponent", "diffuse red", " to ", "relative_l1_cosine", "albedo at", "view"):
        assert what in told
    assert main(["info", "--json", str(place)]) == 0
    assert json.loads(capfd.readouterr().out)["uncertainty"]["blocks"] >= 20


@pytest.mark.parametrize("command", ["fit", "preview", "material"])
def test_what_is_read_is_not_written_over(tmp_path, table, capfd, command):
    path, link = tmp_path / "gold.binary", tmp_path / "link.binary"
    path.write_bytes(table.read_bytes())
    link.symlink_to(path)
    before = path.read_bytes()
    assert "expected the name of another file to write" in refuse(capfd, command, path, "-o", link)
    assert path.read_bytes() == before


def test_a_record_cannot_be_written_onto_a_folder(tmp_path, table, capfd):
    assert "found a folder" in refuse(capfd, "fit", table, "-o", tmp_path)


def test_material_says_what_to_install(tmp_path, record, capfd, monkeypatch):
    record.save(tmp_path / "gold.json")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    err = refuse(capfd, "material", tmp_path / "gold.json", "-o", tmp_path / "gold.blend")
    assert "pip install bpy" in err


def test_ctrl_c_leaves_nothing_behind(tmp_path, table):
    (tmp_path / "out").mkdir()
    for index in range(20):
        (tmp_path / f"{index}.binary").symlink_to(table)
    command = [sys.executable, "-m", "lobefit", "fit", str(tmp_path)]
    # A runner in the background of a shell ignores Ctrl-C, and so would what it starts.
    process = subprocess.Popen(
        [*command, "-o", str(tmp_path / "out")],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    while not os.listdir(tmp_path / "out"):
        time.sleep(0.05)
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert err == b"lobefit: interrupted\n"
    for name in os.listdir(tmp_path / "out"):
        Record.load(tmp_path / "out" / name)


def test_a_reader_that_goes_away_is_no_error(table):
    command = f"'{sys.executable}' -m lobefit info --json {f'{table} ' * 3}| head -c 5"
    ended = subprocess.run(command, shell=True, capture_output=True, timeout=60, check=True)
    assert ended.stderr == b""


@pytest.fixture(scope="module")
def blend(tmp_path_factory, table) -> Path:
    """A Blender file: a sphere with a measured material before a camera, and a sun."""
    import bpy
    from lobefit import closures
    from lobefit_addon import build_material

    record = closures(table, count=1)
    for count in (0, 2, 3):
        record = closures(record, count=count)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add()
    bpy.context.object.data.materials.append(build_material(record, "measured", "truth"))
    bpy.ops.object.camera_add(location=(0, 0, 9), rotation=(0, 0, 0))
    bpy.context.scene.camera = bpy.context.object
    bpy.ops.object.light_add(type="SUN")
    path = tmp_path_factory.mktemp("scene") / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_simplify_and_restore(tmp_path, blend, capfd):
    out, back = tmp_path / "out.blend", tmp_path / "back.blend"
    before = blend.read_bytes()
    arguments = ["--tolerance", "20", "--frames", "2"]
    assert main(["simplify", str(blend), *arguments, "--json", "-o", str(out)]) == 0
    (line,) = capfd.readouterr().out.splitlines()
    result = json.loads(line)
    assert result["frames"] == [1, 250]
    assert result["lights"] == {"Sun": 1}
    assert result["error_added"] <= 0.2
    (row,) = result["materials"]
    assert row["before"]["count"] > row["after"]["count"]
    assert main(["simplify", str(out), "--restore", "-o", str(back)]) == 0
    assert capfd.readouterr().out == "truth: restored\n"
    assert main(["simplify", str(back), *arguments, "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["materials"] == result["materials"]
    assert blend.read_bytes() == before
    assert main(["simplify", str(back), *arguments]) == 0
    table = capfd.readouterr().out.splitlines()
    assert table[0].split()[:3] == ["material", "before", "after"]
    assert table[1].startswith("truth ")
    assert table[-2:] == ["lit by 1 Sun", "nothing is written without -o OUT.blend"]
    assert main(["simplify", str(back), "--restore"]) == 0
    assert capfd.readouterr().out.splitlines()[0] == "nothing to restore"


def test_closures_say_when_a_tolerance_is_out_of_reach(tmp_path, table, capfd):
    place = tmp_path / "record.json"
    assert (
        main(["closures", str(table), "--target", "lobe", "--tolerance", "0", "-o", str(place)])
        == 0
    )
    assert capfd.readouterr().out.splitlines()[-1].strip() == "none of lobe keeps to 0"
    arguments = ["--target", "lobe", "--tolerance", "1", "-o", str(place)]
    assert main(["closures", str(place), *arguments]) == 0
    assert "none of" not in capfd.readouterr().out
    assert "not allowed with" in refuse(
        capfd, "closures", place, "--closures", "1", "--tolerance", "1", "-o", place
    )


def test_simplify_refuses_what_it_cannot_do(tmp_path, blend, capfd):
    assert "no such file" in refuse(capfd, "simplify", tmp_path / "gone.blend")
    text = written(tmp_path / "text.blend", b"no Blender file")
    assert "cannot be opened" in refuse(capfd, "simplify", text)
    assert "a percentage" in refuse(capfd, "simplify", blend, "--tolerance", "-1")
    assert "folder" in refuse(capfd, "simplify", blend, "-o", tmp_path)
