"""Shows a measurement beside the material that was made of it: drawn at once, or by Cycles."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty

from .. import native, nodes, pictures
from ..records import KEY, active_material, located, record_of
from .at_once import ActsAtOnce
from .polls import poll_measured
from .run import RunsWork

# NumPy, and what starts processes, are loaded when they are used: Blender starts as soon as before.
if TYPE_CHECKING:
    import numpy as np

    from ..child import Child

SPHERES, CHARTS = "spheres", "charts"
COLUMNS = {"measured": "Measured", "cycles": "As in Cycles", "difference": "Error x4"}
RENDERED = "By Cycles"
CHART_KINDS = (
    ("ERROR_MAP", "Error Map", "Where what Cycles shows is off, by half and difference angle"),
    (
        "LOBE",
        "Lobe",
        "Reflectance in the plane of a light: measured, fitted and as Cycles shows it",
    ),
    ("ALBEDO", "Albedo", "How much of the light is reflected, by view angle"),
)

_SIZE = 192  # pixels a sphere


def draw_spheres(
    material: bpy.types.Material, rendered: "np.ndarray | None" = None, size: int = _SIZE
) -> str:
    """Draws the spheres of a measured material for the panel and says what is missing.

    `rendered` is what Cycles gave of it. Raises InputError where record or file cannot be read.
    """
    import numpy as np
    from lobefit import _native, preview
    from lobefit.picture import disc

    record, measurement = measured(material)
    choice = nodes.material.shown_by(material, record)
    shown, caption, missing = choice.shown(record), "", ""
    if nodes.parameters.is_edited(material, record_of(material), choice.kind):
        edited = nodes.parameters.edited_shown(material, shown)
        if edited is None and rendered is None:
            missing = "No formula tells the material as it was edited: it is shown as fitted"
        shown = edited or shown
        if edited and measurement:
            off = _native.picture_error(measurement, shown)
            caption = f"As edited, {off:.1%} of the reflected light is off."
    spheres = preview.compared(measurement, shown, size, rendered)
    titles = COLUMNS if rendered is None else COLUMNS | {"cycles": RENDERED}
    cover = disc(size)
    drawn = {titles[name]: np.dstack([image, cover]) for name, image in spheres.items()}
    pictures.keep(material, SPHERES, drawn, caption)
    if measurement is None:
        missing = f"{record.source['path']}: no such file, only the material is shown."
    return missing


def measured(material: bpy.types.Material) -> tuple[Any, Any]:
    """The record in a material and the measurement it was made of, None where that is not found.

    Raises InputError where one of them cannot be read.
    """
    import lobefit
    from lobefit import preview

    record = located(lobefit.Record.from_json(material[KEY], material.name))
    return record, preview.measurement_of(record)


class LOBEFIT_OT_preview(ActsAtOnce, bpy.types.Operator):
    """Draw a sphere under two lights: measured, as Cycles will show it, and their difference"""

    bl_idname = "lobefit.preview"
    bl_label = "Preview Measured BRDF"
    bl_options: ClassVar = {"REGISTER"}

    size: IntProperty(
        name="Size", default=_SIZE, min=16, max=1024, description="Width of a sphere in pixels"
    )

    def act(self, material: bpy.types.Material) -> str:
        return draw_spheres(material, size=self.size)


class LOBEFIT_OT_draw_chart(ActsAtOnce, bpy.types.Operator):
    """Draw where the active material is off, its lobe, or how much light it reflects"""

    bl_idname = "lobefit.draw_chart"
    bl_label = "Draw Chart"
    bl_options: ClassVar = {"REGISTER"}

    chart: EnumProperty(
        name="Chart", items=CHART_KINDS, default="ERROR_MAP", description="What to draw"
    )
    incidence: FloatProperty(
        name="Light Angle",
        default=45.0,
        min=0.0,
        max=89.0,
        description="Degrees between the normal and the light, for the chart Lobe",
    )

    def act(self, material: bpy.types.Material) -> str:
        from lobefit import charts

        record, measurement = measured(material)
        choice = nodes.material.shown_by(material, record)
        shown = nodes.parameters.edited_shown(material, choice.shown(record)) or choice.shown(
            record
        )
        missing = "" if measurement else "The measured file is not found: the fitted lobe is drawn"
        if self.chart == "ERROR_MAP":
            picture = charts.draw_error_map(record, measurement, shown)
        elif self.chart == "LOBE":
            picture = charts.draw_lobe(record, measurement, shown, self.incidence)
        else:
            picture, missing = charts.draw_albedo(choice.albedo(record)), ""
        titles = {key: label for key, label, _ in CHART_KINDS}
        pictures.keep(material, CHARTS, {titles[self.chart]: picture})
        return missing


class LOBEFIT_OT_render_preview(RunsWork, bpy.types.Operator):
    """Render the active material under the two lights by Cycles, in another Blender meanwhile"""

    bl_idname = "lobefit.render_preview"
    bl_label = "Render Preview"
    bl_options: ClassVar = {"REGISTER"}

    size: IntProperty(
        name="Size", default=_SIZE, min=16, max=1024, description="Width of a sphere in pixels"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_measured(cls, context) and super().poll(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self.execute(context)

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        import tempfile

        from lobefit.preview import FINER_AT_ONCE

        from ..child import Child

        material = active_material(context)
        self._material_uid = material.session_uid
        # The other Blender reads a file of the material as it is now, saved or not.
        self._folder = tempfile.TemporaryDirectory(prefix="lobefit-")
        folder = Path(self._folder.name)
        bpy.data.libraries.write(str(folder / "material.blend"), {material})
        size = str(self.size * FINER_AT_ONCE)
        words = ["render", str(folder / "material.blend"), "--size", size, "--linear", "--json"]
        return self.start(context, Child([*words, "-o", str(folder)]))

    def conclude(self, context: bpy.types.Context, work: "Child") -> set[str]:
        import lobefit
        import numpy as np

        with self._folder:
            for problem in work.problems:
                self.report({"ERROR"}, problem)
            places = [result["picture"] for result in work.results]
            rendered = [np.load(place) for place in places if place.endswith(".npy")]
        found = [m for m in bpy.data.materials if m.session_uid == self._material_uid]
        if not rendered:
            return {"CANCELLED"}
        if not found:
            return self.refuse("The material was removed while it was rendered.")
        try:
            missing = draw_spheres(found[0], rendered[0], self.size)
        except lobefit.InputError as error:
            return self.refuse(str(error))
        if missing:
            self.report({"WARNING"}, missing)
        return {"FINISHED"}


class LOBEFIT_OT_open_picture(bpy.types.Operator):
    """Show the spheres or the chart of the active material in an Image Editor, large"""

    bl_idname = "lobefit.open_picture"
    bl_label = "Open Picture"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    picture: EnumProperty(
        name="Picture",
        items=(
            (SPHERES, "Spheres", "The spheres under two lights"),
            (CHARTS, "Chart", "The chart that was drawn last"),
        ),
        default=SPHERES,
        description="Which of the pictures of the panel",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = active_material(context)
        found = any(material and pictures.kept(material, place) for place in (SPHERES, CHARTS))
        if not found:
            cls.poll_message_set("Nothing was drawn of the active material yet")
        return bool(found)

    def execute(self, context: bpy.types.Context) -> set[str]:
        drawn = pictures.kept(active_material(context), self.picture)
        if drawn is None:
            self.report({"ERROR"}, "Expected a picture that was drawn before, found none.")
            return {"CANCELLED"}
        image = pictures.as_image(drawn)
        if not bpy.app.background:
            bpy.ops.wm.window_new()
            area = context.window_manager.windows[-1].screen.areas[0]
            area.type = "IMAGE_EDITOR"
            area.spaces.active.image = image
        return {"FINISHED"}
