"""From the zip of the extension and a measured file to a rendered picture, by mouse and F12."""

import time

import pytest
from window import FileBrowser

MEASURED = """
[material.name for material in bpy.data.materials if 'lobefit_record' in material]
"""
# The mean colour of the middle of the picture, encoded as it is shown.
SHOWN = """
path = {path!r}
bpy.data.images['Render Result'].save_render(path)
picture = bpy.data.images.load(path)
(columns, rows), pixels = picture.size, picture.pixels[:]
starts = [
    4 * (row * columns + column)
    for row in range(rows * 2 // 5, rows * 3 // 5)
    for column in range(columns * 2 // 5, columns * 3 // 5)
]
result = [sum(pixels[start + channel] for start in starts) / len(starts) for channel in range(3)]
"""


def test_from_the_zip_to_a_picture(window):
    """Prints how many clicks and seconds each step took (pytest -s)."""
    began, clicked = time.monotonic(), 0

    def tell(step):
        nonlocal began, clicked
        clicks, seconds = window.clicks - clicked, time.monotonic() - began
        window.shot(step.replace(" ", "_"))
        print(f"{step}: {clicks} clicks, {seconds:.1f} s")
        began, clicked = time.monotonic(), window.clicks

    tell("the start")
    window.click((1100, 300))  # beside the splash screen
    files = FileBrowser(window)
    tell("a file browser")
    (package,) = window.downloads.glob("*.zip")
    window.drag(files.place(package.name), (300, 420))
    time.sleep(2)
    window.shot("the_question_of_the_installation")
    window.click((330, 513))
    window.wait_for("hasattr(bpy.types, 'LOBEFIT_OT_import_measured')")
    tell("installed")
    window.drag(files.place("violet-rubber.binary"), (662, 288), picture="the_drop")
    time.sleep(0.5)
    window.shot("the_fit")
    assert window.wait_for(MEASURED.strip()) == ["violet-rubber"]
    assert window.ask("result = bpy.data.objects['Cube'].active_material.name") == "violet-rubber"
    time.sleep(1)
    tell("a material")
    window.click((1339, 418))  # the Render tab
    window.click((1500, 417))  # EEVEE
    window.click((1484, 485))  # Cycles
    assert window.ask("result = bpy.context.scene.render.engine") == "CYCLES"
    tell("Cycles")
    # Some builds of Blender lack the denoiser that new scenes ask for, and then show no picture;
    # and the 4096 samples of new scenes take minutes without a graphics card.
    window.ask(
        "cycles = bpy.context.scene.cycles\ncycles.use_denoising, cycles.samples = False, 16"
    )
    window.click((1339, 783))  # the Material tab
    time.sleep(2)
    tell("the panel")
    window.move((300, 420))
    window.key("F12")
    window.clicks += 1
    window.wait_for(
        "bpy.app.is_job_running('RENDER') or len(bpy.context.window_manager.windows) > 1"
    )
    window.wait_for("not bpy.app.is_job_running('RENDER')")
    time.sleep(2)
    tell("a picture")
    red, green, _ = window.ask(SHOWN.format(path=str(window.inside / "rendered.png")))
    # The rubber is pink, and nothing else in the picture has a colour.
    assert red > 1.3 * green


if __name__ == "__main__":
    pytest.main([__file__, "-s"])
