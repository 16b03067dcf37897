"""File > Import > Measured BRDF, and the same by dropping files on a window."""

from collections.abc import Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import bpy
from bpy.props import (
    CollectionProperty,
    EnumProperty,
    FloatVectorProperty,
    IntProperty,
    StringProperty,
)
from bpy_extras.io_utils import ImportHelper

from .. import native, nodes
from ..properties import draw_fit_options
from ..targets import (
    SlotTarget,
    TreeTarget,
    cursor_location,
    shows_material,
    takes_material,
)
from .run import RunsFits

if TYPE_CHECKING:  # It is loaded when it is used: Blender starts as soon as before.
    from ..jobs import Outcome

MEASURED_SUFFIXES = (".binary", ".bsdf")
MEASURED_GLOB = ";".join(f"*{suffix}" for suffix in MEASURED_SUFFIXES)
GLOB_DESCRIPTION = "Which files the file browser shows"

PLACES = (
    ("SLOT", "Material Slot", "Into a slot of an object, if it takes materials"),
    ("NONE", "No Object", "A new material that a fake user keeps"),
    ("NODES", "Shader Editor", "As a group in the node tree that the shader editor shows"),
)


class ChoosesFiles(ImportHelper):
    """What operators have in common that ask for several files of a folder."""

    directory: StringProperty(
        name="Folder",
        subtype="DIR_PATH",
        options={"HIDDEN", "SKIP_SAVE"},
        description="Where the files are",
    )
    files: CollectionProperty(
        name="Files",
        type=bpy.types.OperatorFileListElement,
        options={"HIDDEN", "SKIP_SAVE"},
        description="The names of the files in the folder",
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks for files, unless they were dropped."""
        if self.directory:
            return self.execute(context)
        return ImportHelper.invoke(self, context, event)

    def chosen(self) -> list[Path]:
        """The files that were chosen; none where only a folder was."""
        folder = Path(bpy.path.abspath(self.directory))
        names = [folder / item.name for item in self.files if item.name]
        if names or not Path(self.filepath).name:
            return names
        return [Path(bpy.path.abspath(self.filepath))]


class LOBEFIT_OT_import_measured(RunsFits, bpy.types.Operator, ChoosesFiles):
    """Fit measured reflectance files and make a material of each"""

    bl_idname = "lobefit.import_measured"
    bl_label = "Import BRDF"
    bl_options: ClassVar = {"REGISTER", "PRESET"}

    filename_ext = ".binary"
    filter_glob: StringProperty(
        default=MEASURED_GLOB, options={"HIDDEN"}, description=GLOB_DESCRIPTION
    )
    place: EnumProperty(
        name="Put Into",
        items=PLACES,
        default="SLOT",
        options={"SKIP_SAVE"},
        description="Where the material of a single file goes. Those of several get fake users",
    )
    object: StringProperty(
        name="Object",
        options={"HIDDEN", "SKIP_SAVE"},
        description="The object whose slot is filled; the active one if empty",
    )
    slot: IntProperty(
        name="Slot",
        default=-1,
        min=-1,
        options={"HIDDEN", "SKIP_SAVE"},
        description="The slot of the object to fill, from 0; the active one if -1",
    )
    location: FloatVectorProperty(
        name="Location",
        size=2,
        options={"HIDDEN", "SKIP_SAVE"},
        description="Where in the node tree the group goes",
    )

    _aimed: SlotTarget | None = None  # the slot that a drop or an editor stands for
    _target: SlotTarget | TreeTarget | None = None

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks for files, unless they were dropped; the editor under the cursor is the place."""
        if not self.properties.is_property_set("place"):
            self._place_by_editor(context, event)
        return ChoosesFiles.invoke(self, context, event)

    def _place_by_editor(self, context: bpy.types.Context, event: bpy.types.Event) -> None:
        dropped = bool(self.directory)
        match context.area.type if context.area else "":
            case "VIEW_3D" if dropped:
                from ..picking import slot_under

                region = context.region
                place = event.mouse_x - region.x, event.mouse_y - region.y
                self._aim_at(slot_under(context, place) if region.type == "WINDOW" else None)
            case "NODE_EDITOR" if shows_material(context.space_data):
                if context.space_data.edit_tree:
                    self.place, self.location = "NODES", cursor_location(context, event)
            case "PROPERTIES":
                item = context.object
                self._aim_at((item, item.active_material_index) if takes_material(item) else None)

    def _aim_at(self, slot: tuple[bpy.types.Object, int] | None) -> None:
        self.place = "SLOT" if slot else "NONE"
        self._aimed = SlotTarget(*slot) if slot else None

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        paths = self.chosen()
        if not paths:
            return self.refuse("Expected at least one measured file, found none chosen.")
        problem = self._find_target(context) if len(paths) == 1 else ""
        if problem:
            return self.refuse(problem)
        return self.fit(context, list(map(str, paths)))

    def _find_target(self, context: bpy.types.Context) -> str:
        """Keeps where the material shall go; says why if there is no such place."""
        if self.place == "NODES":
            editor = context.space_data
            if not shows_material(editor) or editor.edit_tree is None:
                return "Expected a shader editor that shows a material's nodes, found none."
            self._target = TreeTarget(editor, tuple(self.location))
            return self._target.lock and f"The node tree cannot be edited: {self._target.lock}."
        if self.place == "SLOT":
            self._target = self._aimed or self._named_slot(context)
            if self.object and self._target is None:
                return f"object: expected one that takes a material, found '{self.object}'."
        return ""

    def _named_slot(self, context: bpy.types.Context) -> SlotTarget | None:
        item = context.active_object
        if self.object:
            named = [item for item in context.scene.objects if item.name == self.object]
            # A local one, as an override is, may have the name of a linked one.
            item = min(named, key=lambda item: item.library is not None, default=None)
        if not takes_material(item):
            return None
        return SlotTarget(item, item.active_material_index if self.slot < 0 else self.slot)

    def apply(
        self, context: bpy.types.Context, done: list["Outcome"]
    ) -> Generator[None, None, str]:
        options = self.material_options()
        if isinstance(self._target, TreeTarget):
            return self._target.put(done[0].record, **options)
        yield from self._make_materials(done, options)
        return ""

    def _make_materials(
        self, done: Sequence["Outcome"], options: dict[str, Any]
    ) -> Generator[None, None, None]:
        groups = {group.session_uid for group in bpy.data.node_groups}
        made: list[int] = []
        try:
            for outcome in done:
                yield
                material = nodes.material.build_material(outcome.record, **options)
                made.append(material.session_uid)
                problem = self._target.put(material) if self._target else ""
                if problem:
                    self.report({"WARNING"}, problem)
                # A material without a user would be lost when the file is saved.
                material.use_fake_user = material.users == 0
        except BaseException:
            nodes.material.discard(made, groups)
            raise

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        draw_fit_options(self.layout, self)
        self.layout.prop(self, "place")


class LOBEFIT_FH_measured(bpy.types.FileHandler):
    """Files of measured reflectance that are dropped on a window"""

    bl_idname = "LOBEFIT_FH_measured"
    bl_label = "Measured BRDF"
    bl_import_operator = LOBEFIT_OT_import_measured.bl_idname
    bl_file_extensions = ";".join(MEASURED_SUFFIXES)

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        match context.area.type if context.area else "":
            case "VIEW_3D":
                return True
            case "PROPERTIES":
                return context.space_data.context == "MATERIAL"
        return shows_material(context.space_data)


def draw_menu(self, context: bpy.types.Context) -> None:
    """The entry in File > Import."""
    self.layout.operator(
        LOBEFIT_OT_import_measured.bl_idname, text="Measured BRDF (.binary, .bsdf)", icon="MATERIAL"
    )
