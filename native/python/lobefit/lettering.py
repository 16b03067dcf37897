"""Antialiased text on numpy images, in a single-stroke face of our own: no font file is needed.

A glyph is drawn in units of which a capital is 20 high, a small x 14, and the baseline is 0. Its
strokes are parted by ";" and are points "x,y"; a point with "~" is the control point of a quadratic
curve between its neighbours, and two of them in a row have a point halfway between them.
"""

import unicodedata
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

CAPITAL = 20.0
_GAP = 5.0  # between two glyphs
_SPACE = 9.5
_STROKE = 2.3  # width of the pen; bold text takes 1.5 times as much
_STEPS = 6  # straight pieces in a curve

_GLYPHS = {
    "A": "0,0 7,20 14,0;2.4,7 11.6,7",
    "B": "0,0 0,20 7,20 ~12,20 12,15.2 ~12,10.6 7,10.6 0,10.6;7,10.6 ~13,10.6 13,5.3 ~13,0 7,0 0,0",
    "C": "13,16 ~11.5,20.2 7.3,20.2 ~0,20.2 0,10 ~0,-0.2 7.3,-0.2 ~11.5,-0.2 13,4",
    "D": "0,0 0,20 5.5,20 ~14,20 14,10 ~14,0 5.5,0 0,0",
    "E": "11,20 0,20 0,0 11,0;0,10.6 9.5,10.6",
    "F": "11,20 0,20 0,0;0,10.2 9.5,10.2",
    "G": "13,16 ~11.5,20.2 7.3,20.2 ~0,20.2 0,10 ~0,-0.2 7.3,-0.2 ~13.6,-0.2 13.6,7 13.6,9.4 8,9.4",
    "H": "0,0 0,20;13,0 13,20;0,10.6 13,10.6",
    "I": "0,0 0,20",
    "J": "8,20 8,5.5 ~8,-0.2 3.8,-0.2 ~0.6,-0.2 -0.4,3",
    "K": "0,0 0,20;12,20 0,7.5;4.6,12.2 12.6,0",
    "L": "0,20 0,0 10.5,0",
    "M": "0,0 0,20 8,6 16,20 16,0",
    "N": "0,0 0,20 13,0 13,20",
    "O": "7.5,20.2 ~0,20.2 0,10 ~0,-0.2 7.5,-0.2 ~15,-0.2 15,10 ~15,20.2 7.5,20.2",
    "P": "0,0 0,20 7,20 ~12.6,20 12.6,14.6 ~12.6,9 7,9 0,9",
    "Q": "7.5,20.2 ~0,20.2 0,10 ~0,-0.2 7.5,-0.2 ~15,-0.2 15,10 ~15,20.2 7.5,20.2;9,5 15,-1.5",
    "R": "0,0 0,20 7,20 ~12.6,20 12.6,14.8 ~12.6,9.6 7,9.6 0,9.6;7.4,9.6 13.2,0",
    "S": "11.6,16.6 ~10.3,20.2 6.2,20.2 ~0.6,20.2 0.6,15.4 ~0.6,11.8 6.3,10.4 ~12.3,9 12.3,4.9 "
    "~12.3,-0.2 6.3,-0.2 ~1.3,-0.2 0,3.8",
    "T": "0,20 14,20;7,20 7,0",
    "U": "0,20 0,7 ~0,-0.2 6.6,-0.2 ~13.2,-0.2 13.2,7 13.2,20",
    "V": "0,20 7,0 14,20",
    "W": "0,20 5,0 10,18 15,0 20,20",
    "X": "0.4,20 12.6,0;12.6,20 0.4,0",
    "Y": "0,20 7,9.4 14,20;7,9.4 7,0",
    "Z": "0.6,20 12.4,20 0,0 12.8,0",
    "a": "1.2,11.6 ~2.4,14.2 5.6,14.2 ~10,14.2 10,9.8 10,0;"
    "10,8.2 4.8,8 ~0,7.8 0,3.8 ~0,-0.2 4.4,-0.2 ~8.4,-0.2 10,3.4",
    "b": "0,21 0,0;0,7 ~0,14.2 5.4,14.2 ~10.6,14.2 10.6,7 ~10.6,-0.2 5.4,-0.2 ~0,-0.2 0,7",
    "c": "9.6,11 ~8.6,14.2 5.4,14.2 ~0,14.2 0,7 ~0,-0.2 5.4,-0.2 ~8.6,-0.2 9.6,3",
    "d": "10.6,21 10.6,0;10.6,7 ~10.6,14.2 5.2,14.2 ~0,14.2 0,7 ~0,-0.2 5.2,-0.2 ~10.6,-0.2 10.6,7",
    "e": "0.1,7.6 10.4,7.6 ~10.4,14.2 5.3,14.2 ~0,14.2 0,7 ~0,-0.2 5.6,-0.2 ~8.8,-0.2 10,2.8",
    "f": "7,20.6 ~3,21.8 3,16.6 3,0;0,14 6.8,14",
    "g": "10.6,14 10.6,0 ~10.6,-6.2 5.4,-6.2 ~2,-6.2 0.6,-3.8;"
    "10.6,7.2 ~10.6,14.2 5.2,14.2 ~0,14.2 0,7.2 ~0,0.2 5.2,0.2 ~10.6,0.2 10.6,7.2",
    "h": "0,21 0,0;0,8 ~0.4,14.2 5.2,14.2 ~10,14.2 10,8.6 10,0",
    "i": "0,14 0,0;0,19.2",
    "j": "3,14 3,-2.4 ~3,-6.2 -0.6,-6;3,19.2",
    "k": "0,21 0,0;9,14 0,5;3.6,8.6 9.8,0",
    "l": "0,21 0,0",
    "m": "0,14 0,0;0,8.4 ~0.4,14.2 4.4,14.2 ~8.4,14.2 8.4,8.8 8.4,0;"
    "8.4,8.4 ~8.8,14.2 12.8,14.2 ~16.8,14.2 16.8,8.8 16.8,0",
    "n": "0,14 0,0;0,8 ~0.4,14.2 5.2,14.2 ~10,14.2 10,8.6 10,0",
    "o": "5.5,14.2 ~0,14.2 0,7 ~0,-0.2 5.5,-0.2 ~11,-0.2 11,7 ~11,14.2 5.5,14.2",
    "p": "0,14 0,-6;0,7 ~0,14.2 5.4,14.2 ~10.6,14.2 10.6,7 ~10.6,-0.2 5.4,-0.2 ~0,-0.2 0,7",
    "q": "10.6,14 10.6,-6;"
    "10.6,7 ~10.6,14.2 5.2,14.2 ~0,14.2 0,7 ~0,-0.2 5.2,-0.2 ~10.6,-0.2 10.6,7",
    "r": "0,14 0,0;0,7.6 ~0.4,14.6 6,13.9",
    "s": "8.4,11.6 ~7.4,14.2 4.5,14.2 ~0.5,14.2 0.5,10.9 ~0.5,8.3 4.6,7.3 ~8.9,6.3 8.9,3.5 "
    "~8.9,-0.2 4.6,-0.2 ~1,-0.2 0,2.6",
    "t": "3,18.6 3,4 ~3,-0.6 7,0;0,14 6.8,14",
    "u": "0,14 0,5.4 ~0,-0.2 4.8,-0.2 ~9.6,-0.2 10,6;10,14 10,0",
    "v": "0,14 5.2,0 10.4,14",
    "w": "0,14 3.9,0 7.8,12.4 11.7,0 15.6,14",
    "x": "0.2,14 9.4,0;9.4,14 0.2,0",
    "y": "0,14 5.4,0.4;10.6,14 5.4,0.4 ~3.2,-6.4 -0.4,-5.8",
    "z": "0.4,14 9,14 0,0 9.4,0",
    "0": "6,20.2 ~0,20.2 0,10 ~0,-0.2 6,-0.2 ~12,-0.2 12,10 ~12,20.2 6,20.2",
    "1": "1,16 6,20 6,0",
    "2": "0.4,15.4 ~0.8,20.2 5.9,20.2 ~11.2,20.2 11.2,15.4 ~11.2,12.2 7.4,8.4 0,0.6 0,0 11.8,0",
    "3": "0.5,16.6 ~1.8,20.2 5.8,20.2 ~10.8,20.2 10.8,15.6 ~10.8,10.9 5.6,10.9 4,10.9;"
    "5.6,10.9 ~11.8,10.9 11.8,5.4 ~11.8,-0.2 5.8,-0.2 ~1.2,-0.2 0,3.8",
    "4": "9.4,0 9.4,20 0,6.2 0,5.4 12.6,5.4",
    "5": "10.6,20 1.9,20 1,10.4 ~3,13 6,13 ~11.8,13 11.8,6.5 ~11.8,-0.2 5.7,-0.2 ~1.4,-0.2 0,3.4",
    "6": "10.4,17.4 ~9,20.2 6.3,20.2 ~0,20.2 0,9 0,6.4 ~0,-0.2 6,-0.2 ~12,-0.2 12,6.2 "
    "~12,12.4 6.2,12.4 ~0.8,12.4 0,6.4",
    "7": "0,20 11.8,20 4,0",
    "8": "6,10.8 ~0.9,10.8 0.9,15.5 ~0.9,20.2 6,20.2 ~11.1,20.2 11.1,15.5 ~11.1,10.8 6,10.8 "
    "~0,10.8 0,5.3 ~0,-0.2 6,-0.2 ~12,-0.2 12,5.3 ~12,10.8 6,10.8",
    "9": "1.6,2.6 ~3,-0.2 5.7,-0.2 ~12,-0.2 12,11 12,13.6 ~12,20.2 6,20.2 ~0,20.2 0,13.8 "
    "~0,7.6 5.8,7.6 ~11.2,7.6 12,13.6",
    "!": "0,20 0,6;0,0.4",
    '"': "0,20 0,14.5;4.4,20 4.4,14.5",
    "#": "4.4,19.6 2.2,0.4;10.6,19.6 8.4,0.4;0.8,13.4 13,13.4;0,6.6 12.2,6.6",
    "$": "11,15.8 ~10,18.6 6,18.6 ~0.8,18.6 0.8,14.6 ~0.8,11.5 6,10.4 ~11.6,9.2 11.6,5.4 "
    "~11.6,1.4 6,1.4 ~1.2,1.4 0,4.6;6,21.8 6,-1.8",
    "%": "3.6,20.2 ~0,20.2 0,15.6 ~0,11 3.6,11 ~7.2,11 7.2,15.6 ~7.2,20.2 3.6,20.2;"
    "14.4,9 ~10.8,9 10.8,4.4 ~10.8,-0.2 14.4,-0.2 ~18,-0.2 18,4.4 ~18,9 14.4,9;14.6,20 3.4,0",
    "&": "14,0 3.6,13 ~1.8,15.4 1.8,16.6 ~1.8,20.2 5.4,20.2 ~9,20.2 9,16.8 ~9,14 5,11.6 "
    "~0,8.6 0,5 ~0,-0.2 5.6,-0.2 ~11.6,-0.2 13,9",
    "'": "0,20 0,14.5",
    "(": "4.4,22 ~0,17 0,8.5 ~0,0 4.4,-5",
    ")": "0,22 ~4.4,17 4.4,8.5 ~4.4,0 0,-5",
    "*": "5,20 5,10.8;1,17.7 9,13.1;9,17.7 1,13.1",
    "+": "0,8.6 11.6,8.6;5.8,14.4 5.8,2.8",
    ",": "1.4,0.6 0,-4",
    "-": "0,8 6.4,8",
    ".": "0,0.4",
    "/": "8.4,21.5 0,-2.5",
    ":": "0,12;0,0.4",
    ";": "1.2,12;1.4,0.6 0,-4",
    "<": "10.6,14.8 0,8.6 10.6,2.4",
    "=": "0,11.4 11.6,11.4;0,5.8 11.6,5.8",
    ">": "0,14.8 10.6,8.6 0,2.4",
    "?": "0,16.2 ~1,20.2 5,20.2 ~9.6,20.2 9.6,15.8 ~9.6,13 6.8,11 ~4.8,9.4 4.8,6;4.8,0.4",
    "@": "13,6 ~9.6,2.4 7.4,4 ~5.2,5.6 6.4,9.2 ~7.8,13 11,12.6 13.6,11.6;13.6,12.6 12.6,5.6 "
    "~12.8,3.4 15,3.8 ~18.4,5 18.4,10.4 ~18,19 10,19 ~0,19 0,8 ~0,-3.6 10,-3.6 13.6,-3",
    "[": "4.4,22 0,22 0,-5 4.4,-5",
    "\\": "0,21.5 8.4,-2.5",
    "]": "0,22 4.4,22 4.4,-5 0,-5",
    "^": "0,12 5,20 10,12",
    "_": "0,-4 12,-4",
    "`": "0,21 3.4,17.4",
    "{": "5.4,22 ~2.2,22 2.2,18 2.2,13 ~2.2,8.5 0,8.5 ~2.2,8.5 2.2,4 2.2,-1 ~2.2,-5 5.4,-5",
    "|": "0,22 0,-5",
    "}": "0,22 ~3.2,22 3.2,18 3.2,13 ~3.2,8.5 5.4,8.5 ~3.2,8.5 3.2,4 3.2,-1 ~3.2,-5 0,-5",
    "~": "0,7 ~0.8,11 3.6,10.6 ~5,10.4 6.4,8.6 ~7.8,6.8 9,6.6 ~11.8,6.4 12.6,10",
}


