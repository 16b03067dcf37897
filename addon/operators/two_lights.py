"""The scene of the pictures, for the artist to open: their material beside the measurement."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import bpy
from bpy.props import BoolProperty, EnumProperty
from mathutils import Matrix, Vector

from .. import native, nodes
from ..records import active_material, record_of
from .preview import measured

if TYPE_CHECKING:  # NumPy is loaded when it is used: Blender starts as soon as before.
    import numpy as np

BLEND = Path(__file__).parents[1] / "blend_files" / "two_lights.blend"
_SCENE = "Two Lights"
_MEASURED_SIZE = 1024  # pixels of the sphere that is drawn beside
_APART = 1.05  # half of the way between the two spheres, of radius 1
# What is up for an artist (z) is up in the picture (y), and their front is toward the camera.
_UPRIGHT = Matrix.Rotation(-math.pi / 2, 4, "X")

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
        material, subject = active_material(context), context.active_object
        if self.subject == "OBJECT" and not _has_surface(subject):
            return self._refuse("Expected an active object with a surface, found none.")
        if not BLEND.is_file():
            return self._refuse(f"{BLEND}: expected the scene of the extension, found no file.")
        reference = self._reference(material) if self.beside else None
        depsgraph = context.evaluated_depsgraph_get()
        scene = _appended()
        sphere = next(item for item in scene.objects if item.type == "MESH")
        shown = sphere
        if self.subject == "OBJECT":
            shown = _fitted_copy(subject, depsgraph)
            scene.collection.objects.link(shown)
            bpy.data.objects.remove(sphere)
        else:
            sphere.data.materials[0] = material
        _remove_unused()
        if reference is not None:
            _put_beside(scene, shown, reference, material.name)
        context.window.scene = scene
        shown.select_set(True)
        context.view_layer.objects.active = shown
        _look_through_camera(context)
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


def _appended() -> bpy.types.Scene:
    with bpy.data.libraries.load(str(BLEND)) as (_, ours):
        ours.scenes = [_SCENE]
    return ours.scenes[0]


def _remove_unused() -> None:
    """Removes what came with the scene to be replaced."""
    for material in [m for m in bpy.data.materials if m.users == 0 and m.name == "Material"]:
        bpy.data.materials.remove(material)


def _fitted_copy(item: bpy.types.Object, depsgraph: Any) -> bpy.types.Object:
    """A copy of an object that shares its data, upright within a sphere of radius 1."""
    corners = [
        item.matrix_world @ Vector(corner) for corner in item.evaluated_get(depsgraph).bound_box
    ]
    centre = sum(corners, Vector()) / len(corners)
    radius = max((corner - centre).length for corner in corners) or 1.0
    copy = item.copy()
    copy.animation_data_clear()
    copy.parent = None
    copy.constraints.clear()
    copy.hide_render = copy.hide_viewport = False
    copy.matrix_world = (
        Matrix.Scale(1 / radius, 4) @ _UPRIGHT @ Matrix.Translation(-centre) @ item.matrix_world
    )
    return copy


def _put_beside(
    scene: bpy.types.Scene, shown: bpy.types.Object, reference: "np.ndarray", name: str
) -> None:
    """Makes room in the picture for the measured sphere, to the left of what is shown."""
    shown.matrix_world = Matrix.Translation((_APART, 0, 0)) @ shown.matrix_world
    image = _image(f"{name} measured", reference)
    mesh = bpy.data.meshes.new("Measured")
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new()
    for loop, (x, y, _) in zip(layer.data, corners, strict=True):
        loop.uv = ((x + 1) / 2, (y + 1) / 2)
    mesh.materials.append(_picture_material(image))
    plane = bpy.data.objects.new("Measured", mesh)
    plane.location = (-_APART, 0, 0)
    # It is for the camera: its light, which is brightest in the highlights, is not to fall on what
    # stands beside it.
    for ray in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(plane, f"visible_{ray}", False)
    scene.collection.objects.link(plane)
    scene.camera.data.ortho_scale = 4 * _APART
    scene.render.resolution_x = 2 * scene.render.resolution_y


def _image(name: str, light: "np.ndarray") -> bpy.types.Image:
    import numpy as np

    from ..images import for_blender

    size = len(light)
    place = (np.arange(size) + 0.5) * 2 / size - 1
    cover = np.hypot(place, place[:, None]) < 1
    pixels = for_blender(np.dstack([np.nan_to_num(light), cover]))
    image = bpy.data.images.new(name, size, size, alpha=True, float_buffer=True, is_data=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


def _picture_material(image: bpy.types.Image) -> bpy.types.Material:
    """Shows the light of a picture as it is, and nothing where there is none in it."""
    material = bpy.data.materials.new(image.name)
    material.cycles.emission_sampling = "NONE"
    tree = nodes.tree.empty_shader_tree(material)
    picture, light, nothing, mix, output = (
        tree.nodes.new(f"ShaderNode{name}")
        for name in ("TexImage", "Emission", "BsdfTransparent", "MixShader", "OutputMaterial")
    )
    picture.image = image
    for place, node in enumerate((picture, light, nothing, mix, output)):
        node.location = (250.0 * place, 0.0)
    tree.links.new(picture.outputs["Color"], light.inputs["Color"])
    tree.links.new(picture.outputs["Alpha"], mix.inputs[0])
    tree.links.new(nothing.outputs[0], mix.inputs[1])
    tree.links.new(light.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def _look_through_camera(context: bpy.types.Context) -> None:
    for area in context.window.screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.region_3d.view_perspective = "CAMERA"
