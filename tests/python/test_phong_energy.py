"""The energy of Phong's lobes as Python and the command line tell it; the figures themselves are
held against quadrature in tests/native/phong_energy_test.cpp."""

import json
import math

import lobefit
import numpy as np
import pytest
from lobefit.command_line import main


def test_arrays_broadcast():
    exponents, angles = np.array([[0.0], [3.5], [1e12]]), np.array([0.0, 40.0, 90.0, 89.9999])
    found = lobefit.energy("modified-phong", exponents, angles)
    assert found.integral.shape == found.by_angle.shape == (3, 4)
    one = lobefit.energy("modified-phong", 3.5, 40.0)
    assert one.integral == found.integral[1, 1] and one.by_exponent == found.by_exponent[1, 1]


def test_conserving_is_normalising_at_normal_incidence():
    for lobe in ("phong", "modified-phong"):
        for exponent in (0.0, 0.3, 60.0):
            found = lobefit.energy(lobe, exponent, 0.0)
            assert found.conserving == pytest.approx(found.normalising, rel=1e-14)
            # It conserves: elsewhere the lobe reflects less.
            assert lobefit.energy(lobe, exponent, 50.0).integral * found.conserving < 1


@pytest.mark.parametrize(
    ("lobe", "exponent", "angle", "found"),
    [
        ("blinn", 1.0, 0.0, "'blinn'"),
        ("phong", -1.0, 0.0, "-1"),
        ("phong", [1.0, math.nan], 0.0, "nan"),
        ("phong", 1.0, 90.1, "90.1"),
    ],
)
def test_what_is_out_of_range_is_refused(lobe, exponent, angle, found):
    with pytest.raises(lobefit.InputError, match=f"expected .*found {found}"):
        lobefit.energy(lobe, exponent, angle)


def test_the_command_prints_the_integral_last(capsys):
    assert main(["energy", "--model", "phong", "--exponent", "0", "--angle", "90"]) == 0
    text = capsys.readouterr().out.split()[-1]
    assert float(text) == math.pi
    arguments = ["--model", "modified-phong", "--exponent", "2.5", "--angle", "60", "--json"]
    assert main(["energy", *arguments]) == 0
    figures = json.loads(capsys.readouterr().out)
    exact = lobefit.energy("modified-phong", 2.5, 60.0)
    # 17 digits are a double.
    assert figures["integral"] == exact.integral
    assert figures["by_exponent"] == exact.by_exponent
    assert figures["energy_conserving_factor"] == exact.conserving
    assert figures["energy_normalised_factor"] == exact.normalising


def test_the_command_tells_of_several_exponents(capsys):
    arguments = ["--model", "phong", "--exponent", "5", "10", "--angle", "30"]
    assert main(["energy", *arguments, "--json"]) == 0
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [each["exponent"] for each in found] == [5, 10]
    assert found[1]["integral"] == lobefit.energy("phong", 10.0, 30.0).integral
    assert main(["energy", *arguments]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [line[1] for line in lines if line[0] == "exponent"] == ["5", "10"]


def test_the_command_refuses_what_is_out_of_range(capsys):
    assert main(["energy", "--model", "phong", "--exponent", "-3", "--angle", "10"]) == 2
    assert "from 0 to 1000000000000.0, found '-3'" in capsys.readouterr().err
