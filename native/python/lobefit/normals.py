"""Normals from shading: the inverse of the reflection models, for pictures under known lights."""

import dataclasses
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lobefit import _native
from lobefit._native import InputError
from lobefit.fitting import wait_for
from lobefit.images import Image, read_image
from lobefit.inputs import Progress
from lobefit.lights import Lighting
from lobefit.record import Record

# What a record may be taken for: the fitted model, or what Cycles renders of a kind of material.
KINDS = ("model", "measured", "lobe", "live", "principled")

# The part of the brightest pixels' light that is dark where no noise tells more.
_DARK = 1e-3


@dataclass(frozen=True)
class Surface:
    """Normals (rows, columns, 3) and heights (rows, columns) of a picture's pixels.

    Normals are unit vectors in the camera's frame, x to the right, y up and z toward the camera, 0
    off the surface. Heights are in pixels, the lowest point of each part of the surface at 0.
    """

    normals: NDArray[np.float32]
    heights: NDArray[np.float32]


class Job:
    """An estimate under way in threads of its own; it starts at once and never holds Python up.

    `pictures` are (K, rows, columns, 3) in linear light, of the same points under the K lightings;
    `mask` (rows, columns) tells which pixels show the surface. `source` is its reflectance, as
    `reflectance_of` makes it, a Measurement, or ("classic", a dict of model 'classic-phong' or
    'classic-blinn-phong', diffuse k_d, specular k_s and exponent). With three pictures or more a
    pixel's neighbours decide only where noise hides what it shows, with fewer all pixels are
    estimated together, from the silhouette inward. Values of
    `saturation` and above only tell that a pixel was at least that bright. `noise` is the standard
    deviation of a pixel's value; if None it is estimated. `threads` 0 takes every processor; the
    result is the same for any number.
    """

    def __init__(
        self,
        pictures: ArrayLike,
        lighting: Sequence[Lighting],
        source: Any,
        mask: ArrayLike,
        saturation: float = np.inf,
        noise: float | None = None,
        threads: int = 0,
    ) -> None:
        values = np.asarray(pictures, np.float32)
        shown = np.asarray(mask, bool)
        if not shown.any():
            raise InputError("pictures: expected pixels that show the surface, found none.")
        if noise is None:
            noise = max(_noise(picture, shown) for picture in values)
        self._job = _native.NormalsJob(
            values,
            shown,
            [each.entries() for each in lighting],
            source,
            max(2 * noise, _DARK * float(np.percentile(values[:, shown], 99)), 1e-12),
            noise,
            saturation,
            threads,
        )

    @property
    def progress(self) -> float:
        """The share that is done, from 0 to 1."""
        return self._job.progress

    @property
    def stage(self) -> str:
        """What is being done, in a word."""
        return self._job.stage

    def cancel(self) -> None:
        """Asks the job to end soon without a result."""
        self._job.cancel()

    def wait(self, seconds: float) -> bool:
        """Waits at most `seconds` for the end; says whether it is reached."""
        return self._job.wait(seconds)

    def surface(self) -> Surface:
        """What was found, of a job that is done. Raises what ended it, Cancelled after `cancel`."""
        return Surface(*self._job.result())


@dataclass(frozen=True)
class Pictures:
    """Pictures (K, rows, columns, 3) in linear light, with the options of `Job` of these names."""

    values: NDArray[np.float32]
    mask: NDArray[np.bool_]
    saturation: float


def read_pictures(
    paths: Sequence[str | os.PathLike[str]],
    mask: str | os.PathLike[str] | None = None,
    linear: bool = False,
) -> Pictures:
    """The pictures in files, see `read_image`; the surface is where the picture `mask` is bright.

    Without a mask `together` tells where. Raises InputError where one cannot be read.
    """
    pictures = together(map(str, paths), [read_image(path, linear) for path in paths])
    if mask is None:
        return pictures
    bright = read_image(mask, linear=True).light.mean(axis=-1)
    _check_size(str(mask), bright, pictures.mask)
    return dataclasses.replace(pictures, mask=bright > 0.5)


