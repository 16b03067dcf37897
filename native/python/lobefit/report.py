"""The report: pictures, parameters, errors and run times of records, in one page and one table."""

import base64
import csv
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lobefit import alterations, angles, methods, picture, pictures, preview
from lobefit.alterations import Alteration
from lobefit.atomic import make_folder, write_bytes
from lobefit.inputs import Progress
from lobefit.methods import Trial
from lobefit.pictures import Picture
from lobefit.plot import Line, legend, plot
from lobefit.record import ERRORS, Fit, Record
from lobefit.scatter import Point, scatter

_COLORS = {
    "modified-phong": "#c2571a",
    "modified-blinn-phong": "#2a6fb0",
    "interpolated": "#2c8a4b",
}
_KINDS = {
    "measured": "#2c8a4b",
    "lobe": "#2a6fb0",
    "live": "#8a4bb0",
    "principled": "#c2571a",
    "diffuse": "#8b8f96",
}
_METHODS = {
    "polish": "#2c8a4b",
    "subsample": "#77b255",
    "joint": "#3f9c8c",
    "stages": "#8a4bb0",
    "ceres": "#2a6fb0",
    "scipy": "#c2571a",
}
_TERMS = {
    "half-vector": "#8a4bb0",
    "dot": "#2c8a4b",
    "difference": "#2a6fb0",
    "cross": "#c2571a",
    "exact": "#8b8f96",
}
_TERMS_EXPONENT = 100.0  # of the plots of their error
_LEAST_EXCESS = 0.01  # per cent of L1; methods that are closer to each other are equally good
_MOST_EXCESS = 1.0  # per cent; bins drawn for the slow methods do not explain more than this
_ERROR_TITLES = {
    "l1": "mean |f &minus; m|",
    "relative_l1": "relative L1",
    "relative_l1_80": "relative L1 below 80&deg;",
    "relative_l1_cosine": "relative L1, cosine-weighted",
}

_STYLE = """
:root { color-scheme: light dark; --ink: #1d1f23; --faint: #6a6f78; --line: #dfe2e6; --paper: #fff;
  --page: #f4f5f7 }
@media (prefers-color-scheme: dark) { :root { --ink: #e8e9eb; --faint: #9aa0a9; --line: #3a3d43;
  --paper: #202226; --page: #17181b } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--page);
  margin: 0 auto; padding: 2rem 1.5rem 4rem; max-width: 1240px }
h1 { font-size: 1.7rem; margin: 0 0 .2rem } h2 { font-size: 1.25rem; margin: 0 }
h3 { font-size: .95rem; margin: 1.4rem 0 .4rem } p { margin: .3rem 0 }
.faint { color: var(--faint) }
section { background: var(--paper); border: 1px solid var(--line); border-radius: 10px;
  padding: 1.2rem 1.4rem; margin-top: 1.4rem }
img { display: block; max-width: 100%; height: auto; border-radius: 6px; margin: .8rem 0 }
.wide { overflow-x: auto } .side { display: flex; flex-wrap: wrap; gap: 0 2rem }
.side > div { flex: 1 1 400px; max-width: 560px }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .9rem }
th { text-align: left; font-weight: 600 } td, th { padding: .22rem .9rem .22rem 0;
  border-bottom: 1px solid var(--line); vertical-align: top; white-space: nowrap }
tr.own td { font-weight: 600 } code { font-size: .85rem; overflow-wrap: anywhere }
.plot { width: 100%; height: auto; overflow: visible }
.plot text { fill: var(--faint); font-size: 11px; paint-order: stroke; stroke: var(--paper);
  stroke-width: 3px; stroke-linejoin: round }
.plot .middle { text-anchor: middle } .plot .end { text-anchor: end }
.plot .name { fill: var(--ink); font-weight: 600 }
.grid { stroke: var(--line) } .curve { fill: none; stroke-width: 2 }
.legend span { margin-right: 1.1rem; font-size: .85rem; white-space: nowrap;
  display: inline-block } .legend svg { margin-right: .4rem }
.maps > div { flex: 0 1 358px } .open { color: #b8741a }
.warning { border-left: 3px solid #d9902f; padding-left: .7rem }
"""


