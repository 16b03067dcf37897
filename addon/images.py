"""The pixels of Blender's images, as linear light or as data."""

from typing import Any

import bpy
import numpy as np


def linear_light(image: bpy.types.Image) -> Any:
    """An image as `lobefit.images.Image`.

    Images of bytes are decoded from sRGB unless their color space says that they are not.
    """
    from lobefit.images import image_of

    columns, rows = image.size
    pixels = np.empty(rows * columns * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(rows, columns, image.channels)[::-1]
    alpha = 3 if image.channels == 4 else None
    return image_of(
        pixels,
        alpha,
        whole=not image.is_float,
        encoded=not image.is_float and image.colorspace_settings.name == "sRGB",
    )


def for_blender(picture: np.ndarray) -> np.ndarray:
    """The picture with its rows from below, as Blender wants it, and how opaque each pixel is."""
    pixels = np.ones((*picture.shape[:2], 4), np.float32)
    pixels[..., : picture.shape[2]] = picture[::-1]
    return pixels


def new_data_image(name: str, values: np.ndarray) -> bpy.types.Image:
    """A new floating-point image of data (rows, columns, 3), packed into the file."""
    rows, columns = values.shape[:2]
    image = bpy.data.images.new(name, columns, rows, float_buffer=True, is_data=True)
    image.pixels.foreach_set(for_blender(values).ravel())
    image.update()
    image.pack()
    return image
