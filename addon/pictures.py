"""Pictures of materials for the panel, as icons, and for the Image Editor.

They are there as long as Blender runs, and nothing of them is saved.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import bpy

from .records import COUNT_KEY, KEY, KIND_KEY

if TYPE_CHECKING:  # NumPy is loaded when it is used: Blender starts as soon as before.
    import numpy as np

IMAGE = "Lobefit Preview"

_icons: Any = (
    None  # by the session_uid of a material and the title of the picture; None before the first
)
_kept: dict[tuple[int, str], "Drawn"] = {}  # by the same, but for the title


class Drawn(NamedTuple):
    """Pictures that were drawn together, sRGB with rows from the top, and what is said of them.

    A fourth channel is the share of each pixel that is covered.
    """

    pictures: "dict[str, np.ndarray]"
    stamp: int
    caption: str = ""


def keep(
    material: bpy.types.Material,
    place: str,
    pictures: "dict[str, np.ndarray]",
    caption: str = "",
) -> None:
    """Takes pictures by their titles in the place of older ones.

    `place` names the part of the panel that shows them.
    """
    import bpy.utils.previews

    from .images import for_blender

    global _icons
    if _icons is None:
        _icons = bpy.utils.previews.new()
    for title, picture in pictures.items():
        key = _key(material, place, title)
        icon = _icons[key] if key in _icons else _icons.new(key)
        icon.image_size = picture.shape[1], picture.shape[0]
        icon.image_pixels_float.foreach_set(for_blender(picture).ravel())
    _kept[material.session_uid, place] = Drawn(pictures, stamp(material), caption)


def kept(material: bpy.types.Material, place: str) -> Drawn | None:
    """What was drawn last for this part of the panel."""
    return _kept.get((material.session_uid, place))


def icon_id(material: bpy.types.Material, place: str, title: str) -> int:
    """The number of a kept picture, for `template_icon`."""
    return _icons[_key(material, place, title)].icon_id


def as_image(drawn: Drawn) -> bpy.types.Image:
    """The pictures side by side as an image of the file, which takes the place of an older one."""
    import numpy as np

    from .images import for_blender

    pixels = for_blender(np.concatenate(list(drawn.pictures.values()), axis=1))
    rows, columns = pixels.shape[:2]
    image = bpy.data.images.get(IMAGE) or bpy.data.images.new(IMAGE, columns, rows)
    if tuple(image.size) != (columns, rows):
        image.scale(columns, rows)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


def stamp(material: bpy.types.Material) -> int:
    """A number that changes with the record, the kind and every value on a node."""
    nodes = material.node_tree.nodes if material.node_tree else ()
    values = [
        str(tuple(value) if hasattr(value, "__len__") else value)
        for node in nodes
        for socket in node.inputs
        if (value := getattr(socket, "default_value", None)) is not None
    ]
    links = len(material.node_tree.links) if material.node_tree else 0
    told = (material.get(KEY), material.get(KIND_KEY), material.get(COUNT_KEY))
    return hash((*told, links, *values))


def unregister() -> None:
    """Forgets all of them."""
    global _icons
    if _icons is not None:
        bpy.utils.previews.remove(_icons)
    _icons = None
    _kept.clear()


def _key(material: bpy.types.Material, place: str, title: str) -> str:
    return f"{material.session_uid} {place} {title}"
