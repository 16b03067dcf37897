"""The report: one page that needs nothing else, and a table."""

import csv
import io
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from lobefit import _native, angles, fit, pictures, read, report
from lobefit.heat_map import color_of, heat_map
from lobefit.methods import Trial
from lobefit.pictures import Picture
from lobefit.plot import Line, plot


class Balance(HTMLParser):
    """Collects the elements that are opened and not closed."""

    void = frozenset({"meta", "img", "br"})

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attrs):
        if tag not in self.void:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_is_whole_and_needs_nothing_else(record, tmp_path):
    record.source["name"] = "<gold> & more"
    report.write(tmp_path / "out", [record, record], failures=["iron: it rusted"])
    page = (tmp_path / "out" / "index.html").read_text()
    parser = Balance()
    parser.feed(page)
    assert parser.open == []
    assert "<gold>" not in page and "&lt;gold&gt; &amp; more" in page
    assert "iron: it rusted" in page
    assert "the interpolation is at its bound" in page
    assert "<script" not in page
    assert not re.search(r"(src|href)=\"(?!data:|#)", page)


def test_the_table_has_a_line_for_every_stage(record):
    lines = list(csv.DictReader(io.StringIO(report.table([record]))))
    assert len(lines) == len(record.stages)
    assert float(lines[0]["relative_l1"]) == record.error["relative_l1"]["pooled"]
    assert [float(n) for n in lines[0]["diffuse"].split()] == record.parameters["diffuse"]
    assert lines[0]["stage"] == "polish"


def test_a_plot_parts_its_line_where_nothing_is_known():
    svg = plot([Line("one", [0, 1, 2, 3], [1.0, None, 2.0, 3.0], "#000")], "x", "y")
    (path,) = re.findall(r'class="curve" d="([^"]*)"', svg)
    assert path.count("M") == 2 and path.count("L") == 1


def test_a_plot_of_nothing_is_empty():
    assert plot([Line("one", [0, 1], [None, None], "#000")], "x", "y") == ""


def test_the_page_shows_curves_maps_and_intervals(table, tmp_path):
    record = fit(table, uncertainty=True)
    record.uncertainty["undetermined"] = ["ior"]
    page = report.page([record], {}, [], {}, {})
    parser = Balance()
    parser.feed(page)
    assert parser.open == []
    for incidence in angles.INCIDENCES:
        assert f"f in 1/sr over view angle in degrees, light at {incidence:g}" in page
    assert 'aria-label="relative error over theta_d and theta_h"' in page
    assert 'aria-label="relative L1 over view angle in degrees"' in page
    assert re.search(r'class="open">1\.\d+ to 1\.\d+ \?<', page)


def test_a_logarithmic_plot_leaves_out_what_has_no_logarithm():
    svg = plot([Line("one", [0, 1, 2, 3], [0.01, 0.0, 10.0, 100.0], "#000")], "x", "y", log=True)
    (path,) = re.findall(r'class="curve" d="([^"]*)"', svg)
    assert path.count("M") == 2 and path.count("L") == 1
    ticks = re.findall(r'class="end">([^<]*)<', svg)
    assert ticks == ["0.01", "0.1", "1", "10", "100"]


def test_a_heat_map_leaves_out_cells_without_an_error():
    drawn = heat_map([0, 45, 90], [0, 90], [[0.1], [None]], lambda row, column: f"{row} {column}")
    assert re.findall(r"<title>([^<]*)</title>", drawn) == ["0 0"]
    assert color_of(0.1) in drawn and color_of(5.0) == color_of(1.0) != color_of(0.5)


WAYS = [
    Picture("diffuse", None, None, 8e-7),
    Picture("principled", None, 0.2, 1.2e-6),
    Picture("measured", 1, 0.1, 1.1e-6),
    Picture("measured", 2, 0.05, 1.4e-6),
]


def test_pictures_are_plotted_by_error_and_cost(record, tmp_path):
    report.write(tmp_path, [record], ways={record.name: WAYS})
    page = (tmp_path / "index.html").read_text()
    assert 'aria-label="sphere error over ns a sample"' in page
    assert "measured 2: 0.05" in page and "was not measured" not in page
    lines = list(csv.DictReader((tmp_path / "pictures.csv").open()))
    assert [(line["kind"], line["closures"]) for line in lines] == [
        ("diffuse", ""),
        ("principled", ""),
        ("measured", "1"),
        ("measured", "2"),
    ]
    assert float(lines[3]["sphere_error"]) == 0.05
    assert float(lines[2]["principled_costs"]) == pytest.approx(1.1 / 1.2)


def test_without_blender_the_page_says_that_no_cost_was_measured(record, tmp_path):
    report.write(tmp_path, [record])
    page = (tmp_path / "index.html").read_text()
    assert page.count("was not measured") == 1 and "sphere error over" not in page
    assert not (tmp_path / "pictures.csv").exists()


TRIALS = [
    Trial("polish", 0.1, 0.2, 0.15, 1, 1000, 12, 9.0, True),
    Trial("stages", 0.102, 0.204, 0.5, 1, 1000, 10, 30.0, True),
    Trial("ceres", 0.1001, 0.2002, 0.9, 101, 10, 40, 120.0, True),
    Trial("scipy", 0.11, 0.22, 0.9, 101, 10, 40, 120.0, True),
]


def test_methods_are_plotted_by_error_and_run_time(record, tmp_path):
    report.write(tmp_path, [record], trials={record.name: TRIALS})
    page = (tmp_path / "index.html").read_text()
    parser = Balance()
    parser.feed(page)
    assert parser.open == []
    assert 'aria-label="L1 over the least, per cent over seconds"' in page
    assert " min, 606 times as long" in page and "90.9</td><td>extrapolated from 0.90" in page
    assert "+2.000 %" in page and "+0.100 %" in page
    # Drawn bins do not explain 10 %; the stages end at 2 % because that is where they lead.
    assert "40, did not converge" in page and "10, did not converge" not in page
    assert [line["method"] for line in csv.DictReader((tmp_path / "methods.csv").open())] == [
        "polish",
        "stages",
        "ceres",
        "scipy",
    ]


def test_without_trials_the_page_says_so(record, tmp_path):
    report.write(tmp_path, [record])
    page = (tmp_path / "index.html").read_text()
    assert page.count("were not tried") == 1
    assert not (tmp_path / "methods.csv").exists()


def test_every_kind_is_measured(all_models, monkeypatch):
    pytest.importorskip("bpy", reason="bpy is absent")
    monkeypatch.setattr(pictures, "COMPARED", (("measured", 1), ("lobe", 1)))
    record = pictures.with_closures(all_models[0])
    ways = pictures.measure(record)
    found = {(way.kind, way.count) for way in ways}
    others = {(kind, None) for kind in ("diffuse", "principled", "live")}
    assert found == others | set(pictures.COMPARED)
    assert all(way.seconds > 0 for way in ways)
    assert all((way.error is None) == (way.kind == pictures.FLOOR) for way in ways)


def test_closures_of_a_lost_measurement_are_not_asked_for(record):
    assert pictures.with_closures(record) is record


def test_a_sphere_error_is_a_part_of_the_light(table, truth):
    measurement = read(table)
    assert pictures.sphere_error(measurement, lambda wi, wo: np.zeros_like(wi)) == pytest.approx(1)
    own = pictures.sphere_error(
        measurement, lambda wi, wo: _native.evaluate_model(truth, wi, wo) * wi[:, 2:]
    )
    assert own < 0.01
