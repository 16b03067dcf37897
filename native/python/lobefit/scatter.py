"""Named points over logarithmic axes as inline SVG."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

from lobefit.plot import framed

_WIDTH, _HEIGHT = 920, 340
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 24, 26, 44
_LETTER, _LINE = 6.1, 14  # of a label, about
_RADIUS, _LARGE = 5, 8


@dataclass(frozen=True)
class Point:
    """A point with a name and a remark beside it.

    With `estimated_from` its x was reckoned from a measurement at that one: the two are joined.
    """

    name: str
    remark: str
    x: float
    y: float
    color: str
    large: bool = False
    estimated_from: float | None = None


def scatter(points: Sequence[Point], x_title: str, y_title: str, floor: float) -> str:
    """The points (x > 0) as an SVG element; what is lower than `floor` stands on the floor."""
    scene = _Scene(points, floor)
    drawn = [scene.grid()]
    drawn += [scene.mark(point) for point in points]
    drawn += [scene.label(point) for point in sorted(points, key=lambda point: not point.large)]
    return framed("".join(drawn), x_title, y_title, _WIDTH, _HEIGHT)


Box = tuple[float, float, float, float]  # left, top, right, bottom


class _Scene:
    def __init__(self, points: Sequence[Point], floor: float) -> None:
        known = [point.x for point in points]
        known += [point.estimated_from for point in points if point.estimated_from]
        self._x = _widened(min(known), max(known))
        highest = max([point.y for point in points] + [10 * floor])
        self._floor = floor
        self._y = (floor / 5, highest * 2)  # with room for labels under the floor
        self._taken: list[Box] = [(_LEFT, _HEIGHT - _BOTTOM - 20, _LEFT + 60, _HEIGHT - _BOTTOM)]
        self._taken += [_around(self._place(point.x, point.y), _LARGE) for point in points]
        for point in points:
            if point.estimated_from:
                x, y = self._place(point.x, point.y)
                self._taken.append((self._place(point.estimated_from, 0)[0] - 6, y - 4, x, y + 4))

    def _place(self, x: float, y: float) -> tuple[float, float]:
        across, up = _share(x, self._x), _share(max(y, self._floor), self._y)
        return (
            _LEFT + across * (_WIDTH - _LEFT - _RIGHT),
            _HEIGHT - _BOTTOM - up * (_HEIGHT - _TOP - _BOTTOM),
        )

    def grid(self) -> str:
        bottom, parts = _HEIGHT - _BOTTOM, []
        for tick in _decades((self._floor, self._y[1])):
            y = self._place(self._x[0], tick)[1]
            least = "&le; " if tick <= self._floor else ""
            parts.append(f'<path class="grid" d="M{_LEFT} {y:.1f}H{_WIDTH - _RIGHT}"/>')
            parts.append(
                f'<text x="{_LEFT - 8}" y="{y + 4:.1f}" class="end">{least}{tick:g}</text>'
            )
        for tick in _decades(self._x):
            x = self._place(tick, self._floor)[0]
            parts.append(f'<path class="grid" d="M{x:.1f} {_TOP}V{bottom}"/>')
            parts.append(f'<text x="{x:.1f}" y="{bottom + 17}" class="middle">{tick:g}</text>')
        parts.append(f'<text x="{_LEFT + 6}" y="{bottom - 7}">&#8601; better</text>')
        return "".join(parts)

    def mark(self, point: Point) -> str:
        x, y = self._place(point.x, point.y)
        radius = _LARGE if point.large else _RADIUS
        title = f"<title>{escape(point.name)}: {escape(point.remark)}</title>"
        circle = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" stroke="{point.color}"'
        if point.estimated_from is None:
            return f'{circle} fill="{point.color}">{title}</circle>'
        begin = self._place(point.estimated_from, point.y)[0]
        return (
            f'<circle cx="{begin:.1f}" cy="{y:.1f}" r="3" fill="{point.color}"/>'
            f'<path class="curve" d="M{begin:.1f} {y:.1f}H{x - radius:.1f}" '
            f'stroke="{point.color}" stroke-dasharray="2 5"/>'
            f'{circle} stroke-width="2" fill="none">{title}</circle>'
        )

    def label(self, point: Point) -> str:
        """Name and remark where they cover nothing else, as near to the point as there is room."""
        box = next(self._free_boxes(point))
        self._taken.append(box)
        x, y = self._place(point.x, point.y)
        lines = (
            f'<text class="name" x="{box[0]:.1f}" y="{box[1] + _LINE - 3:.1f}">'
            f"{escape(point.name)}</text>"
            f'<text x="{box[0]:.1f}" y="{box[1] + 2 * _LINE - 3:.1f}">{escape(point.remark)}</text>'
        )
        nearest = (min(max(x, box[0]), box[2]), min(max(y, box[1]), box[3]))
        if math.dist((x, y), nearest) < 3 * _LARGE:
            return lines
        return f'<path class="grid" d="M{x:.1f} {y:.1f}L{nearest[0]:.1f} {nearest[1]:.1f}"/>{lines}'

    def _free_boxes(self, point: Point) -> Iterator[Box]:
        wide, high = _LETTER * max(len(point.name), len(point.remark)), 2 * _LINE
        x, y = self._place(point.x, point.y)
        gap = _LARGE + 4
        for distance in range(0, _HEIGHT, 6):
            for left, top in (
                (x + gap, y - high / 2 - distance),
                (x - wide / 2, y - gap - high - distance),
                (x - gap - wide, y - high / 2 - distance),
                (x - wide / 2, y + gap + distance),
            ):
                left = min(max(left, _LEFT), _WIDTH - wide)
                box = (left, top, left + wide, top + high)
                if self._is_free(box):
                    yield box
        yield x + gap, y - gap - high, x + gap + wide, y - gap

    def _is_free(self, box: Box) -> bool:
        inside = box[1] >= 0 and box[3] <= _HEIGHT - _BOTTOM
        return inside and not any(
            box[0] < other[2] and other[0] < box[2] and box[1] < other[3] and other[1] < box[3]
            for other in self._taken
        )


def _around(at: tuple[float, float], radius: float) -> Box:
    return at[0] - radius, at[1] - radius, at[0] + radius, at[1] + radius


def _widened(low: float, high: float) -> tuple[float, float]:
    """The range with room at both ends, for the labels above all at the right."""
    room = max(high / low, 10.0) ** 0.05
    return low / room, high * room**3


def _share(value: float, ends: tuple[float, float]) -> float:
    return math.log(value / ends[0]) / math.log(ends[1] / ends[0])


def _decades(ends: tuple[float, float]) -> list[float]:
    first, last = (math.log10(end) for end in ends)
    return [10.0**power for power in range(math.ceil(first - 1e-9), math.floor(last) + 1)]
