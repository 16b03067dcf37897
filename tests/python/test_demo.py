"""The demonstration without Blender; with it, the Blender tests look at what it builds."""

import os

import pytest
from lobefit import Record, demo
from lobefit.inputs import record_of


@pytest.fixture(autouse=True)
def no_blender(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)


@pytest.fixture(autouse=True)
def fit_only_once(monkeypatch, table, all_models):
    record, _ = all_models

    def known_record_of(path, progress, **options):
        return record if path == table else record_of(path, progress, **options)

    monkeypatch.setattr(demo, "record_of", known_record_of)


def test_all_but_blender_is_done_and_the_lack_is_named(table, tmp_path, capfd):
    assert demo.main([str(table), "-o", str(tmp_path / "demo")]) == 1
    out, err = capfd.readouterr()
    assert err.count("\n") == 1 and "pip install bpy" in err
    assert "truth" in out and "index.html" in out
    names = ["index.html", "materials.png", "methods.csv", "records", "report.csv"]
    assert sorted(os.listdir(tmp_path / "demo")) == names
    assert Record.load(tmp_path / "demo" / "records" / "truth.json").models


def test_a_material_that_fails_is_named_and_the_others_go_on(table, tmp_path, capfd):
    (tmp_path / "bad.binary").write_bytes(b"")
    code = demo.main([str(tmp_path / "bad.binary"), str(table), "-o", str(tmp_path / "demo")])
    assert code == 1
    assert "bad.binary" in capfd.readouterr().err
    assert os.listdir(tmp_path / "demo" / "records") == ["truth.json"]
    assert "bad.binary" in (tmp_path / "demo" / "index.html").read_text()
