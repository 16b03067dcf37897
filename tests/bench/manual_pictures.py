"""The manual's pictures that need no window: ./dev bench manual_pictures [FOLDER]

Without a folder they go to docs/manual. All are of sample measurements, so that nothing has to be
at hand: two_lights.png is what Open under Two Lights brings, kinds.png every kind as Cycles renders
it, and charts.png what the panel draws. The pictures of windows are made by
tests/gui/manual_pictures.py.
"""

import argparse
import tempfile
from pathlib import Path

import bpy
import lobefit
import lobefit_addon
from lobefit import blender, charts, lettering, picture, preview
from lobefit.origin import write_samples
from lobefit_addon import comparison
from lobefit_addon.nodes.material import choose
from lobefit_addon.scene import radiance

ROOT = Path(__file__).resolve().parents[2]
METAL, RUBBER = "gold-metallic-paint", "violet-rubber"
KINDS = {"measured": "Measured", "lobe": "Lobe", "live": "Live", "principled": "Principled"}
SIZE, GAP, EDGE, TEXT, SMALL = 170, 14, 24, 17.0, 15.0
TOP, UNDER, LEFT = 44, 30, 110


def letter(sheet: picture.Image, text: str, x: float, y: float, small: bool = False) -> None:
    """Letters a title, or a fainter figure, around a place."""
    size, color = (SMALL, picture.FAINT) if small else (TEXT, picture.INK)
    lettering.draw(sheet, text, x, y, size, color, "center")


def two_spheres(record: lobefit.Record) -> picture.Image:
    """The scene of the extension with the measurement and the material beside it."""
    # The wheel does not carry the scene: it comes with the extension.
    comparison.BLEND = ROOT / "blend_files" / "two_lights.blend"
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.materials.append(lobefit_addon.build_material(record, "measured"))
    with blender.quiet():
        bpy.ops.lobefit.two_lights()
        scene = bpy.context.scene
        scene.render.resolution_percentage = 150
        light = radiance(scene)
    shown = picture.encode(picture.shrink(picture.expose(light, picture.white_point(light)), 2))
    rows, columns = shown.shape[:2]
    sheet = picture.page(rows + TOP, columns, (0.0, 0.0, 0.0))
    picture.paste(sheet, shown, TOP, 0)
    for title, place in {"measurement": 0.25, "material, by Cycles": 0.75}.items():
        letter(sheet, title, place * columns, TOP - 14)
    return sheet


def every_kind(records: dict[str, lobefit.Record]) -> picture.Image:
    """A row of each record: the measurement and all kinds, with their errors."""
    titles = ["measurement", *KINDS.values()]
    step = SIZE + GAP
    high, wide = TOP + len(records) * (step + UNDER), LEFT + len(titles) * step + EDGE
    sheet = picture.page(high, wide, picture.PAPER)
    for column, title in enumerate(titles):
        letter(sheet, title, LEFT + column * step + SIZE / 2, TOP - 16)
    for row, (name, record) in enumerate(records.items()):
        top = TOP + row * (step + UNDER)
        for line, word in enumerate(name.split("-")):
            letter(sheet, word, LEFT / 2, top + SIZE / 2 + 24 * line)
        put_row(sheet, record, top)
    return sheet


def put_row(sheet: picture.Image, record: lobefit.Record, top: int) -> None:
    """The spheres of one record, all at one exposure, and how far off each is."""
    measurement = preview.measurement_of(record)
    light = {"": lobefit._native.preview(measurement, SIZE * preview.FINER)}
    light |= {kind: blender.render(record, SIZE * preview.FINER, kind) for kind in KINDS}
    white = picture.white_point(light[""])
    for column, (kind, linear) in enumerate(light.items()):
        left = LEFT + column * (SIZE + GAP)
        sphere = picture.shrink(picture.expose(linear, white), preview.FINER)
        picture.paste(sheet, picture.encode(sphere), top, left, picture.disc(SIZE))
        if kind:
            shown = choose(record, kind).shown(record)
            error = lobefit._native.picture_error(measurement, shown)
            letter(sheet, f"{error:.1%} off", left + SIZE / 2, top + SIZE + 21, small=True)


def two_charts(record: lobefit.Record) -> picture.Image:
    """Error map and lobe beside each other."""
    measurement = preview.measurement_of(record)
    shown = choose(record, "measured").shown(record)
    drawn = {
        "Error Map": charts.draw_error_map(record, measurement, shown),
        "Lobe": charts.draw_lobe(record, measurement, shown),
    }
    images = {title: picture.shrink(image, 2) for title, image in drawn.items()}
    wide = sum(image.shape[1] + EDGE for image in images.values()) + EDGE
    high = TOP + max(image.shape[0] for image in images.values()) + EDGE
    sheet = picture.page(high, wide, picture.PAPER)
    left = EDGE
    for title, image in images.items():
        letter(sheet, title, left + image.shape[1] / 2, TOP - 16)
        picture.paste(sheet, image, TOP, left)
        left += image.shape[1] + EDGE
    return sheet


def main() -> None:
    parser = argparse.ArgumentParser(prog="manual_pictures")
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "docs" / "manual")
    output = parser.parse_args().folder.resolve()
    lobefit_addon.register()
    requests = [lobefit.Closures("measured"), lobefit.Closures("lobe")]
    with tempfile.TemporaryDirectory() as folder:
        records = {
            path.stem: lobefit.fit(path, norm="cosine-l1", closures=requests)
            for path in write_samples(folder, [METAL, RUBBER])
        }
        pictures = {
            "kinds": every_kind(records),
            "charts": two_charts(records[RUBBER]),
            "two_lights": two_spheres(records[METAL]),
        }
    for name, image in pictures.items():
        picture.write_png(output / f"{name}.png", image)


if __name__ == "__main__":
    main()
