"""`lobefit diagnose`: what a report of a problem has to tell."""

import json
import platform

import numpy as np
import pytest
from lobefit import _native, diagnosis
from lobefit.command_line import main


def test_versions_and_a_self_test_are_told(capfd):
    assert main(["diagnose", "--json"]) == 0
    told = json.loads(capfd.readouterr().out)
    assert told["Lobefit"] == _native.version
    assert told["build"] == _native.build_id
    assert told["Python"] == platform.python_version()
    assert told["NumPy"] == np.__version__
    assert told["module"].endswith(".so")
    assert told["instructions"] in ("AVX2", "baseline")
    assert told["self-test"]["passed"] is True
    assert [check["passed"] for check in told["self-test"]["checks"]] == [True] * 3


def test_the_text_has_a_line_for_each_fact(capfd):
    assert main(["diagnose"]) == 0
    lines = capfd.readouterr().out.splitlines()
    names = [line.split()[0] for line in lines]
    assert names == [*diagnosis.diagnose().facts, *["self-test"] * 3]
    assert f"{_native.build_id}" in lines[1]


def test_another_figure_fails_the_self_test(monkeypatch, capfd):
    monkeypatch.setattr(diagnosis, "_SAMPLE", "red-fabric2")
    assert main(["diagnose"]) == 1
    out = capfd.readouterr().out
    assert "passed, valid bins" in out
    assert "FAILED, error of the fit: 0.04" in out


@pytest.mark.parametrize("failure", [MemoryError(), OSError("no room")])
def test_what_ends_the_self_test_is_told(monkeypatch, capfd, failure):
    def fail(*_arguments, **_options):
        raise failure

    monkeypatch.setattr(diagnosis, "closures", fail)
    assert main(["diagnose"]) == 1
    out, err = capfd.readouterr()
    assert f"FAILED, {type(failure).__name__}: {failure}\n" in out
    assert _native.build_id in out and err == ""


def test_a_home_folder_is_not_told(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr(_native, "__file__", str(tmp_path / "lib" / "_native.so"))
    assert diagnosis.diagnose().facts["module"] == "~/lib/_native.so"