def draw(
    image: NDArray[np.floating],
    text: str,
    x: float,
    y: float,
    size: float = 16.0,
    color: ArrayLike = (1.0, 1.0, 1.0),
    align: str = "left",
    bold: bool = False,
) -> None:
    """Draws `text` onto `image` (rows, columns, channels), the baseline `y` rows from the top.

    `x` is the left end, the middle or the right end of the text as `align` says. `size` in pixels
    is that of a usual font: a capital is 0.72 of it high. Characters without a glyph lose their
    accent, or become "?". What lies outside of the image is not drawn.
    """
    x -= {"left": 0.0, "center": 0.5, "right": 1.0}[align] * width(text, size)
    scale = _scale(size)
    pen = _STROKE * (1.5 if bold else 1.0) * scale
    for character in _plain(text):
        if character != " ":
            segments, left, _ = _outline(character)
            placed = segments * [scale, -scale] + [x - left * scale, y]
            stroke(image, placed, max(pen, 1.0) / 2, np.asarray(color, dtype=image.dtype))
        x += _advance(character) * scale


def width(text: str, size: float = 16.0) -> float:
    """The width in pixels of `text` as `draw` writes it."""
    plain = _plain(text)
    gap = _GAP if plain else 0.0
    return (sum(_advance(character) for character in plain) - gap) * _scale(size)


