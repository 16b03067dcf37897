"""Plots as pictures, and what is told of one material by them."""

import numpy as np
import pytest
from lobefit import Measurement, _native, charts, closures, preview
from lobefit._native import InputError
from lobefit.albedo import excess
from lobefit.plot import Line, plot
from lobefit.plot_image import drawn
from lobefit.shown import evaluate, reflectance

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


@pytest.fixture(scope="session")
def measurement(truth):
    return Measurement.from_model(truth)


@pytest.fixture(scope="session")
def with_closures(table):
    """A record with two closures, of the measurement of `table`."""
    return closures(table, target="measured", count=2)


def places(image, color):
    """The rows and columns of the pixels that are about of this color, which others are not."""
    return np.argwhere(np.abs(image - color).max(2) < 0.25)


def test_a_line_is_where_its_numbers_are():
    lines = [
        Line("up", [0, 10], [0, 1], "#ff0000"),
        Line("level", [0, 10], [0.5, 0.5], "#0000ff", dashed=True),
    ]
    svg = plot(lines, "x", "y", x_ticks=(0, 5, 10))
    image = drawn(svg)
    rows, columns = places(image, RED).T
    # A straight line upward from the left: the further right, the further up (less the row).
    assert np.corrcoef(rows, columns)[0, 1] < -0.99
    middle = (rows.min() + rows.max()) / 2
    level, across = places(image, BLUE).T
    assert np.abs(level - middle).max() < 6
    # The dashes are a part of the line, from its one end to the other.
    assert across.min() < columns.min() + 30 and across.max() > columns.max() - 30
    covered = len(np.unique(across)) / (columns.max() - columns.min())
    assert 0.35 < covered < 0.65


def test_a_legend_stands_below():
    lines = [Line("first", [0, 1], [0, 1], "#ff0000"), Line("second", [0, 1], [1, 0], "#0000ff")]
    svg = plot(lines, "x", "y", x_ticks=(0, 1))
    plain, labelled = drawn(svg), drawn(svg, lines)
    assert labelled.shape[0] > plain.shape[0] and labelled.shape[1] == plain.shape[1]
    legend = labelled[plain.shape[0] :]
    assert len(places(legend, RED)) and len(places(legend, BLUE))


def test_f_is_that_which_cycles_shows(with_closures, measurement):
    shown = ("closures", with_closures.closures[0])
    angles = np.radians([[20.0, -20.0], [50.0, -40.0]])
    wi, wo = (np.stack([np.sin(a), 0 * a, np.cos(a)], 1) for a in angles.T)
    expected = evaluate(shown, wi, wo) / wi[:, 2:]
    assert np.allclose(reflectance(shown, wi, wo), expected)
    assert np.isnan(reflectance(shown, -wi, wo)).all()
    # The lobe is one that two closures come near to.
    assert reflectance(shown, wi, wo) == pytest.approx(measurement.evaluate(wi, wo), rel=0.2)


def test_the_error_of_pictures_is_that_of_the_record(with_closures, table):
    measurement = Measurement.read(str(table))
    entry = with_closures.closures[0]
    found = _native.picture_error(measurement, ("closures", entry))
    # The record's is of the same samples; curves are rounded on their way into it.
    assert found == pytest.approx(entry["error"], rel=1e-6)
    principled = with_closures.principled
    found = _native.picture_error(measurement, ("principled", principled))
    assert found == pytest.approx(principled["error"], rel=1e-6)
    black = {**with_closures.parameters, "diffuse": [0.0] * 3, "specular": [0.0] * 3}
    assert _native.picture_error(measurement, ("live", black)) == pytest.approx(1.0)


def test_the_error_map_is_blue_for_what_is_exact(with_closures, measurement, truth):
    image = charts.draw_error_map(with_closures, measurement, ("live", truth))
    far = {**truth, "diffuse": [3 * d for d in truth["diffuse"]]}
    other = charts.draw_error_map(with_closures, measurement, ("live", far))
    # Blue is the color of little error and red of much; the key beside has both in either map.
    cells = slice(0, image.shape[1] * 3 // 4)
    assert image[:, cells, 2].sum() > other[:, cells, 2].sum() * 1.2
    assert image[:, cells, 0].sum() < other[:, cells, 0].sum()


def test_charts_without_the_measurement(with_closures, record):
    shown = ("closures", with_closures.closures[0])
    assert charts.draw_error_map(with_closures, None, shown).shape[2] == 3
    with_file = charts.draw_lobe(with_closures, preview.measurement_of(with_closures), shown)
    without = charts.draw_lobe(with_closures, None, shown)
    assert without.shape[0] < with_file.shape[0]
    with pytest.raises(InputError, match="found neither"):
        charts.draw_error_map(record, None, ("live", record.parameters))


@pytest.mark.parametrize("incidence", [0.0, 45.0, 89.0])
def test_the_lobe_for_any_light(with_closures, measurement, incidence):
    image = charts.draw_lobe(
        with_closures, measurement, ("live", with_closures.parameters), incidence
    )
    assert np.isfinite(image).all()


def test_albedo_with_what_is_unknown():
    albedo = {
        "view_angle": [0.0, 45.0, 80.0],
        "measured": [[0.2, 0.1, 0.1], [0.3, 0.2, 0.2], [None, None, None]],
        "shown": [],
    }
    assert charts.draw_albedo(albedo).max() <= 1


def test_more_light_than_arrives_is_told():
    angles = [0.0, 60.0, 80.0]
    below = [[0.5, 0.5, 0.5], [0.9, 1.0, 0.9], [None, None, None]]
    above = [[0.5, 0.5, 0.5], [1.1, 1.25, 0.9], [None, 1.02, None]]
    assert excess(angles, below, above) == ""
    start = "The measurement reflects 125.0% of the light seen at 60 degrees"
    assert excess(angles, above) == f"{start}."
    assert excess(angles, above, below) == f"{start}, the material at most 100.0%."
    assert excess(angles, above, above) == f"{start}, the material at most 125.0%."


def test_compared_spheres(with_closures, measurement):
    shown = ("closures", with_closures.closures[0])
    spheres = preview.compared(measurement, shown, 32)
    assert list(spheres) == ["measured", "cycles", "difference"]
    assert all(sphere.shape == (32, 32, 3) for sphere in spheres.values())
    assert spheres["difference"].mean() < spheres["measured"].mean()
    assert list(preview.compared(None, shown, 32)) == ["cycles"]
    rendered = np.zeros((32 * preview.FINER_AT_ONCE,) * 2 + (3,), np.float32)
    assert preview.compared(measurement, shown, 32, rendered)["cycles"].max() == 0
