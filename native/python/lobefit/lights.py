"""LIGHTS.json: what lit the pictures that normals are found from.

    {
     "schema": 1,
     "pictures": [
      {"image": "left.png",
       "lights": [{"direction": [-1, 0.5, 1.2], "irradiance": [3.1, 3.0, 2.8]}],
       "ambient": 0.02,
       "exposure": 1},
      ..
     ]
    }

Directions lead toward the light, at any length, in the camera's frame: x to the right of the
picture, y up, z from the surface to the camera. Lights are far away (suns), and so is the camera
(orthographic, or a long lens). Irradiance is that of a surface that faces the light, so a sun's
strength in Blender; ambient the radiance of a world that is the same from everywhere (0 if not
told). Both are one number, or three of linear red, green and blue. Under a light of irradiance pi a
white diffuse surface that faces it has the pixel 1, times `exposure` (1 if not told). `image` names
the file, or the image in Blender; where no picture has one, they stand in the order in which the
images are given.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from lobefit._native import InputError
from lobefit.checks import (
    Mismatch,
    Missing,
    bytes_of,
    checked_json,
    is_number,
    kind,
    list_of,
    number,
    object_of,
)

SCHEMA = 1
MOST_PICTURES = MOST_LIGHTS = 64
_MOST_BYTES = 1 << 20

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Light:
    """A light far away: the direction toward it, and the irradiance of what faces it."""

    direction: Triple
    irradiance: Triple


@dataclass(frozen=True)
class Lighting:
    """All that lit one picture; `image` is the name of its file, if that was told."""

    lights: Sequence[Light]
    ambient: Triple = (0.0, 0.0, 0.0)
    exposure: float = 1.0
    image: str | None = None

    def entries(self) -> dict[str, Any]:
        """What the compiled core takes."""
        lights = [(light.direction, light.irradiance) for light in self.lights]
        return {"lights": lights, "ambient": self.ambient, "exposure": self.exposure}


def read_lights(path: str | os.PathLike[str]) -> list[Lighting]:
    """The lighting of each picture in the file `path`. Raises InputError for anything else."""
    return lights_from_json(bytes_of(path, "a file of lights", _MOST_BYTES), str(path))


def lights_from_json(text: str | bytes, name: str = "lights") -> list[Lighting]:
    """The lighting of each picture in `text`; `name` is what to call it where it is refused."""
    if len(text) > _MOST_BYTES:
        raise InputError(f"{name}: expected a file of lights of up to 1 MiB, found a larger one.")
    data = checked_json(text, name, "a file of lights", _file)
    return [_lighting(picture) for picture in data["pictures"]]


def in_order(lighting: Sequence[Lighting], names: Sequence[str], file: str) -> list[Lighting]:
    """The lighting of the images with these names, one each; `file` told of the lights.

    Raises InputError where images and lights do not belong together.
    """
    if len(names) != len(lighting):
        raise InputError(
            f"{file}: expected the lights of as many pictures as images, {len(names)}, found "
            f"{len(lighting)}."
        )
    if lighting[0].image is None:
        return list(lighting)
    named = {each.image: each for each in lighting}
    for name in names:
        if name not in named:
            raise InputError(f"{file}: expected the lights of {name}, found no such picture.")
    if len(set(names)) < len(names):
        raise InputError(f"{file}: expected images of different names, found one twice.")
    return [named[name] for name in names]


def _lighting(picture: dict[str, Any]) -> Lighting:
    return Lighting(
        [
            Light(_triple(light["direction"]), _triple(light["irradiance"]))
            for light in picture["lights"]
        ],
        _triple(picture.get("ambient", 0)),
        float(picture.get("exposure", 1)),
        picture.get("image"),
    )


def _triple(value: Any) -> Triple:
    red, green, blue = value if isinstance(value, list) else [value] * 3
    return float(red), float(green), float(blue)


def _amount(value: Any, where: str) -> None:
    note = "one number or three, from 0 to 1e6"
    values = value if isinstance(value, list) else [value]
    fine = len(values) in (1, 3) and all(is_number(v) and 0 <= v <= 1e6 for v in values)
    if not fine or value == values[:1]:
        raise Mismatch(where, note, value)


def _irradiance(value: Any, where: str) -> None:
    _amount(value, where)
    if not any(_triple(value)):
        raise Mismatch(where, "above 0 in one channel at least", value)


def _direction(value: Any, where: str) -> None:
    list_of(number(-1e6, 1e6, "a number from -1e6 to 1e6"), 3)(value, where)
    if sum(part * part for part in value) < 1e-12:
        raise Mismatch(where, "a direction, at least 1e-6 long", value)


def _some(item: Any, most: int) -> Any:
    def check(value: Any, where: str) -> None:
        list_of(item)(value, where)
        if not 1 <= len(value) <= most:
            raise Mismatch(where, f"a list of 1 to {most}", _Found(f"one of {len(value)}"))

    return check


class _Found(Missing):
    """What is found, in words, where the value itself would tell too little."""

    def __init__(self, words: str) -> None:
        self._words = words

    def __str__(self) -> str:
        return self._words


def _file(data: Any, where: str) -> None:
    _SHAPE(data, where)
    images = [picture["image"] for picture in data["pictures"] if "image" in picture]
    count = len(data["pictures"])
    if images and len(images) < count:
        found = _Found(f"it in {len(images)} of {count}")
        raise Mismatch("the key image", "in every picture or in none", found)
    if len(set(images)) < len(images):
        raise Mismatch("pictures", "of different images", images)


_LIGHT = object_of({"direction": _direction, "irradiance": _irradiance}, strict=True)
_PICTURE = object_of(
    {"lights": _some(_LIGHT, MOST_LIGHTS)},
    {
        "ambient": _amount,
        "exposure": number(1e-6, 1e6, "a number from 1e-6 to 1e6"),
        "image": kind("a name", lambda value: isinstance(value, str) and value != ""),
    },
    strict=True,
)
_SHAPE = object_of(
    {
        "schema": kind(f"{SCHEMA}", lambda value: value == SCHEMA and value is not True),
        "pictures": _some(_PICTURE, MOST_PICTURES),
    },
    strict=True,
)
