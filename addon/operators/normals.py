"""Normals from the shading of images that are loaded, in the Image editor."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, StringProperty

from .. import native, nodes
from ..records import KEY, active_material, record_of
from .import_measured import GLOB_DESCRIPTION
from .run import RunsWork

if TYPE_CHECKING:  # It is loaded when it is used: Blender starts as soon as before.
    from ..jobs import Estimate

SCALE_KEY = "lobefit_scale"  # of an image of heights: what 1 stands for, in widths of the image


class LOBEFIT_OT_find_normals(RunsWork, bpy.types.Operator):
    """Find the normals that explain the shading of images under known lights, for a Normal Map \
node, and heights for displacement. The file of lights says which images belong together"""

    bl_idname = "lobefit.find_normals"
    bl_label = "Normals from Shading"
    bl_options: ClassVar = {"REGISTER"}

    filepath: StringProperty(
        name="Lights",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
        description="What lit the images (LIGHTS.json), and their names where there are several",
    )
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"}, description=GLOB_DESCRIPTION)
    image: StringProperty(
        name="Image", options={"SKIP_SAVE"}, description="Which image, where the lights name none"
    )
    surface: EnumProperty(
        name="Surface",
        items=(
            ("material", "Measured Material", "As Cycles shows a material made of a measurement"),
            ("classic-phong", "Classic Phong", "Diffuse light, and a highlight around R.V"),
            ("classic-blinn-phong", "Blinn-Phong", "Diffuse light, and a highlight around N.H"),
        ),
        description="What the images show",
    )
    material: StringProperty(name="Material", description="A material made of a measurement")
    diffuse: FloatVectorProperty(
        name="Diffuse",
        subtype="COLOR",
        size=3,
        default=(0.8, 0.8, 0.8),
        min=0.0,
        soft_max=1.0,
        description="Color of the light that goes everywhere",
    )
    specular: FloatVectorProperty(
        name="Specular",
        subtype="COLOR",
        size=3,
        default=(0.0, 0.0, 0.0),
        min=0.0,
        soft_max=1.0,
        description="Color of the highlight",
    )
    exponent: FloatProperty(
        name="Exponent",
        default=50.0,
        min=0.0,
        soft_max=1000.0,
        description="How narrow the highlight is",
    )
    heights: BoolProperty(
        name="Heights", default=True, description="Also make an image for a Displacement node"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not bpy.data.images:
            cls.poll_message_set("There is no image")
            return False
        return super().poll(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks for the file of lights, with the options beside it."""
        shown = getattr(context, "edit_image", None)
        self.image = self.image or (shown.name if shown else "")
        active = active_material(context)
        if not self.material and record_of(active) is not None:
            self.material = active.name
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        import lobefit

        from ..jobs import Estimate

        try:
            job = self._job()
        except lobefit.InputError as error:
            return self.refuse(str(error))
        return self.start(context, Estimate(job))

    def conclude(self, context: bpy.types.Context, work: "Estimate") -> set[str]:
        if work.problem:
            return self.refuse(work.problem)
        import numpy as np
        from lobefit import normals

        from ..images import new_data_image

        name = self._first
        found = new_data_image(f"{name} Normals", normals.as_normal_map(work.surface.normals))
        told = f"{found.name} is for a Normal Map node"
        if self.heights:
            heights, scale = normals.as_displacement(work.surface.heights)
            image = new_data_image(f"{name} Heights", np.repeat(heights[..., None], 3, axis=2))
            image[SCALE_KEY] = scale
            told += (
                f", {image.name} for a Displacement node with Midlevel 0 and Scale {scale:.4g} "
                "times the width that the image has"
            )
        if context.area and context.area.type == "IMAGE_EDITOR":
            context.space_data.image = found
        self.report({"INFO"}, told)
        bpy.ops.ed.undo_push(message=self.bl_label)
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop_search(self, "image", bpy.data, "images")
        layout.prop(self, "surface")
        if self.surface == "material":
            layout.prop_search(self, "material", bpy.data, "materials")
        else:
            for name in ("diffuse", "specular", "exponent"):
                layout.prop(self, name)
        layout.prop(self, "heights")

    def _job(self) -> Any:
        """The estimate, started. Raises InputError for what it cannot be started with."""
        import lobefit
        from lobefit import lights, normals

        from ..images import linear_light

        if not self.filepath:
            raise lobefit.InputError("File Path: expected a file of lights, found none.")
        path = bpy.path.abspath(self.filepath)
        lighting = lights.read_lights(path)
        names = [each.image or self.image for each in lighting]
        lighting = lights.in_order(lighting, names, path)
        source = self._source()
        self._first = names[0]
        pictures = normals.together(names, list(map(linear_light, _images(names))))
        return normals.Job(pictures.values, lighting, source, pictures.mask, pictures.saturation)

    def _source(self) -> Any:
        """What the images show, as `lobefit.normals` takes it."""
        from lobefit import InputError, Record

        if self.surface != "material":
            classic = {"diffuse": list(self.diffuse), "specular": list(self.specular)}
            return "classic", {"model": self.surface, **classic, "exponent": self.exponent}
        material = bpy.data.materials.get(self.material)
        if record_of(material) is None:
            found = f"'{self.material}'" if self.material else "none"
            raise InputError(f"Material: expected one made of a measurement, found {found}.")
        record = Record.from_json(material[KEY], material.name)
        return nodes.material.shown_by(material, record).shown(record)


def _images(names: Sequence[str]) -> list[bpy.types.Image]:
    """The images of these names. Raises InputError where one has no pixels."""
    from lobefit import InputError

    images = []
    for name in names:
        image = bpy.data.images.get(name)
        if image is None:
            raise InputError(f"Image: expected one named '{name}', found none.")
        if 0 in image.size:
            raise InputError(f"{name}: expected an image with pixels, found none.")
        images.append(image)
    return images


def draw_menu(self: Any, context: bpy.types.Context) -> None:
    """The entry in the Image editor's menu Image."""
    self.layout.separator()
    self.layout.operator(LOBEFIT_OT_find_normals.bl_idname, icon="NORMALS_FACE")
