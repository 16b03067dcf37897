"""The example of the manual that Blender runs does what it says."""

import runpy
from pathlib import Path

import bpy
import numpy as np
import pytest

SCRIPT = Path(__file__).parents[2] / "docs" / "manual" / "examples" / "render_measured.py"


def test_without_arguments_the_usage_is_told(monkeypatch):
    monkeypatch.setattr("sys.argv", ["blender", "--background"])
    with pytest.raises(SystemExit, match=r"^usage: blender .* -- nickel\.binary nickel\.png$"):
        runpy.run_path(str(SCRIPT), run_name="__main__")


def test_a_file_is_imported_and_rendered(addon, measured_file, tmp_path, monkeypatch):
    output = tmp_path / "nickel.png"
    monkeypatch.setattr("sys.argv", ["blender", "--", measured_file, str(output)])
    runpy.run_path(str(SCRIPT), run_name="__main__")
    image = bpy.data.images.load(str(output))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    red, green, blue, alpha = pixels.reshape(*image.size, 4).transpose(2, 0, 1)
    # The sphere is in the middle with nothing around it, and has a highlight of the metal's colour.
    assert alpha[128, 128] == 1 and alpha[0, 0] == 0
    lit = red > 0.5
    assert 0.001 < lit.mean() < 0.2
    assert red[lit].sum() >= green[lit].sum() >= blue[lit].sum()
    assert bpy.data.objects["Sphere"].active_material.name == "nickel"
