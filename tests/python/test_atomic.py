"""Files are written whole or not at all."""

import errno
import os

import pytest
from lobefit import InputError, Record
from lobefit.atomic import make_folder, write_bytes, written_aside


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, RuntimeError, MemoryError])
def test_an_interrupted_save_leaves_the_old_file(tmp_path, interruption):
    place = tmp_path / "record.json"
    place.write_text("old")
    with pytest.raises(interruption), written_aside(place) as aside:
        aside.write_text("half of the ne")
        raise interruption
    assert place.read_text() == "old"
    assert os.listdir(tmp_path) == ["record.json"]


def test_a_full_disk_leaves_the_old_file(record, tmp_path, monkeypatch):
    place = tmp_path / "record.json"
    record.save(place)

    def no_space(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(InputError, match=r"record.json: cannot be written, the disk is full\.$"):
        record.save(place)
    assert Record.load(place) == record
    assert os.listdir(tmp_path) == ["record.json"]


def test_a_full_device_is_named(tmp_path):
    full = os.path.join(os.sep, "dev", "full")
    if not os.path.exists(full):
        pytest.skip("this system has no device that is always full")
    with pytest.raises(InputError, match="found not an ordinary file"):
        write_bytes(full, b"x")


def test_the_name_beside_is_told_nobody(tmp_path):
    place = tmp_path / "table.binary"
    with pytest.raises(InputError) as told, written_aside(place) as aside:
        raise InputError(f"{aside}: cannot be written, so is {aside.name}.")
    assert str(told.value) == f"{place}: cannot be written, so is table.binary."


def test_a_missing_folder_is_named(record, tmp_path):
    place = tmp_path / "none" / "record.json"
    with pytest.raises(InputError, match="cannot be written, its folder does not exist"):
        record.save(place)


def test_a_file_is_no_folder(record, tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="its folder is a file"):
        record.save(tmp_path / "file" / "record.json")
    with pytest.raises(InputError, match="expected a folder, found a file"):
        make_folder(tmp_path / "file")


def test_a_folder_is_no_file(record, tmp_path):
    with pytest.raises(InputError, match="found a folder"):
        record.save(tmp_path)


def test_a_folder_without_permission_is_named(record, tmp_path):
    if os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="permission was denied"):
        record.save(tmp_path / "record.json")


def test_a_read_only_file_system_is_named(record):
    with pytest.raises(InputError, match="cannot be written, "):
        record.save(os.path.join(os.sep, "proc", "record.json"))


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    write_bytes(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


def test_the_file_has_the_usual_permissions(tmp_path):
    (tmp_path / "usual").write_text("")
    write_bytes(tmp_path / "ours", b"")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "usual").stat().st_mode