@dataclass(frozen=True)
class Rendering:
    """What Cycles made of a record's material: radiance as `preview.row` takes it, and seconds."""

    pixels: NDArray[np.float32]
    seconds: float


def write(
    folder: str | os.PathLike[str],
    records: list[Record],
    renderings: Mapping[str, Rendering] | None = None,
    failures: Iterable[str] = (),
    ways: Mapping[str, Sequence[Picture]] | None = None,
    trials: Mapping[str, Sequence[Trial]] | None = None,
    terms: Sequence[Alteration] = (),
    progress: Progress | None = None,
) -> None:
    """Writes index.html, report.csv and, of records with `ways` or `trials`, a table of these.

    `renderings`, `ways` to show (see `pictures.measure`) and `trials` of methods (see
    `methods.compare`) are found by a record's name; the tables are pictures.csv and methods.csv.
    `terms`, cheaper than Phong's (see `alterations.measure`), end the page; alterations.csv.
    `progress` is called before each record is drawn, and an exception out of it ends the writing.
    """
    text = page(records, renderings or {}, failures, ways or {}, trials or {}, terms, progress)
    place = make_folder(folder)
    write_bytes(place / "report.csv", table(records).encode())
    if ways:
        write_bytes(place / "pictures.csv", pictures.table(ways).encode())
    if trials:
        write_bytes(place / "methods.csv", methods.table(trials).encode())
    if terms:
        write_bytes(place / "alterations.csv", alterations.table(terms).encode())
    write_bytes(place / "index.html", text.encode())