def together(names: Iterable[str], images: Sequence[Image]) -> Pictures:
    """The pictures of one surface, which have to be of one size.

    The surface is where all pictures that are transparent somewhere are not, or, where none is,
    what any picture shows lit. Raises InputError with a name for another size.
    """
    for name, image in zip(names, images, strict=True):
        _check_size(name, image.light, images[0].light)
    values = np.stack([image.light for image in images])
    covers = [image.alpha > 0.5 for image in images if image.alpha is not None]
    covers = [cover for cover in covers if not cover.all()]
    shown = np.logical_and.reduce(covers) if covers else (values > 0).any(axis=(0, -1))
    return Pictures(values, shown, min(image.saturation for image in images))


def _check_size(name: str, values: NDArray[Any], wanted: NDArray[Any]) -> None:
    if values.shape[:2] != wanted.shape[:2]:
        found, expected = (" x ".join(map(str, v.shape[1::-1])) for v in (values, wanted))
        raise InputError(f"{name}: expected a picture of {expected} pixels, found {found}.")


def normals(
    pictures: ArrayLike,
    lighting: Sequence[Lighting],
    source: Any,
    progress: Progress | None = None,
    **options: Any,
) -> Surface:
    """The surface that explains the pictures; the arguments are those of `Job`."""
    return wait_for(Job(pictures, lighting, source, **options), progress).surface()


def reflectance_of(record: Record, kind: str = "model") -> Any:
    """What a record's material reflects, for `Job`: one of KINDS.

    Raises InputError where the record has no such closures.
    """
    if kind == "model":
        return record.parameters
    if kind == "live":
        return "live", record.parameters
    if kind == "principled":
        return "principled", record.principled
    entries = [entry for entry in record.closures if entry["target"] == kind]
    if not entries:
        raise InputError(f"{record.name}: expected closures of {kind} in the record, found none.")
    return "closures", min(entries, key=lambda entry: entry["error"])


def shade(normals: ArrayLike, lighting: Sequence[Lighting], source: Any) -> NDArray[np.float32]:
    """The pictures (K, rows, columns, 3) of normals (rows, columns, 3); black where they are 0.

    Nothing casts a shadow on anything else. `lighting` and `source` are those of `Job`.
    """
    given = np.asarray(normals, np.float64)
    shown = given.any(axis=-1)
    pictures = np.zeros((len(lighting), *given.shape), np.float32)
    pictures[:, shown] = _native.shade(source, given[shown], [each.entries() for each in lighting])
    return pictures


def unexplained(pictures: Pictures, shown: NDArray[np.float32]) -> float:
    """Which part of the pictures' light is off where the surface is `shown` as it was found.

    Shadows and a wrong material or light count, and what was cut off only where too little is
    shown; some per cent are usual.
    """
    seen, found = (
        np.minimum(values[:, pictures.mask], pictures.saturation)
        for values in (pictures.values, shown)
    )
    off = np.abs(seen - found).sum(dtype=np.float64)
    return float(off / max(np.abs(seen).sum(dtype=np.float64), 1e-30))


def as_normal_map(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """The colors (0..1) of a tangent-space map for Blender's Normal Map node (OpenGL's +Y).

    Off the surface they are those of a flat one.
    """
    shown = np.where(normals.any(axis=-1, keepdims=True), normals, np.float32([0, 0, 1]))
    colors: NDArray[np.float32] = (shown / 2 + 0.5).astype(np.float32)
    return colors


def as_displacement(heights: NDArray[np.float32]) -> tuple[NDArray[np.float32], float]:
    """Heights from 0 to 1, and the part of the picture's width that 1 stands for."""
    highest = float(heights.max())
    scale = highest / heights.shape[1]
    return (heights / highest if highest > 0 else heights), scale


def _noise(picture: NDArray[np.float32], mask: NDArray[np.bool_]) -> float:
    """The standard deviation of noise (Immerkaer 1996), by the median, which edges do not bend."""
    spots = picture[:-2] - 2 * picture[1:-1] + picture[2:]
    spots = spots[:, :-2] - 2 * spots[:, 1:-1] + spots[:, 2:]
    inside = mask[1:-1, 1:-1]
    return 1.4826 * float(np.median(np.abs(spots[inside]))) / 6 if inside.any() else 0.0
