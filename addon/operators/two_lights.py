"""The scene of the pictures, for the artist to open: their material beside the measurement."""

from typing import TYPE_CHECKING, ClassVar

import bpy
from bpy.props import BoolProperty, EnumProperty

from .. import native
from ..records import active_material, record_of
from .preview import measured

if TYPE_CHECKING:  # NumPy is loaded when it is used: Blender starts as soon as before.
    import numpy as np

_MEASURED_SIZE = 1024  # pixels of the sphere that is drawn beside

_SUBJECTS = (
    ("SPHERE", "Sphere", "A sphere of the active material"),
    ("OBJECT", "Active Object", "A copy of the active object, as large as the sphere"),
)


class LOBEFIT_OT_two_lights(bpy.types.Operator):
    """Bring the active material, or the active object, into a new scene with the two lights of \
the previews, beside the measurement"""

    bl_idname = "lobefit.two_lights"
    bl_label = "Open under Two Lights"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    subject: EnumProperty(
        name="Show", items=_SUBJECTS, default="SPHERE", description="What is lit by the two lights"
    )
    beside: BoolProperty(
        name="Measurement Beside",
        default=True,
        description="Show a sphere of the measurement itself to the left, if its file is found",
    )
    render: BoolProperty(
        name="Render", default=False, description="Render the scene at once, by Cycles"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if active_material(context) is None:
            cls.poll_message_set("No material is selected")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from .. import comparison

        material = active_material(context)
        subject = context.active_object if self.subject == "OBJECT" else None
        if self.subject == "OBJECT" and not _has_surface(subject):
            return self._refuse("Expected an active object with a surface, found none.")
        blend = comparison.BLEND
        if not blend.is_file():
            return self._refuse(f"{blend}: expected the scene of the extension, found no file.")
        reference = self._reference(material) if self.beside else None
        scene = comparison.open_scene(context, material, subject, reference)
        if self.render:
            if bpy.app.background:
                bpy.ops.render.render(scene=scene.name)
            else:
                bpy.ops.render.render("INVOKE_DEFAULT", scene=scene.name)
        return {"FINISHED"}

    def _reference(self, material: bpy.types.Material) -> "np.ndarray | None":
        """The light of the measured sphere (rows from the top), or None with a warning."""
        if record_of(material) is None:
            self.report({"WARNING"}, f"{material.name} was not made from a measurement")
            return None
        if native.problem():
            self.report({"WARNING"}, native.problem())
            return None
        import lobefit

        try:
            record, measurement = measured(material)
        except lobefit.InputError as error:
            self.report({"WARNING"}, str(error))
            return None
        if measurement is None:
            self.report({"WARNING"}, f"{record.source['path']}: no such file, nothing is beside.")
            return None
        return lobefit._native.preview(measurement, _MEASURED_SIZE)

    def _refuse(self, sentence: str) -> set[str]:
        self.report({"ERROR"}, sentence)
        return {"CANCELLED"}


def _has_surface(item: bpy.types.Object | None) -> bool:
    return item is not None and item.type in {"MESH", "CURVE", "SURFACE", "META", "FONT"}
