"""The manual's pictures of windows: manual_pictures.py [FOLDER], docs/manual if none is named.

drop.png is a measured file that is dragged onto an object, panel.png what is shown of the material
then, library.png an asset library of files. tests/bench/manual_pictures.py makes those that need
no window. Needs what the tests beside it need.
"""

import subprocess
import sys
import time
from pathlib import Path

from conftest import start_installed
from window import ROOT, FileBrowser, Window, missing

WIDTH = 1600  # pixels of the display
SHOTS = ROOT / "build" / "gui"  # where pictures of the whole display go
PANEL = 740  # and of the panel
FILE = "violet-rubber.binary"
MEASURED = "'lobefit_record' in (bpy.data.objects['Cube'].active_material or {})"
PREVIEW = """
areas = bpy.context.window_manager.windows[0].screen.areas
area = next(a for a in areas if a.type == 'PROPERTIES')
area.spaces.active.context = 'MATERIAL'
with bpy.context.temp_override(area=area):
    result = list(bpy.ops.lobefit.preview())
area.tag_redraw()
"""


LIBRARY = """
folder = {folder!r}
bpy.ops.lobefit.make_library(directory=folder, library=folder + '/Measured.blend', jobs=2,
                             add_to_preferences=True)
areas = bpy.context.window_manager.windows[0].screen.areas
area = next(a for a in areas if a.type == 'FILE_BROWSER')
area.ui_type = 'ASSETS'
"""
SHOW_LIBRARY = """
areas = bpy.context.window_manager.windows[0].screen.areas
space = next(a for a in areas if a.type == 'FILE_BROWSER').spaces.active
libraries = bpy.context.preferences.filepaths.asset_libraries
space.params.asset_library_reference = libraries[len(libraries) - 1].name
result = space.params is not None
"""


def cut(picture: Path, place: tuple[int, int, int, int], output: Path) -> None:
    """Writes a part of a picture: left, top, width and height."""
    left, top, width, height = place
    part = f"{width}x{height}+{left}+{top}"
    words = ["convert", picture, "-crop", part, "+repage", "-strip", output]
    subprocess.run(words, check=True)


def make(window: Window, folder: Path) -> None:
    """Takes the pictures, one after the other in one session."""
    files = FileBrowser(window)
    window.drag(files.place(FILE), (662, 288), picture="drop")
    cut(SHOTS / "drop.png", (0, 0, 1100, 740), folder / "drop.png")
    window.wait_for(MEASURED)
    window.ask(LIBRARY.format(folder=str(window.inside / "downloads")))
    window.ask(SHOW_LIBRARY)
    time.sleep(3)
    left, top, _, _ = window.area("FILE_BROWSER")
    cut(window.shot("library"), (left, top, 740, 300), folder / "library.png")
    left, top, _, _ = window.area("PROPERTIES")
    window.drag((left + 200, top - 1), (left + 200, 60))
    window.drag((left - 1, top + 300), (WIDTH - PANEL, top + 300))
    window.ask(PREVIEW)
    window.move((400, 300))  # where it has no tooltip
    time.sleep(2)
    left, top, width, _ = window.area("PROPERTIES")
    cut(window.shot("panel"), (left, top, width, 775), folder / "panel.png")


def main(folder: Path) -> None:
    reason = missing()
    if reason:
        raise SystemExit(reason)
    window = start_installed()
    try:
        make(window, folder)
    finally:
        window.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "manual")
