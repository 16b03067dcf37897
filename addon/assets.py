"""Materials as assets: what a browser shows of them, and whether a library holds it."""

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .records import KEY

_ICON = 32  # pixels of the picture in lists


def mark_asset(material: bpy.types.Material, asset: Any, catalogue: str, description: str) -> None:
    """Makes an asset of a material, with what a `lobefit.library.Asset` tells of it.

    `catalogue` is the UUID of its catalogue.
    """
    material.asset_mark()
    data = material.asset_data
    data.catalog_id = catalogue
    data.author, data.license, data.description = asset.author, asset.licence, description
    for tag in asset.tags:
        data.tags.new(tag, skip_if_exists=True)


def set_picture(material: bpy.types.Material, pixels: NDArray[np.float32]) -> None:
    """Gives a material its own picture, (size, size, 4) in sRGB, the first row at the top.

    `size` is a multiple of 32. Blender then draws none of its own.
    """
    preview = material.preview_ensure()
    size = pixels.shape[0]
    step = size // _ICON
    small = pixels.reshape(_ICON, step, _ICON, step, 4).mean((1, 3), np.float32)
    preview.image_size, preview.icon_size = (size, size), (_ICON, _ICON)
    # Blender's pictures begin at the bottom.
    preview.image_pixels_float.foreach_set(pixels[::-1].ravel())
    preview.icon_pixels_float.foreach_set(small[::-1].ravel())


def missing_assets(wanted: Sequence[tuple[str, str]]) -> list[str]:
    """The names of those materials, each with its record, that the open file lacks as assets."""
    return [name for name, record in wanted if not _is_whole(bpy.data.materials.get(name), record)]


def _is_whole(material: bpy.types.Material | None, record: str) -> bool:
    if material is None or material.asset_data is None or material.get(KEY) != record:
        return False
    preview = material.preview
    return preview is not None and any(preview.image_pixels)


def oldest_release() -> str:
    """The oldest Blender, from 4.2 on, that opens what this one saves."""
    return "4.5" if bpy.app.version >= (5, 0) else "4.2"