def table(records: list[Record]) -> str:
    """A line for every stage of every fit, as CSV: errors of the fit, run time of the stage."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    parameters = ("diffuse", "specular", "exponent", "interpolation", "ior")
    head = ["material", "sha256", "model", "norm", "schedule", *parameters, *ERRORS]
    writer.writerow([*head, "stage", "stage_l1", "stage_seconds", "iterations", "total_seconds"])
    for record in records:
        for model, fit in record.fits.items():
            values = [record.name, record.source["sha256"], model, record.norm, record.schedule]
            values += [_plain(fit.parameters[name]) for name in parameters]
            values += [fit.error[name]["pooled"] for name in ERRORS]
            for stage in fit.stages:
                cells = [stage[key] for key in ("name", "l1", "seconds", "iterations")]
                writer.writerow([*values, *cells, fit.seconds["total"]])
    return text.getvalue()


def page(
    records: list[Record],
    renderings: Mapping[str, Rendering],
    failures: Iterable[str],
    ways: Mapping[str, Sequence[Picture]],
    trials: Mapping[str, Sequence[Trial]],
    terms: Sequence[Alteration] = (),
    progress: Progress | None = None,
) -> str:
    """The whole page; it refers to nothing outside of itself."""

    def section(index: int, record: Record) -> str:
        if progress:
            progress(index / len(records), f"Drawing {record.name}")
        name = record.name
        return _section(
            index, record, renderings.get(name), ways.get(name, ()), trials.get(name, ())
        )

    body = [
        "<h1>Measured materials as Phong lobes</h1>",
        '<p class="faint">Fits of the models of Nielsen et al., &ldquo;Addressing Grazing Angle '
        "Reflections in Phong Models&rdquo;. Spheres under a light from the upper right and one "
        "from behind at the lower left, each row at one exposure.</p>",
        *(f'<p class="warning">{escape(failure)}</p>' for failure in failures),
        _overview(records),
        *(section(index, record) for index, record in enumerate(records)),
        *([_terms(terms)] if terms else []),
    ]
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    title = "<title>Lobefit report</title>"
    return (
        f'<!DOCTYPE html><html lang="en"><head>{head}{title}<style>{_STYLE}</style></head>'
        f"<body>{''.join(body)}</body></html>\n"
    )


def _overview(records: list[Record]) -> str:
    rows = [
        [
            f'<a href="#m{index}">{escape(record.name)}</a>',
            preview.TITLES[record.model],
            *(_number(record.error[name]["pooled"]) for name in ERRORS[1:]),
            f"{sum(fit.seconds['total'] for fit in record.fits.values()):.2f}",
        ]
        for index, record in enumerate(records)
    ]
    head = ["material", "best model", *(_ERROR_TITLES[name] for name in ERRORS[1:]), "seconds"]
    return f"<section><h2>Overview</h2>{_table(head, rows)}</section>"


def _section(
    index: int,
    record: Record,
    rendering: Rendering | None,
    ways: Sequence[Picture],
    trials: Sequence[Trial],
) -> str:
    return "".join(
        [
            f'<section id="m{index}"><h2>{escape(record.name)}</h2>',
            _about(record),
            *(f'<p class="warning">{escape(text)}</p>' for text in record.warnings),
            _spheres(record, rendering),
            "<h3>Parameters</h3>",
            _parameters(record),
            "<h3>Errors</h3>",
            _errors(record),
            "<h3>Error against run time of the fit</h3>",
            _trials(trials),
            '<div class="side"><div><h3>Error after each stage</h3>',
            _run_time_plot(record),
            "</div><div><h3>Albedo by view angle</h3>",
            _albedo_plot(record),
            "</div></div>",
            angles.section(record, _COLORS),
            "<h3>Error of pictures against their cost</h3>",
            _pictures(ways),
            "<h3>Seconds by stage</h3>",
            _stages(record),
            _facts(record, rendering),
            "</section>",
        ]
    )


def _about(record: Record) -> str:
    bins = record.source["bins"]
    return (
        f'<p class="faint">{escape(record.source["format"])}, {bins["valid"]:,} valid bins, '
        f"{bins['below_horizon']:,} below the horizon, {bins['negative']:,} negative, "
        f"{bins['non_finite']:,} not finite; norm {record.norm}, schedule {record.schedule}</p>"
    )


def _spheres(record: Record, rendering: Rendering | None) -> str:
    measurement = preview.measurement_of(record)
    pixels = rendering.pixels if rendering else None
    sheet = preview.sheet([preview.row(record, measurement, rendered=pixels)])
    source = base64.b64encode(picture.png(sheet)).decode()
    caption = escape(f"{record.name}: measurement and fits")
    return f'<img alt="{caption}" src="data:image/png;base64,{source}">'


def _parameters(record: Record) -> str:
    head = ["model", "diffuse", "specular", "exponent", "interpolation", "IOR", "converged"]
    rows = []
    for model, fit in record.fits.items():
        values = (fit.parameters[name] for name in ("diffuse", "specular", "exponent"))
        rest = (fit.parameters[name] for name in ("interpolation", "ior"))
        yes = "yes" if fit.converged else "no"
        rows.append([preview.TITLES[model], *map(_numbers, values), *map(_number, rest), yes])
    table = _table(head, rows, _own(record))
    return table + _intervals(record) if record.uncertainty else table


def _intervals(record: Record) -> str:
    """A table with a row for every variable and a column for every fit."""
    names = list(dict.fromkeys(name for fit in record.fits.values() for name in fit.intervals))
    head = ["variable", *(preview.TITLES[model] for model in record.fits)]
    rows = [[name, *(_interval(fit, name) for fit in record.fits.values())] for name in names]
    confidence = record.uncertainty["confidence"]
    return (
        f"<h3>Intervals of {confidence:.0%} of the parameters</h3>"
        f"{_table(head, rows)}"
        '<p class="faint">From fits without each of '
        f"{record.uncertainty['blocks']} parts of the data. What is "
        '<span class="open">marked ?</span> is undetermined: within no factor of 2, an '
        "interpolation within no half of its range.</p>"
    )


def _interval(fit: Fit, variable: str) -> str:
    if variable not in fit.intervals:
        return ""
    text = " to ".join(f"{float(f'{end:.3g}'):g}" for end in fit.intervals[variable])
    if variable in fit.uncertainty["undetermined"]:
        return f'<span class="open">{text} ?</span>'
    return text


def _errors(record: Record) -> str:
    rows = [
        [preview.TITLES[model], *(_number(fit.error[name]["pooled"]) for name in ERRORS)]
        for model, fit in record.fits.items()
    ]
    return _table(["model", *_ERROR_TITLES.values()], rows, _own(record))


def _stages(record: Record) -> str:
    rows = []
    for model, fit in record.fits.items():
        rows.append([preview.TITLES[model], "read", f"{fit.seconds['read']:.3f}", "", ""])
        for stage in fit.stages:
            cells = [f"{stage['seconds']:.3f}", str(stage["iterations"]), _number(stage["l1"])]
            rows.append(["", escape(stage["name"]), *cells])
        if fit.uncertainty:
            rows.append(["", "uncertainty", f"{fit.uncertainty['seconds']:.3f}", "", ""])
        rows.append(["", "total", f"{fit.seconds['total']:.3f}", "", ""])
    return _table(["model", "stage", "seconds", "iterations", "error after it"], rows)


def _run_time_plot(record: Record) -> str:
    lines = [_run_time(model, fit) for model, fit in record.fits.items()]
    return plot(lines, "seconds since the start", "error in the norm") + legend(lines)


def _run_time(model: str, fit: Fit) -> Line:
    ends = list(accumulate((stage["seconds"] for stage in fit.stages), initial=fit.seconds["read"]))
    dots = [
        f"{stage['name']}: {_number(stage['l1'])} after {end:.3f} s"
        for stage, end in zip(fit.stages, ends[1:], strict=True)
    ]
    errors = [stage["l1"] for stage in fit.stages]
    return Line(preview.TITLES[model], ends[1:], errors, _COLORS[model], dots=dots)


def _trials(trials: Sequence[Trial]) -> str:
    if not trials:
        return '<p class="faint">Other ways to the fit were not tried.</p>'
    least = min(trial.l1 for trial in trials)
    own = next(trial.seconds for trial in trials if trial.method == "polish")
    excess = {trial.method: 100 * (trial.l1 / least - 1) if least else 0.0 for trial in trials}
    failed = {
        trial.method
        for trial in trials
        if not trial.converged or (trial.extrapolated and excess[trial.method] > _MOST_EXCESS)
    }
    points = [
        Point(
            methods.TITLES[trial.method],
            _duration(trial.seconds_of_all)
            + (f", {trial.seconds_of_all / own:.0f} times as long" if trial.extrapolated else "")
            + (", did not converge" if trial.method in failed else ""),
            trial.seconds_of_all,
            excess[trial.method],
            _METHODS[trial.method],
            large=trial.method == "polish",
            estimated_from=trial.seconds if trial.extrapolated else None,
        )
        for trial in trials
    ]
    head = ["method", "L1 over the least", "relative L1", "seconds", "which are", "of Lobefit"]
    rows = [
        [
            methods.TITLES[trial.method],
            f"+{excess[trial.method]:.3f} %",
            _number(trial.relative_l1),
            _short(trial.seconds_of_all),
            f"extrapolated from {_short(trial.seconds)}" if trial.extrapolated else "measured",
            _short(trial.seconds_of_all / own),
            f"{trial.bins:,}",
            f"{trial.iterations}{', did not converge' if trial.method in failed else ''}",
            f"{trial.passes:.3g}",
        ]
        for trial in trials
    ]
    shown = scatter(points, "seconds", "L1 over the least, per cent", _LEAST_EXCESS)
    note = (
        '<p class="faint">Nine parameters of the interpolated model with Fresnel, fitted by plain '
        "L1 in this run, reading not counted; the error is that of all bins. Ceres and scipy begin "
        "at the best start of Lobefit's scan, which costs them nothing. They fit some "
        f"{methods.DRAWN:,} bins, drawn like those of Lobefit's own subsample and weighted so that "
        "their optimum is that of all bins to about .1 %; the time of all (the ring) is "
        "extrapolated by the number of bins from the time they took (the dot). One that still ends "
        f"more than {_MOST_EXCESS:g} % above the least did not converge.</p>"
    )
    counts = ["bins at the end", "iterations", "passes"]
    return f"{shown}{note}{_table([*head, *counts], rows)}"


def _duration(seconds: float) -> str:
    return f"{_short(seconds)} s" if seconds < 60 else f"{_short(seconds / 60)} min"


def _short(value: float) -> str:
    """Two digits after the point, or none where three stand before it."""
    return f"{value:.{2 if value < 10 else 1 if value < 100 else 0}f}"


def _pictures(ways: Sequence[Picture]) -> str:
    if not ways:
        return (
            '<p class="faint">What pictures cost was not measured: that is done by rendering, and '
            "Blender's Python module (bpy) was not at hand.</p>"
        )
    lines = [
        _line(kind, [way for way in ways if way.kind == kind and way.error is not None])
        for kind in _KINDS
    ]
    floor = next(way.seconds for way in ways if way.kind == pictures.FLOOR) * 1e9
    highest = max((y for line in lines for y in line.y if y is not None), default=0.0)
    mark = Line("plain diffuse", [floor, floor], [0.0, highest], _KINDS[pictures.FLOOR], True)
    shown = [line for line in lines if line.x] + [mark]
    head = ["material", "specular closures", "sphere error", "ns a sample", "of Principled"]
    unit = next(way.seconds for way in ways if way.kind == pictures.LANDMARK)
    rows = [
        [
            way.kind,
            "" if way.count is None else str(way.count),
            _number(way.error),
            f"{way.seconds * 1e9:.0f}",
            f"{way.seconds / unit:.2f}",
        ]
        for way in ways
    ]
    return (
        f'<div class="side"><div>{plot(shown, "ns a sample", "sphere error")}{legend(shown)}'
        '<p class="faint">Processor time of a camera sample under a constant world, measured in '
        "this run. Numbers at the points count specular closures. Errors are those of the record "
        "for what was fitted to the measurement, and of pictures at 16 light angles for lobe and "
        f"live.</p></div><div>{_table(head, rows)}</div></div>"
    )


def _line(kind: str, ways: Sequence[Picture]) -> Line:
    counts = ["" if way.count is None else str(way.count) for way in ways]
    return Line(
        "best-fit Principled" if kind == pictures.LANDMARK else kind,
        [way.seconds * 1e9 for way in ways],
        [way.error for way in ways],
        _KINDS[kind],
        dots=[
            f"{kind} {count}: {_number(way.error)}" for way, count in zip(ways, counts, strict=True)
        ],
        marks=counts,
    )


def _terms(terms: Sequence[Alteration]) -> str:
    exponents = list(dict.fromkeys(each.exponent for each in terms))
    shown = [each for each in terms if each.exponent == _TERMS_EXPONENT]
    rows = [
        [
            escape(alterations.TITLES[each.term]),
            "" if each.gamma is None else str(each.gamma),
            *(
                _term_error(other)
                for other in terms
                if (other.term, other.gamma) == (each.term, each.gamma)
            ),
            f"{each.short:.4f}",
            f"{each.one_by_one:.2f}",
            f"{each.in_lanes:.2f}",
        ]
        for each in shown
    ]
    head = ["term", "gamma", *(f"s = {s:g}" for s in exponents), "short normals", "ns", "lanes ns"]
    one_by_one, in_lanes = (
        [_term_line(term, shown, way) for term in _TERMS] for way in ("one_by_one", "in_lanes")
    )
    return (
        "<section><h2>Cheaper alterations of Phong's term</h2>"
        '<p class="faint">Worst difference to max(R.V, 0)^s over the pixels of a sphere, of half '
        "vectors (s times 4) and of (1 - s/gamma lambda)^gamma for three lambdas; numbers at the "
        "points are gamma. In bold what an 8-bit picture does not show. Short normals are 1 % too "
        f"short. Plots, short normals and nanoseconds, measured in this run, are for s = "
        f"{_TERMS_EXPONENT:g}.</p>"
        f'<div class="side"><div><h3>One by one</h3>{_term_plot(one_by_one)}</div>'
        f"<div><h3>In lanes</h3>{_term_plot(in_lanes)}</div></div>"
        f"{_table(head, rows)}</section>"
    )


def _term_error(term: Alteration) -> str:
    hidden = term.worst < alterations.STEP
    return f"<b>{term.worst:.4f}</b>" if hidden else f"{term.worst:.4f}"


def _term_line(term: str, shown: Sequence[Alteration], way: str) -> Line:
    found = [each for each in shown if each.term == term]
    times, errors = [getattr(each, way) for each in found], [each.worst for each in found]
    title, color = alterations.TITLES[term], _TERMS[term]
    if term == "exact":
        # It has no error: a line where it stands in time.
        ends = [alterations.STEP, max(each.worst for each in shown)]
        return Line(title, times * 2, ends, color, True)
    gammas = [str(each.gamma or "") for each in found]
    # The points of the difference stand beside those of the dot product.
    marks = [] if term == "difference" else gammas
    return Line(title, times, errors, color, dots=gammas, marks=marks)


def _term_plot(lines: Sequence[Line]) -> str:
    return plot(lines, "ns an evaluation", "worst error", log=True) + legend(lines)


def _albedo_plot(record: Record) -> str:
    albedos = {kind: record.albedo[kind] for kind in ("measured", "model")}
    lines = angles.albedo_lines(record.albedo["view_angle"], albedos)
    return angles.albedo_plot(lines) + legend(lines)


def _facts(record: Record, rendering: Rendering | None) -> str:
    machine = record.machine
    certainty = record.certainty
    facts = {
        "Certainty": f"{certainty['agree']} of {certainty['starts']} starts agree",
        "Machine": f"{machine['processor']}, {machine['threads']} threads, {machine['system']}",
        "Source": f"SHA-256 {record.source['sha256'] or 'unknown'}",
    }
    if rendering:
        pixels = " x ".join(map(str, rendering.pixels.shape[:2]))
        facts["Rendering"] = f"{rendering.seconds:.2f} s for {pixels} pixels with Cycles"
    lines = [f"<p><b>{escape(key)}</b> {escape(value)}</p>" for key, value in facts.items()]
    return f"<h3>How it was made</h3>{''.join(lines)}<p><code>{escape(record.command())}</code></p>"


def _table(head: list[str], rows: list[list[str]], own: int | None = None) -> str:
    """A table of HTML cells; the row `own` is that of the record's own model."""
    top = "".join(f"<th>{cell}</th>" for cell in head)
    body = "".join(
        f"<tr{' class=own' if index == own else ''}>"
        + "".join(f"<td>{cell}</td>" for cell in row)
        + "</tr>"
        for index, row in enumerate(rows)
    )
    return f'<div class="wide"><table><tr>{top}</tr>{body}</table></div>'


def _own(record: Record) -> int:
    return list(record.fits).index(record.model)


def _number(value: float | None) -> str:
    return "&ndash;" if value is None else f"{value:.5g}"


def _numbers(values: Any) -> str:
    return ", ".join(map(_number, values)) if isinstance(values, list) else _number(values)


def _plain(values: Any) -> Any:
    return " ".join(map(repr, values)) if isinstance(values, list) else values
