"""What goes wrong around Lobefit: files that change, disks, memory, processes and names.

The benchmark `faults` tries more of it, and for longer.
"""

import os
import resource
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from commands import PATIENCE, refuse, start
from lobefit import InputError, Record, atomic, blender, catalogues, fit, start_fit
from lobefit.catalogues import Catalogues
from lobefit.command_line import main
from lobefit.origin import read_unchanged


@pytest.fixture
def own_table(tmp_path, table) -> Path:
    """A table that a test may meddle with."""
    path = tmp_path / "own.binary"
    path.write_bytes(table.read_bytes())
    return path


def write_elsewhere(path: Path) -> None:
    with path.open("r+b") as file:
        file.seek(path.stat().st_size // 2)
        file.write(bytes(8))


def replace(path: Path) -> None:
    path.with_suffix(".new").write_bytes(path.read_bytes())
    os.replace(path.with_suffix(".new"), path)


@pytest.mark.parametrize(
    "meddle", [Path.unlink, lambda path: os.truncate(path, 1000), write_elsewhere, replace]
)
def test_a_file_that_changes_while_it_is_fitted_is_refused(own_table, meddle):
    job = start_fit(own_table)
    meddle(own_table)
    with pytest.raises(InputError, match=rf"^{own_table}: .*[.?]$"):
        job.record()


def test_closures_are_never_of_another_file(own_table):
    record = fit(own_table)
    assert read_unchanged(record.source) is not None
    write_elsewhere(own_table)
    assert read_unchanged(record.source) is None
    own_table.write_text("text")
    assert read_unchanged(record.source) is None


def test_what_was_left_beside_goes_an_hour_later(tmp_path, record):
    place = tmp_path / "a.json"
    left = [tmp_path / f".a-0123456{n}.json{end}" for n, end in enumerate(("", "@", ".part"))]
    others = [tmp_path / name for name in (".b-01234567.json", ".a-mine.json", "a-01234567.json")]
    for path in [*left, *others]:
        path.write_text("half")
    record.save(place)
    # Whoever wrote them may still be at it.
    assert all(path.exists() for path in left)
    for path in [*left, *others]:
        now = path.stat().st_mtime
        os.utime(path, (now - 3601, now - 3601))
    record.save(place)
    assert sorted(tmp_path.iterdir()) == sorted([place, *others])


@pytest.mark.parametrize("stem", ["é" * 125, "材" * 83, "🎨" * 62, "a" * 250])
def test_names_as_long_as_a_file_system_allows(tmp_path, record, stem):
    record.save(tmp_path / f"{stem}.json")
    assert os.listdir(tmp_path) == [f"{stem}.json"]


def test_names_that_are_too_long(tmp_path, table, capfd):
    place = tmp_path / ("a" * 300)
    assert "the name is too long" in refuse(capfd, "fit", table, "-o", place)
    assert "name is too long" in refuse(capfd, "fit", place, "-o", tmp_path / "a.json").lower()


def test_odd_names(tmp_path, table, capfd):
    folder = tmp_path / "two  words, Ünïcödé 材料 🎨 'quoted'" / "/".join(["a" * 49] * 6)
    folder.mkdir(parents=True)
    (folder / "-o.binary").symlink_to(table)
    assert main(["fit", str(folder / "-o.binary"), "-o", str(folder / "-o.json")]) == 0
    assert Record.load(folder / "-o.json").source["path"] == str(folder / "-o.binary")


def test_catalogues_of_two_libraries_at_once(tmp_path):
    first, second = Catalogues(tmp_path), Catalogues(tmp_path)
    names = first.identifier("Metal"), second.identifier("Paint"), second.identifier("Metal")
    first.save()
    second.save()
    text = (tmp_path / catalogues.FILE).read_text()
    assert [text.count(name) for name in names] == [1, 1, 1]


def test_one_after_the_other_in_a_folder(tmp_path):
    order = []

    def wait_for_it():
        with atomic.alone_in(tmp_path):
            order.append("other")

    other = threading.Thread(target=wait_for_it)
    with atomic.alone_in(tmp_path):
        other.start()
        other.join(0.2)
        order.append("one")
    other.join(PATIENCE)
    assert order == ["one", "other"] and os.listdir(tmp_path) == []


def test_a_full_disk_for_results_gets_one_sentence(table):
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no device that is always full")
    with full.open("w") as out:
        command = [sys.executable, "-P", "-m", "lobefit", "info", str(table)]
        ended = subprocess.run(command, stdout=out, stderr=subprocess.PIPE, text=True)
    assert (ended.returncode, ended.stderr) == (2, "lobefit: stopped, the disk is full.\n")


# Megabytes more than what is loaded takes.
@pytest.mark.parametrize(
    ("command", "megabytes"), [("info", 0), ("info", 8), ("fit", 0), ("fit", 200), ("closures", 64)]
)
def test_little_memory_gets_one_sentence(tmp_path, table, command, megabytes):
    program = f"""
import resource, sys
from pathlib import Path
from lobefit.command_line import main
taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (taken + {megabytes} * 1000000,) * 2)
sys.exit(main(sys.argv[1:]))
"""
    words = [command, str(table), *([] if command == "info" else ["-o", str(tmp_path / "a.json")])]
    ended = subprocess.run(
        [sys.executable, "-P", "-c", program, *words], capture_output=True, text=True
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("lobefit: ") and ended.stderr.count("\n") == 1
    assert ended.stderr.endswith("expected enough memory, found too little.\n")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("kind", ["gltf", "usd"])
def test_exports_to_a_full_disk_get_one_sentence(tmp_path, table, kind):
    scene = tmp_path / "scene.blend"
    blender.write_blend(scene, fit(table))
    out = tmp_path / "out"
    # A sphere takes more than this, and so no exporter comes to its end.
    limit = (20_000,) * 2
    process = start(
        "export",
        scene,
        f"--{kind}",
        "-o",
        out,
        before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit),
    )
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    assert err.startswith(f"lobefit: {out}") and err.count("\n") == 1 and "Traceback" not in err
    assert os.listdir(out) == []


def test_files_of_strangers_run_nothing(tmp_path, capfd):
    import bpy

    marker, path = tmp_path / "executed", tmp_path / "stranger.blend"
    bpy.ops.wm.read_factory_settings(use_empty=True)
    text = bpy.data.texts.new("run.py")
    text.use_module, text.use_fake_user = True, True
    text.write(f"open({str(marker)!r}, 'w').close()")
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    capfd.readouterr()
    bpy.context.preferences.filepaths.use_scripts_auto_execute = True
    refuse(capfd, "export", path, "-o", tmp_path / "out")
    assert not marker.exists()
    # That the file would run something is no matter of belief.
    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=True)
    assert marker.exists()
