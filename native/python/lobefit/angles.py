"""How a fit goes with the angles, for the report: curves, and where the error stands."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lobefit import _native, preview
from lobefit.heat_map import heat_map
from lobefit.plot import Line, legend, plot
from lobefit.record import Fit, Record

# Of the light, in degrees: from where a surface is mostly looked at to grazing light.
INCIDENCES = (15.0, 45.0, 65.0, 80.0)

_VIEWS = np.arange(-89.0, 90.0)
# Around the mirror direction the highlight of polished metal is narrower than a step of these.
_NEAR_MIRROR = np.array([0.1, 0.25, 0.5, 0.75])
_INK = "var(--ink)"
_CHANNELS = (("red", "#c8402f"), ("green", "#3b8f3e"), ("blue", "#3166c4"))

Reflectance = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


def section(record: Record, colors: Mapping[str, str]) -> str:
    """HTML of the plots of a record, its models in these colors."""
    parts = ["<h3>In the plane of incidence</h3>", _curves(record, colors)]
    fits = {model: fit for model, fit in record.fits.items() if fit.error_by_angle}
    if fits:
        maps = [
            f"<div><p>{preview.TITLES[model]}</p>"
            f"{error_map(fit.error_by_angle['half_difference'])}</div>"
            for model, fit in fits.items()
        ]
        views = [_by_view(model, fit, colors[model]) for model, fit in fits.items()]
        parts += [
            "<h3>Error by half and difference angle</h3>",
            f'<div class="side maps">{"".join(maps)}</div>',
            '<p class="faint">Relative L1 of the bins of each step, all weighing alike. Point at a '
            "cell for its share of all misfit; steps below the horizon are empty.</p>",
            '<div class="side"><div><h3>Error by view angle</h3>',
            plot(views, "view angle in degrees", "relative L1", x_ticks=range(0, 91, 15)),
            legend(views),
            '<p class="faint">Cosine-weighted, over all lights.</p></div></div>',
        ]
    return "".join(parts)


def _curves(record: Record, colors: Mapping[str, str]) -> str:
    measurement = preview.measurement_of(record)
    curves: dict[str, Reflectance] = {"measured": measurement.evaluate} if measurement else {}
    for model, fit in record.fits.items():
        curves[model] = partial(_native.evaluate_model, fit.parameters)
    plots, lines = [], []
    for incidence in INCIDENCES:
        lines = plane_lines(curves, incidence, colors)
        plots.append(f"<div>{plane_plot(lines, incidence)}</div>")
    return (
        f'<div class="side">{"".join(plots)}</div>{legend(lines)}<p class="faint">Mean of the '
        "three channels; the mirror direction is at the positive angle of the light.</p>"
    )


def plane_lines(
    curves: Mapping[str, Reflectance], incidence: float, colors: Mapping[str, str]
) -> list[Line]:
    """The mean of f's channels over the view angles in the plane of a light at `incidence` degrees.

    `curves` tells f by the columns of `preview.TITLES`; each has the color of its column.
    """
    near = np.concatenate([incidence - _NEAR_MIRROR, incidence + _NEAR_MIRROR])
    views = np.sort(np.concatenate([_VIEWS, near]))
    views = views[np.abs(views) < 90]
    viewers = _in_plane(views)
    lights = np.broadcast_to(_in_plane(np.array([-incidence])), viewers.shape)
    return [
        Line(
            preview.TITLES[name],
            views,
            _known(f(lights, viewers)),
            colors.get(name, _INK),
            name != "measured",
        )
        for name, f in curves.items()
    ]


def plane_plot(lines: Sequence[Line], incidence: float, **options: Any) -> str:
    """An SVG of what `plane_lines` gives; `options` are those of `plot`."""
    title = f"view angle in degrees, light at {incidence:g}"
    return plot(lines, title, "f in 1/sr", x_ticks=range(-90, 91, 30), log=True, **options)


def _in_plane(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors at these angles in degrees from the normal."""
    radians = np.radians(angles)
    return np.stack([np.sin(radians), np.zeros_like(radians), np.cos(radians)], -1)


def _known(f: NDArray[np.float64]) -> list[float | None]:
    return [float(mean) if mean > 0 else None for mean in f.mean(-1)]


def _ratio(misfit: float, measured: float) -> float | None:
    return misfit / measured if measured > 0 else None


def error_map(parts: Mapping[str, Any]) -> str:
    """A heat map of `half_difference` of a record's `error_by_angle`, or of what is like it."""
    theta_h, theta_d = parts["theta_h"], parts["theta_d"]
    errors = [
        [_ratio(*sums) for sums in zip(*rows, strict=True)]
        for rows in zip(parts["misfit"], parts["measured"], strict=True)
    ]
    whole = sum(map(sum, parts["misfit"])) or 1.0

    def describe(row: int, column: int) -> str:
        return (
            f"theta_h {theta_h[row]:.3g} to {theta_h[row + 1]:.3g}, "
            f"theta_d {theta_d[column]:g} to {theta_d[column + 1]:g} degrees: "
            f"relative L1 {errors[row][column]:.3g}, "
            f"{parts['misfit'][row][column] / whole:.2%} of all misfit"
        )

    return heat_map(theta_h, theta_d, errors, describe)


def albedo_lines(
    view_angles: Sequence[float], albedos: Mapping[str, Sequence[Sequence[float | None]]]
) -> list[Line]:
    """The albedo of each channel over the view angle, by what it is of; the last is dashed."""
    last = list(albedos)[-1]
    return [
        Line(f"{kind}, {channel}", view_angles, [rgb[index] for rgb in rows], color, kind == last)
        for kind, rows in albedos.items()
        for index, (channel, color) in enumerate(_CHANNELS)
    ]


def albedo_plot(lines: Sequence[Line], **options: Any) -> str:
    """An SVG of what `albedo_lines` gives; `options` are those of `plot`."""
    return plot(lines, "view angle in degrees", "albedo", x_ticks=range(0, 91, 15), **options)


def _by_view(model: str, fit: Fit, color: str) -> Line:
    parts = fit.error_by_angle["view"]
    ends = parts["view_angle"]
    middles = [(low + high) / 2 for low, high in itertools.pairwise(ends)]
    errors = [_ratio(*sums) for sums in zip(parts["misfit"], parts["measured"], strict=True)]
    dots = [
        f"{preview.TITLES[model]}, {low:g} to {high:g} degrees: "
        + ("nothing measured" if error is None else f"{error:.3g}")
        for (low, high), error in zip(itertools.pairwise(ends), errors, strict=True)
    ]
    return Line(preview.TITLES[model], middles, errors, color, dashed=True, dots=dots)
