"""The fit against other ways to it."""

import csv
import io
from html.parser import HTMLParser

import numpy as np
import pytest
from lobefit import _native, methods, read
from lobefit.scatter import Point, scatter

# Bins that stand for all in these tests.
DRAWN = 2700


@pytest.fixture(scope="module")
def sample(table):
    """A known lobe under noise of 10 %."""
    values = np.array(read(table).values)
    noise = np.random.default_rng(1).standard_normal(values.shape)
    return _native.Measurement.from_values(values * (1 + 0.1 * noise).clip(0))


@pytest.fixture(scope="module")
def own(sample):
    return methods.run("polish", sample)


def test_scipy_has_the_derivatives_of_its_misfits(table, truth):
    pytest.importorskip("scipy", reason="scipy is absent")
    problem = methods._Problem(read(table), 30)
    x = problem.variables(truth | {"interpolation": 0.3, "ior": 2.2})
    jacobian = problem.jacobian(x)
    for variable in range(x.size):
        step = np.zeros(x.size)
        step[variable] = 1e-6 * max(1.0, abs(x[variable]))
        slope = (problem.misfit(x + step) - problem.misfit(x - step)) / (2 * step[variable])
        # A difference of two values is right to some 1e-16 / 1e-6 of these.
        scale = np.abs(slope).max() + 1e-3
        assert np.abs(jacobian[:, variable] - slope).max() < 1e-6 * scale


def test_misfits_of_the_truth_are_none(table, truth):
    problem = methods._Problem(read(table), DRAWN)
    x = problem.variables(truth)
    # Samples hold floats, right to 6e-8 of values of up to some 300 units of the median.
    measured = problem.misfit(np.zeros_like(x))
    assert (np.abs(problem.misfit(x)) <= 1e-7 * np.abs(measured)).all()
    assert problem.parameters(x)["exponent"] == pytest.approx(truth["exponent"])


@pytest.mark.parametrize("rival", ["ceres", "scipy"])
def test_a_rival_comes_to_the_error_of_the_fit(sample, own, rival):
    if rival == "scipy":
        pytest.importorskip("scipy", reason="scipy is absent")
    trial = methods.run(rival, sample, DRAWN)
    # Nine parameters take up some 9 / 8,100 of the error of 2,700 bins; three times is allowed.
    assert 0.9999 * own.l1 < trial.l1 < 1.0034 * own.l1
    assert trial.converged and trial.extrapolated
    assert trial.seconds_of_all == sample.bins["valid"] / trial.bins * trial.seconds
    # The brightest are drawn once and would be drawn twice.
    assert trial.bins == pytest.approx(DRAWN, rel=0.02)
    assert trial.passes >= trial.iterations


def test_parts_of_the_fit_cost_less_or_err_more(sample, own):
    part, joint, stages = (methods.run(name, sample) for name in ("subsample", "joint", "stages"))
    assert part.passes < own.passes and part.bins < own.bins
    assert joint.passes > own.passes
    # Of all bins there is one optimum, to the 1e-4 that the smoothing leaves.
    assert joint.l1 == pytest.approx(own.l1, rel=1e-4)
    assert part.l1 < 1.001 * own.l1 and stages.l1 > 0.9999 * own.l1
    assert not own.extrapolated and own.seconds_of_all == own.seconds


def test_the_table_has_a_line_for_every_method(own):
    (line,) = csv.DictReader(io.StringIO(methods.table({"red, and more": [own]})))
    assert line["material"] == "red, and more" and line["method"] == "polish"
    assert float(line["l1"]) == own.l1 and line["extrapolated"] == "False"


def test_a_wrong_number_of_bins_is_refused(sample):
    with pytest.raises(_native.InputError, match="bins: expected 0"):
        _native.fit_naively(sample, _native.best_start(sample), bins=-1)


class Texts(HTMLParser):
    """Where the text elements of an SVG stand."""

    def __init__(self):
        super().__init__()
        self.names, self._at = {}, None

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        named = tag == "text" and attributes.get("class") == "name"
        self._at = (float(attributes["x"]), float(attributes["y"])) if named else None

    def handle_data(self, data):
        if self._at:
            self.names[data] = self._at
            self._at = None


def test_labels_of_near_points_stand_apart():
    points = [Point(f"method {i}", "0.1 s", 0.1 + i / 100, 0.0, "#000") for i in range(4)]
    points.append(Point("slow", "1 min", 60, 5, "#000", estimated_from=0.6))
    texts = Texts()
    texts.feed(scatter(points, "seconds", "per cent", 0.01))
    assert set(texts.names) == {point.name for point in points}
    places = sorted(texts.names.values())
    for i, one in enumerate(places):
        for other in places[i + 1 :]:
            assert abs(one[0] - other[0]) > 50 or abs(one[1] - other[1]) >= 28
