"""Shows a measurement beside the material that was made of it, without rendering."""

from typing import TYPE_CHECKING, Any, ClassVar

import bpy
import bpy.utils.previews

from .. import native
from ..nodes.material import shown_by
from ..records import KEY, active_material, record_of

# NumPy is loaded when it is used: it would double the time that Blender takes to start.
if TYPE_CHECKING:
    import numpy as np

IMAGE = "Lobefit Preview"
COLUMNS = {"measured": "Measured", "cycles": "As in Cycles", "difference": "Error x4"}
_SIZE = 160  # pixels a sphere

_icons: Any = None  # the spheres of the panel, by their material and column


class LOBEFIT_OT_preview(bpy.types.Operator):
    """Draw a sphere under two lights: measured, as Cycles will show it, and their difference"""

    bl_idname = "lobefit.preview"
    bl_label = "Preview Measured BRDF"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        found = record_of(active_material(context)) is not None
        if not found:
            cls.poll_message_set("The active material was not made from a measurement")
        return found

    def execute(self, context: bpy.types.Context) -> set[str]:
        problem = native.problem()
        if problem:
            self.report({"ERROR"}, problem)
            return {"CANCELLED"}
        import lobefit
        import numpy as np
        from lobefit import preview

        material = active_material(context)
        try:
            record = lobefit.Record.from_json(material[KEY], material.name)
            measurement = preview.measurement_of(record)
            shown = shown_by(material, record).shown(record)
            row = preview.row(record, measurement, _SIZE, shown=shown)
        except lobefit.InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        spheres = {name: row.panels[name].image for name in COLUMNS if name in row.panels}
        _fill_image(_with_alpha(np.concatenate(list(spheres.values()), axis=1)))
        for name, sphere in spheres.items():
            _fill_icon(_key(material, name), _with_alpha(sphere))
        if "measured" not in row.panels:
            self.report(
                {"WARNING"}, f"{record.source['path']}: no such file, only the fit is shown."
            )
        return {"FINISHED"}


def icons_of(material: bpy.types.Material) -> dict[str, int]:
    """The icons of a material's preview by the title of the column; none before it is made."""
    keys = {title: _key(material, name) for name, title in COLUMNS.items()}
    return {title: _icons[key].icon_id for title, key in keys.items() if key in _icons}


def register() -> None:
    global _icons
    _icons = bpy.utils.previews.new()
    bpy.utils.register_class(LOBEFIT_OT_preview)


def unregister() -> None:
    bpy.utils.unregister_class(LOBEFIT_OT_preview)
    bpy.utils.previews.remove(_icons)


def _key(material: bpy.types.Material, name: str) -> str:
    return f"{material.session_uid} {name}"


def _with_alpha(picture: "np.ndarray") -> "np.ndarray":
    """An sRGB picture with its rows from the top as Blender wants it: from below, and opaque."""
    import numpy as np

    pixels = np.ones((*picture.shape[:2], 4), np.float32)
    pixels[..., :3] = picture[::-1]
    return pixels


def _fill_image(pixels: "np.ndarray") -> None:
    rows, columns = pixels.shape[:2]
    image = bpy.data.images.get(IMAGE) or bpy.data.images.new(IMAGE, columns, rows)
    if tuple(image.size) != (columns, rows):
        image.scale(columns, rows)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()


def _fill_icon(key: str, pixels: "np.ndarray") -> None:
    icon = _icons[key] if key in _icons else _icons.new(key)
    icon.image_size = pixels.shape[1], pixels.shape[0]
    icon.image_pixels_float.foreach_set(pixels.ravel())
