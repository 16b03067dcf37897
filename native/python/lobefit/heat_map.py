"""Heat maps as inline SVG: an error for every step of two angles."""

import math
from collections.abc import Callable, Sequence
from html import escape

_SIDE, _LEFT, _TOP, _RIGHT, _BOTTOM = 240, 52, 8, 66, 44
_X_TICKS, _Y_TICKS = (0, 15, 30, 45, 60, 75, 90), (0, 2, 5, 10, 20, 40, 60, 90)
# From 1 % to 100 %, in equal steps of the logarithm; what is beyond takes the color of the end.
_COLORS = ((43, 92, 138), (111, 176, 181), (242, 230, 167), (229, 138, 60), (163, 29, 42))
_LOW, _HIGH = 0.01, 1.0
_LEGEND = (0.01, 0.03, 0.1, 0.3, 1.0)


def heat_map(
    theta_h: Sequence[float],
    theta_d: Sequence[float],
    errors: Sequence[Sequence[float | None]],
    describe: Callable[[int, int], str],
) -> str:
    """The relative errors of the steps between angles in degrees, a row for each of theta_h.

    theta_h runs upward as its square root, as the bins of a table do. A step without an error
    (None) is left empty; `describe` of row and column is shown when the cell is pointed at.
    """
    cells = [
        _cell(theta_d[column : column + 2], theta_h[row : row + 2], error, describe(row, column))
        for row, line in enumerate(errors)
        for column, error in enumerate(line)
        if error is not None
    ]
    size = f"0 0 {_LEFT + _SIDE + _RIGHT} {_TOP + _SIDE + _BOTTOM}"
    label = "relative error over theta_d and theta_h"
    return (
        f'<svg class="plot" viewBox="{size}" role="img" aria-label="{label}">'
        f"{''.join(cells)}{_axes()}{_key()}</svg>"
    )


def color_of(error: float) -> str:
    """The color of a relative error."""
    share = math.log(max(error, _LOW) / _LOW) / math.log(_HIGH / _LOW)
    place = min(share, 1.0) * (len(_COLORS) - 1)
    first = min(int(place), len(_COLORS) - 2)
    mixed = (
        round(a + (place - first) * (b - a))
        for a, b in zip(_COLORS[first], _COLORS[first + 1], strict=True)
    )
    return f"#{''.join(f'{level:02x}' for level in mixed)}"


def _x(theta_d: float) -> float:
    return _LEFT + theta_d / 90 * _SIDE


def _y(theta_h: float) -> float:
    return _TOP + (1 - math.sqrt(theta_h / 90)) * _SIDE


def _cell(across: Sequence[float], up: Sequence[float], error: float, text: str) -> str:
    left, right, low, high = _x(across[0]), _x(across[1]), _y(up[0]), _y(up[1])
    return (
        f'<rect x="{left:.1f}" y="{high:.1f}" width="{right - left:.1f}" '
        f'height="{low - high:.1f}" fill="{color_of(error)}" shape-rendering="crispEdges">'
        f"<title>{escape(text)}</title></rect>"
    )


def _axes() -> str:
    end = _TOP + _SIDE
    parts = [f'<path class="grid" fill="none" d="M{_LEFT} {_TOP}V{end}H{_LEFT + _SIDE}"/>']
    for tick in _X_TICKS:
        parts.append(f'<text x="{_x(tick):.1f}" y="{end + 15}" class="middle">{tick}</text>')
    for tick in _Y_TICKS:
        parts.append(f'<text x="{_LEFT - 6}" y="{_y(tick) + 4:.1f}" class="end">{tick}</text>')
    middle = _TOP + _SIDE / 2
    parts.append(
        f'<text x="{_LEFT + _SIDE / 2}" y="{end + 36}" class="middle">theta_d in degrees</text>'
        f'<text transform="translate(13 {middle}) rotate(-90)" class="middle">'
        "theta_h in degrees</text>"
    )
    return "".join(parts)


def _key() -> str:
    """The colors beside the map, with the errors that they stand for."""
    left, steps = _LEFT + _SIDE + 14, 48
    height = _SIDE / steps
    parts = []
    for step in range(steps):
        error = _LOW * (_HIGH / _LOW) ** ((step + 0.5) / steps)
        top = _TOP + _SIDE - (step + 1) * height
        parts.append(
            f'<rect x="{left}" y="{top:.1f}" width="10" height="{height:.1f}" '
            f'fill="{color_of(error)}" shape-rendering="crispEdges"/>'
        )
    for error in _LEGEND:
        share = math.log(error / _LOW) / math.log(_HIGH / _LOW)
        y = _TOP + (1 - share) * _SIDE + 4
        parts.append(f'<text x="{left + 15}" y="{y:.1f}">{error:.0%}</text>')
    return "".join(parts)
