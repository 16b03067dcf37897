"""Linear images to PNG files, without a library: exposure, sRGB, and the joining of panels."""

import os
import struct
import zlib

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lobefit.atomic import write_bytes

Image = NDArray[np.float32]  # (rows, columns, 3), the first row at the top

# Of pages with pictures and lettering on them.
PAPER, INK, FAINT = (0.115, 0.115, 0.125), (0.95, 0.95, 0.95), (0.62, 0.63, 0.66)


def expose(linear: ArrayLike, white: float) -> Image:
    """Linear light with `white` at 1; what is brighter is cut off, what is unknown black."""
    scaled = np.nan_to_num(np.asarray(linear, np.float32)) / max(white, 1e-30)
    shown: Image = np.clip(scaled, 0, 1).astype(np.float32)
    return shown


def encode(linear: ArrayLike) -> Image:
    """Linear light (0..1) in the curve of sRGB (0..1)."""
    light = np.asarray(linear, np.float32)
    curve = 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, curve).astype(np.float32)


def decode(encoded: ArrayLike) -> Image:
    """The linear light (0..1) of sRGB (0..1)."""
    curve = np.asarray(encoded, np.float32)
    light = ((np.maximum(curve, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(curve <= 0.04045, curve / 12.92, light).astype(np.float32)


def white_point(linear: ArrayLike, share: float = 99.5) -> float:
    """The value below which `share` percent of what is lit lies; 1 where nothing is."""
    values = np.asarray(linear)
    lit = values[np.isfinite(values) & (values > 0)]
    return float(np.percentile(lit, share)) if lit.size else 1.0


def shrink(image: Image, factor: int) -> Image:
    """The image in 1/factor of its size, each pixel the mean of factor x factor."""
    rows, columns = image.shape[0] // factor, image.shape[1] // factor
    cut = image[: rows * factor, : columns * factor]
    steps = range(factor)
    # Sums of whole pictures: numpy's mean over two short axes takes six times as long.
    means: Image = sum(cut[row::factor, column::factor] for row in steps for column in steps)
    return means / np.float32(factor * factor)


def page(rows: int, columns: int, color: ArrayLike) -> Image:
    """An empty page in one sRGB color (0..1)."""
    return np.full((rows, columns, 3), color, dtype=np.float32)


def paste(image: Image, panel: Image, row: int, column: int, cover: ArrayLike = 1.0) -> None:
    """Puts `panel` onto `image`, its upper left corner at (row, column), where `cover` is 1."""
    part = image[row : row + panel.shape[0], column : column + panel.shape[1]]
    part += np.asarray(cover, np.float32) * (panel - part)


def disc(size: int) -> Image:
    """The share (size, size, 1) of each pixel inside the circle that fills the square."""
    place = np.arange(size) + 0.5 - size / 2
    inside = size / 2 - np.hypot(place, place[:, None]) + 0.5
    cover: Image = np.clip(inside, 0, 1).astype(np.float32)[..., None]
    return cover


def png(image: ArrayLike) -> bytes:
    """An sRGB image (0..1) as the bytes of an 8-bit PNG file."""
    levels = np.clip(np.asarray(image) * 255 + 0.5, 0, 255).astype(np.uint8)
    rows, columns = levels.shape[:2]
    # Every row starts with the number of its filter: 0, none.
    lines = np.concatenate([np.zeros((rows, 1), np.uint8), levels.reshape(rows, -1)], 1)
    head = struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0)
    chunks = _chunk(b"IHDR", head) + _chunk(b"sRGB", b"\0")
    chunks += _chunk(b"IDAT", zlib.compress(lines.tobytes(), 9)) + _chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + chunks


def write_png(path: str | os.PathLike[str], image: ArrayLike) -> None:
    """Writes an sRGB image (0..1) as a PNG file, all of it or nothing."""
    write_bytes(path, png(image))


def _chunk(kind: bytes, data: bytes) -> bytes:
    check = struct.pack(">I", zlib.crc32(kind + data))
    return struct.pack(">I", len(data)) + kind + data + check