def _scale(size: float) -> float:
    return 0.72 * size / CAPITAL


def _plain(text: str) -> str:
    """The text in characters that have a glyph."""
    apart = unicodedata.normalize("NFKD", text)
    kept = (character for character in apart if not unicodedata.combining(character))
    return "".join(c if c in _GLYPHS or c == " " else "?" for c in kept)


def _advance(character: str) -> float:
    return _SPACE if character == " " else _outline(character)[2] + _GAP


@cache
def _outline(character: str) -> tuple[NDArray[np.float64], float, float]:
    """The straight pieces (n, 2 ends, 2) of a glyph, its left edge and its width."""
    strokes = [_flatten(stroke.split()) for stroke in _GLYPHS[character].split(";")]
    pieces = [np.stack([line[:-1], line[1:]], 1) for line in strokes]
    segments = np.concatenate(pieces)
    left, right = segments[..., 0].min(), segments[..., 0].max()
    return segments, float(left), float(right - left)


def _flatten(points: list[str]) -> NDArray[np.float64]:
    """The corners (n, 2) of a stroke, its curves cut to straight pieces; a dot is a point twice."""
    places = [np.array([float(n) for n in point.lstrip("~").split(",")]) for point in points]
    curved = [point.startswith("~") for point in points]
    line = [places[0]]
    for index in range(1, len(places)):
        if not curved[index]:
            line.append(places[index])
            continue
        start, control, end = line[-1], places[index], places[index + 1]
        if curved[index + 1]:
            end = (control + end) / 2
        for t in np.arange(1, _STEPS + 1) / _STEPS:
            line.append((1 - t) ** 2 * start + 2 * t * (1 - t) * control + t**2 * end)
    return np.array(line if len(line) > 1 else line * 2)


def stroke(
    image: NDArray[np.floating],
    segments: NDArray[np.float64],
    radius: float,
    color: NDArray[np.floating],
) -> None:
    """Blends a pen of `radius` pixels along the segments; coverage is linear in the distance."""
    low = np.maximum(np.floor(segments.min((0, 1)) - radius - 1), 0).astype(int)
    high = np.ceil(segments.max((0, 1)) + radius + 1).astype(int)
    part = image[low[1] : max(high[1], 0), low[0] : max(high[0], 0)]
    if part.size == 0:
        return
    rows, columns = np.indices(part.shape[:2])
    points = np.stack([columns + low[0] + 0.5, rows + low[1] + 0.5], -1)[:, :, None]
    starts, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    length = np.maximum((along**2).sum(-1), 1e-12)
    share = np.clip(((points - starts) * along).sum(-1) / length, 0, 1)
    distance = np.linalg.norm(points - starts - share[..., None] * along, axis=-1).min(-1)
    coverage = np.clip(radius + 0.5 - distance, 0, 1)[..., None]
    part += coverage * (color - part)
