"""The report: one page that needs nothing else, and a table."""

import csv
import io
import re
from html.parser import HTMLParser

from lobefit import report
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
