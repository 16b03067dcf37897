"""The examples of the manual do what they say; the one for Blender is in tests/blender."""

import subprocess
import sys
from pathlib import Path

import lobefit
import pytest

EXAMPLES = Path(__file__).parents[2] / "docs" / "manual" / "examples"


def run(name: str, *arguments: object) -> list[list[str]]:
    """Runs an example as its docstring tells; the words of its lines."""
    words = [sys.executable, str(EXAMPLES / name), *map(str, arguments)]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [line.split() for line in done.stdout.splitlines()]


def test_a_file_is_fitted_and_its_record_saved(table, truth, tmp_path):
    lines = {name: words for name, *words in run("fit_and_save.py", table, tmp_path / "a.json")}
    record = lobefit.Record.load(tmp_path / "a.json")
    assert record.parameters["exponent"] == pytest.approx(truth["exponent"], rel=1e-3)
    assert lines.keys() == record.parameters.keys() | record.error.keys()
    for name, figure in record.error.items():
        assert float(lines[name][0]) == pytest.approx(figure["pooled"], abs=5e-5)


def test_a_bad_file_ends_it_with_a_sentence(tmp_path):
    script = EXAMPLES / "fit_and_save.py"
    words = [sys.executable, str(script), str(tmp_path / "none.binary"), str(tmp_path / "a.json")]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 1
    assert "none.binary" in done.stderr and "Traceback" not in done.stderr
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["fit_and_save.py", "compare_kinds.py"])
def test_without_arguments_the_usage_is_told(name):
    done = subprocess.run([sys.executable, str(EXAMPLES / name)], capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.startswith(f"usage: python {name} nickel.binary"), done.stderr


def test_more_closures_are_closer(table):
    heads, *rows, principled = run("compare_kinds.py", table)
    assert heads == ["kind", "closures", "error", "grazing", "seconds"]
    assert [(kind, int(count)) for kind, count, *_ in rows] == [("measured", n) for n in range(4)]
    errors = [float(error) for _, _, error, *_ in rows]
    assert errors == sorted(errors, reverse=True)
    assert principled[0] == "principled" and float(principled[1]) > errors[-1]
