"""Pictures in files, read as linear light and written as data, by OpenImageIO.

OpenImageIO reads what cameras and renderers write, PNG of 8 and 16 bits, OpenEXR, Radiance HDR,
TIFF and JPEG among them, and is the library that Blender itself reads them with. It comes with
`pip install 'lobefit[pictures]'`, and with Blender.
"""

import importlib.util
import os
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lobefit import picture
from lobefit._native import InputError
from lobefit.atomic import place_to_write, written_aside

# Pictures of more pixels are refused rather than swallowed: 16 bytes a pixel add up.
MOST_PIXELS = 1 << 28


@dataclass(frozen=True)
class Image:
    """A picture (rows, columns, 3) in linear light, the first row at the top.

    `alpha` (rows, columns) is None where there is none; light is that of the covered part of a
    pixel. `saturation` is the value from which on a pixel may have been cut off, infinite for
    floating-point files.
    """

    light: NDArray[np.float32]
    alpha: NDArray[np.float32] | None
    saturation: float


def need_library() -> None:
    """Raises InputError, with what to install, where OpenImageIO is missing."""
    if importlib.util.find_spec("OpenImageIO") is None:
        raise InputError(
            "expected the Python module OpenImageIO to read pictures, found none; install it with: "
            "pip install 'lobefit[pictures]'."
        )


def read_image(path: str | os.PathLike[str], linear: bool = False) -> Image:
    """The picture in the file `path`.

    Whole numbers (PNG, JPEG, TIFF) are taken for sRGB, unless `linear`; floating-point values are
    linear. Grey is spread over red, green and blue. Raises InputError for what is no picture.
    """
    need_library()
    import OpenImageIO

    if not Path(path).is_file():
        what = "a folder" if Path(path).is_dir() else "no such file"
        raise InputError(f"{path}: expected a picture, found {what}.")
    as_stored = OpenImageIO.ImageSpec()
    as_stored.attribute("oiio:UnassociatedAlpha", 1)
    with _own_words():
        file = OpenImageIO.ImageInput.open(str(path), as_stored)
    if file is None:
        OpenImageIO.geterror()  # is in no form for users
        raise InputError(f"{path}: expected a picture, found another kind of file.")
    with closing(file), _own_words():
        spec = file.spec()
        if not 1 <= spec.width * spec.height <= MOST_PIXELS:
            raise InputError(
                f"{path}: expected a picture of up to {MOST_PIXELS} pixels, found "
                f"{spec.width} x {spec.height}."
            )
        values = file.read_image(0, 0, 0, spec.nchannels, OpenImageIO.FLOAT)
        if values is None:
            raise InputError(f"{path}: expected a whole picture, found a damaged one.")
    floating = (OpenImageIO.HALF, OpenImageIO.FLOAT, OpenImageIO.DOUBLE)
    whole_numbers = spec.format.basetype not in floating
    alpha = spec.alpha_channel if spec.alpha_channel >= 0 else None
    return image_of(values, alpha, whole_numbers, whole_numbers and not linear)


def write_image(path: str | os.PathLike[str], values: ArrayLike) -> None:
    """Writes data (rows, columns[, channels]): 0..1 in 16 bits, or as they are to .exr."""
    need_library()
    import OpenImageIO

    data = np.atleast_3d(np.asarray(values, np.float32))
    exact = Path(path).suffix.lower() == ".exr"
    spec = OpenImageIO.ImageSpec(
        data.shape[1], data.shape[0], data.shape[2], "float" if exact else "uint16"
    )
    spec.attribute("oiio:ColorSpace", "raw")
    with written_aside(path) as aside:
        file = OpenImageIO.ImageOutput.create(str(aside))
        done = file.open(str(aside), spec) and file.write_image(np.ascontiguousarray(data))
        if not (file.close() and done):
            raise InputError(f"{path}: cannot be written, {file.geterror().strip()}.")


def place_for(path: str | os.PathLike[str]) -> None:
    """Raises InputError where `write_image` could not write."""
    if place_to_write(path).suffix.lower() not in (".png", ".exr"):
        raise InputError(f"{path}: expected a name that ends in .png or .exr.")


def image_of(values: NDArray[np.float32], alpha: int | None, whole: bool, encoded: bool) -> Image:
    """The picture in values (rows, columns, channels), one of which may be the `alpha`.

    `whole` tells that they come from whole numbers (0..1, with light that alpha has not yet taken
    its part of), and `encoded` that they are sRGB.
    """
    colors = [c for c in range(values.shape[-1]) if c != alpha][:3]
    light = values[..., colors] if len(colors) == 3 else np.repeat(values[..., colors[:1]], 3, 2)
    cover = None if alpha is None else values[..., alpha]
    if not whole and cover is not None:
        light = light / np.maximum(cover, 1e-6)[..., None]
    # The last but one of 255 steps is as likely cut off as the last, by noise or by compression.
    top = 254 / 255
    if encoded:
        light, top = picture.decode(light), float(picture.decode(top))
    light = np.nan_to_num(light).astype(np.float32)
    return Image(light, cover, top if whole else np.inf)


@contextmanager
def _own_words() -> Iterator[None]:
    """Keeps what the libraries below print of damaged files off stderr."""
    sys.stderr.flush()
    ours = os.dup(2)
    try:
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
            yield
    finally:
        os.dup2(ours, 2)
        os.close(ours)
