"""Plots as inline SVG, as much of a plotting library as the report needs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

_WIDTH, _HEIGHT = 460, 250
_LEFT, _RIGHT, _TOP, _BOTTOM = 58, 14, 14, 44
_DECADES = 6  # of a logarithmic axis
_DASH, _SPACE = 5, 7
_SHIFT = (_DASH + _SPACE) / 3  # of the dashes of a line from those of the line before


@dataclass(frozen=True)
class Line:
    """One curve; a point with a missing (None) y parts it."""

    label: str
    x: Sequence[float]
    y: Sequence[float | None]
    color: str
    dashed: bool = False
    dots: Sequence[str] = ()  # what each point is, shown when it is pointed at
    marks: Sequence[str] = ()  # a word or number beside each point


@dataclass(frozen=True)
class _Scale:
    """Where a value stands on an axis, from 0 at its first tick to 1 at its end."""

    ticks: Sequence[float]
    end: float
    log: bool = False

    def share(self, value: float) -> float:
        low, high, at = self.ticks[0], self.end, value
        if self.log:
            low, high, at = (math.log10(number) for number in (low, high, at))
        return (at - low) / ((high - low) or 1.0)

    def holds(self, value: float) -> bool:
        return not self.log or value >= self.ticks[0]


def plot(
    lines: Sequence[Line],
    x_title: str,
    y_title: str,
    *,
    x_ticks: Sequence[float] = (),
    log: bool = False,
    height: int = _HEIGHT,
) -> str:
    """The lines over common axes, as an SVG element `height` units high.

    The x axis begins and ends with `x_ticks`, and goes from 0 to a round number without them. The
    y axis is linear from 0, or logarithmic over at most `_DECADES`, below which lines are parted.
    Dashed lines are shifted along themselves, so that of those that coincide each is seen.
    """
    known = [
        (x, y)
        for line in lines
        for x, y in zip(line.x, line.y, strict=True)
        if y is not None and (y > 0 or not log)
    ]
    if not known:
        return ""
    x_ticks = x_ticks or _ticks(max(x for x, _ in known))
    x_scale = _Scale(x_ticks, x_ticks[-1])
    heights = [y for _, y in known]
    y_ticks = _decades(min(heights), max(heights)) if log else _ticks(max(heights))
    axes = _Axes(x_scale, _Scale(y_ticks, y_ticks[-1], log), height)
    drawn = axes.grid() + "".join(axes.curve(line, index) for index, line in enumerate(lines))
    return framed(drawn, x_title, y_title, _WIDTH, height)


def framed(drawn: str, x_title: str, y_title: str, width: int, height: int) -> str:
    """What is drawn between the axes as an SVG element with the titles of the axes."""
    return (
        f'<svg class="plot" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="{escape(y_title)} over {escape(x_title)}">{drawn}'
        f'<text x="{(_LEFT + width - _RIGHT) / 2}" y="{height - 6}" class="middle">'
        f"{escape(x_title)}</text>"
        f'<text transform="translate(13 {(_TOP + height - _BOTTOM) / 2}) rotate(-90)" '
        f'class="middle">{escape(y_title)}</text></svg>'
    )


def legend(lines: Sequence[Line]) -> str:
    """The labels of the lines beside a piece of each."""
    keys = (
        f'<span><svg width="26" height="10"><line x1="1" y1="5" x2="25" y2="5" '
        f'stroke="{line.color}" stroke-width="2"{_dashes(line)}/></svg>{escape(line.label)}</span>'
        for line in lines
    )
    return f'<p class="legend">{"".join(keys)}</p>'


class _Axes:
    def __init__(self, x: _Scale, y: _Scale, height: int) -> None:
        self._x, self._y, self._height = x, y, height

    def _place(self, x: float, y: float) -> tuple[float, float]:
        return (
            _LEFT + self._x.share(x) * (_WIDTH - _LEFT - _RIGHT),
            self._height - _BOTTOM - self._y.share(y) * (self._height - _TOP - _BOTTOM),
        )

    def grid(self) -> str:
        parts = []
        for tick in self._y.ticks:
            x, y = self._place(self._x.ticks[0], tick)
            parts.append(f'<path class="grid" d="M{x:.1f} {y:.1f}H{_WIDTH - _RIGHT}"/>')
            parts.append(f'<text x="{x - 6:.1f}" y="{y + 4:.1f}" class="end">{tick:g}</text>')
        for tick in self._x.ticks:
            x, y = self._place(tick, self._y.ticks[0])
            parts.append(f'<text x="{x:.1f}" y="{y + 16:.1f}" class="middle">{tick:g}</text>')
        return "".join(parts)

    def curve(self, line: Line, index: int) -> str:
        path, pen_down, dots, marks = [], False, [], []
        for point, (x, y) in enumerate(zip(line.x, line.y, strict=True)):
            if y is None or not self._y.holds(y):
                pen_down = False
                continue
            at = self._place(x, y)
            path.append(f"{'L' if pen_down else 'M'}{at[0]:.1f} {at[1]:.1f}")
            pen_down = True
            if line.dots:
                dots.append(
                    f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="3.5" fill="{line.color}">'
                    f"<title>{escape(line.dots[point])}</title></circle>"
                )
            if line.marks:
                # At the right edge there is no room on the right.
                side, shift = ("end", -7) if at[0] > 0.8 * _WIDTH else ("start", 7)
                marks.append(
                    f'<text x="{at[0] + shift:.1f}" y="{at[1] - 5:.1f}" text-anchor="{side}">'
                    f"{escape(line.marks[point])}</text>"
                )
        offset = f' stroke-dashoffset="{_SHIFT * index:.2f}"' if line.dashed else ""
        stroke = f'stroke="{line.color}"{_dashes(line)}{offset}'
        return f'<path class="curve" d="{"".join(path)}" {stroke}/>' + "".join(dots + marks)


def _dashes(line: Line) -> str:
    return f' stroke-dasharray="{_DASH} {_SPACE}"' if line.dashed else ""


def _decades(low: float, high: float) -> list[float]:
    """Powers of ten that hold both numbers, or the upper ones of these."""
    top = math.ceil(math.log10(high))
    return [
        10.0**power for power in range(max(math.floor(math.log10(low)), top - _DECADES), top)
    ] + [10.0**top]


def _ticks(high: float) -> list[float]:
    """Some five round numbers from 0 whose last is at least `high`."""
    high = max(high, 1e-12)
    power = 10.0 ** math.floor(math.log10(high / 4))
    step = next(factor for factor in (1, 2, 2.5, 5, 10) if factor * power * 5 >= high) * power
    return [round(index * step, 12) for index in range(math.ceil(high / step) + 1)]
