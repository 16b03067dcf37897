"""Asset libraries: made of measured files by another Blender, and told to the preferences."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import bpy
from bpy.props import BoolProperty, StringProperty

from .. import native
from ..preferred import library_folder
from ..properties import LibraryOptions, draw_library_options
from .import_measured import GLOB_DESCRIPTION, MEASURED_GLOB, ChoosesFiles
from .run import RunsWork

# What starts processes is loaded when it is used, so that Blender starts as soon as before.
if TYPE_CHECKING:
    from ..child import Child

_made: list[Path] = []  # the folders of libraries that were made, as long as Blender runs


class LOBEFIT_OT_make_library(LibraryOptions, RunsWork, bpy.types.Operator, ChoosesFiles):
    """Fit measured reflectance files, or all of a folder, into a file of material assets"""

    bl_idname = "lobefit.make_library"
    bl_label = "Make BRDF Library"
    bl_options: ClassVar = {"REGISTER", "PRESET"}

    filter_glob: StringProperty(
        default=f"{MEASURED_GLOB};*.json", options={"HIDDEN"}, description=GLOB_DESCRIPTION
    )
    library: StringProperty(
        name="Library",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
        description=(
            "The .blend file to write; if empty, one named like the folder, in it or where the "
            "preferences tell"
        ),
    )
    add_to_preferences: BoolProperty(
        name="Add to Asset Libraries",
        default=False,
        description="Show the folder of the library in every Asset Browser",
    )

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..child import Child

        # Where no file was chosen, the folder was.
        sources = self.chosen() or [Path(bpy.path.abspath(self.directory))]
        if not sources[0].name:
            return self.refuse("Expected measured files or a folder of them, found none chosen.")
        folder = sources[0] if sources[0].is_dir() else sources[0].parent
        place = library_folder(folder) / f"{folder.name}.blend"
        library = bpy.path.abspath(self.library) or str(place)
        return self.start(context, Child(self.command(list(map(str, sources)), library)))

    def conclude(self, context: bpy.types.Context, work: "Child") -> set[str]:
        made = [result for result in work.results if "library" in result]
        for problem in work.problems:
            self.report({"WARNING" if made else "ERROR"}, problem)
        if not made:
            return {"CANCELLED"}
        folder = Path(made[0]["library"]).parent
        _made.append(folder)
        if self.add_to_preferences:
            _add_to_preferences(folder)
        self.report(
            {"INFO"},
            f"{made[0]['library']}: {made[0]['materials']} materials; opens in Blender "
            f"{made[0]['opens_in']} and later",
        )
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        draw_library_options(self.layout, self)
        for name in ("library", "add_to_preferences"):
            self.layout.prop(self, name)


class LOBEFIT_OT_add_asset_library(bpy.types.Operator):
    """Show a folder of measured materials in every Asset Browser"""

    bl_idname = "lobefit.add_asset_library"
    bl_label = "Add to Asset Libraries"
    bl_options: ClassVar = {"REGISTER"}

    directory: StringProperty(
        name="Folder", subtype="DIR_PATH", options={"SKIP_SAVE"}, description="The library's folder"
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks for a folder, unless it is known."""
        if self.directory:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        folder = Path(bpy.path.abspath(self.directory))
        if not self.directory or not folder.is_dir():
            self.report({"ERROR"}, f"Expected the folder of a library, found '{self.directory}'.")
            return {"CANCELLED"}
        if _add_to_preferences(folder):
            self.report({"INFO"}, f"{folder} is now an asset library")
        else:
            self.report({"INFO"}, f"{folder} is an asset library already")
        return {"FINISHED"}


def draw_import_menu(self: Any, context: bpy.types.Context) -> None:
    """The entry in File > Import."""
    self.layout.operator(
        LOBEFIT_OT_make_library.bl_idname, text="Measured BRDF Library", icon="ASSET_MANAGER"
    )


def draw_catalog_menu(self: Any, context: bpy.types.Context) -> None:
    """The entries in the menu Catalog of the Asset Browser."""
    self.layout.separator()
    self.layout.operator(LOBEFIT_OT_make_library.bl_idname, icon="ASSET_MANAGER")
    # One click is enough for the library that was made last.
    for folder in [folder for folder in _made[-1:] if not _is_known(folder)]:
        text = f"Add {folder.name} to Asset Libraries"
        add = self.layout.operator(LOBEFIT_OT_add_asset_library.bl_idname, text=text, icon="ADD")
        add.directory = str(folder)


def _add_to_preferences(folder: Path) -> bool:
    """Says whether the folder was not among the asset libraries yet."""
    if _is_known(folder):
        return False
    bpy.ops.preferences.asset_library_add(directory=str(folder))
    return True


def _is_known(folder: Path) -> bool:
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return any(
        Path(bpy.path.abspath(item.path)).resolve() == folder.resolve() for item in libraries
    )
