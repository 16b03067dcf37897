"""The classic model as Python and the command line tell it; its formula and the match themselves
are held against sampling in tests/native/classic_test.cpp."""

import json

import lobefit
import numpy as np
import pytest
from lobefit import _native, picture
from lobefit.classic import as_classic
from lobefit.command_line import main

FIT = {
    "model": "interpolated",
    "diffuse": [0.3, 0.2, 0.1],
    "specular": [2.0, 1.5, 1.0],
    "exponent": 20.0,
    "interpolation": 0.5,
    "ior": 1.5,
}


def test_a_match_is_nearer_than_four_times_the_exponent():
    for angle in (None, 0.0, 70.0):
        match = lobefit.match_exponent(20.0, angle)
        assert match.exponent > 20 and match.error < match.error_of_four
    # 2 (1 + cos^2 60) of sharp highlights.
    assert lobefit.match_exponent(1e5, 60.0).exponent == pytest.approx(2.5e5, rel=1e-3)


@pytest.mark.parametrize(
    ("exponent", "angle", "found"), [(0.0, None, "0"), (np.nan, 0.0, "nan"), (1.0, 91.0, "91")]
)
def test_what_is_out_of_range_is_refused(exponent, angle, found):
    with pytest.raises(lobefit.InputError, match=f"expected .*found {found}"):
        lobefit.match_exponent(exponent, angle)


def test_a_fit_as_classic_materials_faces_a_light_as_the_fit_does():
    up = [[0.0, 0.0, 1.0]]
    for changes in ({}, {"model": "modified-blinn-phong", "interpolation": None, "ior": None}):
        fit = FIT | changes
        for model, material in as_classic(fit).items():
            assert material["model"] == model
            shown = _native.evaluate_classic(material, up, up) / np.pi
            # A few roundings.
            assert shown == pytest.approx(_native.evaluate_model(fit, up, up), rel=1e-13)


def test_channels_keep_their_exponents():
    materials = as_classic(FIT | {"exponent": [10.0, 20.0, 40.0]})
    assert materials["classic-phong"]["exponent"] == [10.0, 20.0, 40.0]
    matched = [lobefit.match_exponent(s).exponent for s in (10.0, 20.0, 40.0)]
    assert materials["classic-blinn-phong"]["exponent"] == matched


def test_the_preview_shows_the_formula():
    for model, material in as_classic(FIT).items():
        sphere = _native.preview(("classic", material), 33)
        # The pixel in the middle faces the viewer, and one of the two lights alone.
        light = np.array([[1.0, 1.0, 1.2]]) / np.sqrt(3.44)
        expected = _native.evaluate_classic(material, light, [[0.0, 0.0, 1.0]])[0] / np.pi
        # The picture is in single precision.
        assert sphere[16, 16] == pytest.approx(expected, rel=1e-6), model
    with pytest.raises(lobefit.InputError, match="found 'gouraud'"):
        _native.preview(("classic", material | {"model": "gouraud"}), 33)


def test_the_command_prints_a_table_or_json(capsys):
    assert main(["match-exponent", "--exponent", "2", "20", "--angle", "45"]) == 0
    lines = capsys.readouterr().out.splitlines()
    match = lobefit.match_exponent(20.0, 45.0)
    # The table has six digits.
    assert float(lines[2].split()[1]) == pytest.approx(match.exponent, rel=1e-5)
    assert main(["match-exponent", "--exponent", "20", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == {"phong_exponent": 20.0, **vars(lobefit.match_exponent(20.0))}
    assert main(["match-exponent", "--exponent", "0"]) == 2
    assert "from 0.1 to 100000000.0, found '0'" in capsys.readouterr().err


def test_the_preview_command_adds_the_classic_models(record, tmp_path, monkeypatch):
    record.save(tmp_path / "gold.json")
    sizes = []
    monkeypatch.setattr(picture, "write_png", lambda path, image: sizes.append(image.shape))
    for options in ([], ["--classic"]):
        arguments = ["preview", str(tmp_path / "gold.json"), "-o", str(tmp_path / "x.png")]
        assert main([*arguments, "--size", "48", *options]) == 0
    assert sizes[1][1] > sizes[0][1] and sizes[1][0] == sizes[0][0]
