"""The report's plots as pictures, for where no browser shows them: in Blender's panels.

It draws the SVG that `lobefit.plot` and `lobefit.heat_map` write, and no other.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from lobefit import lettering, picture
from lobefit.picture import FAINT, INK, PAPER, Image
from lobefit.plot import Line

_GRID = (0.25, 0.255, 0.27)
_TEXT = 12.0  # in units of the SVG
_SCALE = 2  # pixels of a unit
_LEGEND_ROW = 18  # units
_CHUNK = 8  # straight pieces that are drawn at once: more share a larger part of the picture


def drawn(svg: str, lines: Sequence[Line] = ()) -> Image:
    """The plot, two pixels a unit, with the labels of the lines under it."""
    root = ElementTree.fromstring(svg)
    columns, rows = (round(float(length)) for length in root.attrib["viewBox"].split()[2:])
    extra = len(lines) * _LEGEND_ROW
    image = picture.page((rows + extra) * _SCALE, columns * _SCALE, PAPER)
    for element in root:
        _DRAW[element.tag](image, element)
    for index, line in enumerate(lines):
        y = rows + index * _LEGEND_ROW
        key = np.array([[58.0, y], [84.0, y]])
        _stroke(image, key, _color(line.color), 2.0, _dashes("5 7") if line.dashed else None)
        _letter(image, line.label, 92.0, y + 4.0, INK)
    return image


def _draw_path(image: Image, element: ElementTree.Element) -> None:
    is_grid = element.get("class") == "grid"
    color = _GRID if is_grid else _color(element.attrib["stroke"])
    dashes = _dashes(element.get("stroke-dasharray"), element.get("stroke-dashoffset", "0"))
    for points in _corners(element.attrib["d"]):
        _stroke(image, points, color, 1.0 if is_grid else 2.0, dashes)


def _draw_rectangle(image: Image, element: ElementTree.Element) -> None:
    left, top, width, height = (
        float(element.attrib[name]) * _SCALE for name in ("x", "y", "width", "height")
    )
    rows = slice(round(top), round(top + height))
    columns = slice(round(left), round(left + width))
    image[rows, columns] = _color(element.attrib["fill"])


def _draw_circle(image: Image, element: ElementTree.Element) -> None:
    x, y, radius = (float(element.attrib[name]) for name in ("cx", "cy", "r"))
    point = np.array([[x, y], [x, y]])
    _stroke(image, point, _color(element.attrib["fill"]), 2 * radius)


def _draw_text(image: Image, element: ElementTree.Element) -> None:
    align = {"middle": "center", "end": "right"}.get(
        element.get("class") or element.get("text-anchor", ""), "left"
    )
    turned = re.match(r"translate\(([\d.]+) ([\d.]+)\) rotate\(-90\)", element.get("transform", ""))
    if turned is None:
        x, y = float(element.attrib["x"]), float(element.attrib["y"])
        _letter(image, element.text or "", x, y, FAINT, align)
    else:
        # Turned to the left, what was to the left is below.
        x, y = (float(length) for length in turned.groups())
        beside = np.rot90(image, -1)
        _letter(beside, element.text or "", image.shape[0] / _SCALE - y, x, FAINT, align)


_DRAW: dict[str, Callable[[Image, ElementTree.Element], None]] = {
    "path": _draw_path,
    "rect": _draw_rectangle,
    "circle": _draw_circle,
    "text": _draw_text,
}


def _corners(path: str) -> Iterator[NDArray[np.float64]]:
    """The corners (n, 2) of each line of a path of the commands M, L, H and V."""
    points: list[tuple[float, float]] = []
    for command, first, second in re.findall(r"([MLHV])([-\d.]+)(?: ([-\d.]+))?", path):
        if command == "M":
            if len(points) > 1:
                yield np.array(points)
            points = []
        at = float(first)
        if command == "H":
            points.append((at, points[-1][1]))
        elif command == "V":
            points.append((points[-1][0], at))
        else:
            points.append((at, float(second)))
    if len(points) > 1:
        yield np.array(points)


def _stroke(
    image: Image,
    points: NDArray[np.float64],
    color: Any,
    width: float,
    dashes: tuple[float, float, float] | None = None,
) -> None:
    """Blends a pen of some units into the image along a line of corners (n, 2)."""
    pieces = np.stack([points[:-1], points[1:]], 1)
    if dashes is not None:
        pieces = _dashed(pieces, *dashes)
    pieces, radius = pieces * _SCALE, width * _SCALE / 2
    if not len(pieces):
        return
    # Pieces that meet are one line, and not darker where they do: their cover is added up first.
    low = np.maximum(np.floor(pieces.min((0, 1)) - radius - 1), 0).astype(int)
    high = np.ceil(pieces.max((0, 1)) + radius + 1).astype(int)
    part = image[low[1] : high[1], low[0] : high[0]]
    cover = np.zeros((*part.shape[:2], 1), np.float32)
    for start in range(0, len(pieces), _CHUNK):
        lettering.stroke(cover, pieces[start : start + _CHUNK] - low, radius, np.float32(1))
    part += cover * (np.asarray(color, np.float32) - part)


def _dashed(
    pieces: NDArray[np.float64], dash: float, space: float, offset: float
) -> NDArray[np.float64]:
    """The straight pieces (n, 2 ends, 2), cut so that only the dashes are left of them."""
    lengths = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1)
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    kept = []
    for start in np.arange(-offset % (dash + space) - dash - space, ends[-1], dash + space):
        for index in np.flatnonzero((ends[1:] > start) & (ends[:-1] < start + dash)):
            a, b = pieces[index]
            low, high = (
                np.clip((at - ends[index]) / max(lengths[index], 1e-12), 0, 1)
                for at in (start, start + dash)
            )
            kept.append([a + low * (b - a), a + high * (b - a)])
    return np.array(kept).reshape(-1, 2, 2)


def _dashes(lengths: str | None, offset: str = "0") -> tuple[float, float, float] | None:
    """The dash, the space after it and where in these the line begins; None for a whole line."""
    if lengths is None:
        return None
    dash, space = map(float, lengths.split())
    return dash, space, float(offset)


def _letter(image: Image, text: str, x: float, y: float, color: Any, align: str = "left") -> None:
    lettering.draw(image, text, x * _SCALE, y * _SCALE, _TEXT * _SCALE, color, align)


def _color(name: str) -> tuple[float, ...]:
    """#rrggbb as numbers; the only other color is that of text."""
    if not name.startswith("#"):
        return INK
    return tuple(int(name[at : at + 2], 16) / 255 for at in (1, 3, 5))
