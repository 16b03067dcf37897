"""Normals from shading, on what Cycles renders: ./dev bench normals FILE.. [--picture PICTURE.png]

A sphere and a bumpy surface that shadows itself, of materials that are fitted to measured files,
are rendered under six suns and given to the estimate with the material's own formula. The medians
of the angles between true and estimated normals, in degrees, are those of

    sphere, bumpy   floating-point renders; the bumpy surface casts shadows
    noise           bumpy, with Gaussian noise of .25 % of the brightest light
    8 bits          bumpy, as an 8-bit sRGB picture whose highlights, 2 % of what is lit, are cut
    one light       sphere under one of the suns alone, from the silhouette inward

and for all materials together also of spheres from the formula alone. docs/normals.png is made by
--picture, of the files named.
"""

import argparse
import time
from pathlib import Path

import bpy
import lobefit
import numpy as np
from lobefit import heat_map, lettering, picture
from lobefit.blender import quiet
from lobefit.lights import Light, Lighting
from lobefit.normals import as_normal_map, normals, reflectance_of, shade
from lobefit_addon import build_material
from lobefit_addon.scene import radiance, two_lights_scene
from mathutils import Vector

KINDS = ("measured", "lobe", "live")
IRRADIANCE = 3.0
# Suns around the viewer, three high and three low, as a ring of lamps on two heights has them.
POLAR, TURNS = (35, 70), range(0, 360, 60)
MESH = 700  # vertices on a side of the bumpy surface


def direction(polar: float, turn: float) -> tuple[float, float, float]:
    """The unit vector at these degrees from the viewer, and around."""
    t, p = np.radians(polar), np.radians(turn)
    return float(np.sin(t) * np.cos(p)), float(np.sin(t) * np.sin(p)), float(np.cos(t))


def suns() -> list[Lighting]:
    return [lighting(direction(POLAR[i % 2], turn)) for i, turn in enumerate(TURNS)]


def lighting(toward: tuple[float, float, float]) -> Lighting:
    return Lighting([Light(toward, (IRRADIANCE,) * 3)])


def places(size: int) -> tuple[np.ndarray, np.ndarray]:
    """x and y of the pixels of a picture from -1 to 1, the first row at the top."""
    centre = (2 * np.arange(size) + 1) / size - 1
    return np.meshgrid(centre, -centre)


def sphere(size: int) -> np.ndarray:
    x, y = places(size)
    z2 = 1 - x * x - y * y
    return np.where(z2[..., None] > 0, np.stack([x, y, np.sqrt(np.maximum(z2, 0))], -1), 0)


# Bumps and pits as Gaussians: where, how high and how wide.
BUMPS = ((-0.45, 0.4, 0.34, 0.17), (0.4, 0.45, 0.24, 0.2), (0.05, -0.1, 0.42, 0.2),
         (-0.5, -0.5, -0.2, 0.2), (0.55, -0.45, 0.3, 0.15))  # fmt: skip


def bumpy_heights(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heights and normals of the bumpy surface."""
    z = 0.02 * np.sin(9 * x + 2) * np.sin(8 * y)
    dx = 0.18 * np.cos(9 * x + 2) * np.sin(8 * y)
    dy = 0.16 * np.sin(9 * x + 2) * np.cos(8 * y)
    for u, v, height, width in BUMPS:
        bump = height * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * width**2))
        z, dx = z + bump, dx - bump * (x - u) / width**2
        dy = dy - bump * (y - v) / width**2
    n = np.stack([-dx, -dy, np.ones_like(dx)], -1)
    return z, n / np.linalg.norm(n, axis=-1, keepdims=True)


def bumpy(size: int) -> np.ndarray:
    return bumpy_heights(*places(size))[1]


def bumpy_mesh() -> bpy.types.Mesh:
    """The bumpy surface, a little larger than the picture, with its own normals."""
    line = np.linspace(-1.05, 1.05, MESH)
    x, y = np.meshgrid(line, line)
    z, n = bumpy_heights(x, y)
    corner = np.arange(MESH * MESH).reshape(MESH, MESH)
    faces = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], -1)
    mesh = bpy.data.meshes.new("Bumpy")
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    mesh.from_pydata(points.tolist(), [], faces.reshape(-1, 4).tolist())
    mesh.shade_smooth()
    mesh.normals_split_custom_set_from_vertices(n.reshape(-1, 3).tolist())
    return mesh


def rendered(material: bpy.types.Material, shape: str, size: int, lights: list[Lighting]):
    """The pictures (K, size, size, 3) that Cycles gives of a shape under each lighting."""
    bpy.context.window.scene = bpy.data.scenes.new("Normals")
    scene = two_lights_scene(material, size)
    item = next(item for item in scene.objects if item.type == "MESH")
    if shape == "bumpy":
        item.data = bpy.data.meshes.get("Bumpy") or bumpy_mesh()
        item.data.materials.clear()
        item.data.materials.append(material)
    for other in [item for item in scene.objects if item.type == "LIGHT"]:
        bpy.data.objects.remove(other)
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.angle, data.use_shadow = IRRADIANCE, 0.0, True
    sun = bpy.data.objects.new("Sun", data)
    scene.collection.objects.link(sun)
    scene.cycles.samples = 1
    pictures = []
    for each in lights:
        toward = Vector(each.lights[0].direction)
        sun.rotation_euler = toward.to_track_quat("Z", "Y").to_euler()
        with quiet():
            pictures.append(np.array(radiance(scene)))
    bpy.data.scenes.remove(scene)
    return np.stack(pictures)


def angles(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Degrees between normals, where there are any."""
    sines = np.linalg.norm(np.cross(found, true), axis=-1)
    return np.degrees(np.arctan2(sines, (found * true).sum(-1)))


def error(pictures, lights, source, true, **options) -> tuple[float, np.ndarray]:
    """The median angle between true and estimated normals, and the latter."""
    mask = true.any(-1)
    found = normals(pictures, lights, source, mask=mask, **options).normals
    return float(np.median(angles(found, true)[mask])), found


def eight_bits(pictures: np.ndarray) -> tuple[np.ndarray, float]:
    """As 8-bit sRGB would hold them with 2 % of what is lit cut, and from where on it is cut."""
    exposure = 1 / np.percentile(pictures[pictures > 0], 98)
    levels = np.round(picture.encode(np.clip(pictures * exposure, 0, 1)) * 255)
    return picture.decode(levels / 255) / exposure, float(picture.decode(254 / 255) / exposure)


def study(record: lobefit.Record, kind: str, size: int) -> list[float]:
    """The medians of one material, in the order of COLUMNS."""
    source, lights = reflectance_of(record, kind), suns()
    material = build_material(record, kind, record.name)
    row = []
    pictures = {shape: rendered(material, shape, size, lights) for shape in ("sphere", "bumpy")}
    true = {"sphere": sphere(size), "bumpy": bumpy(size)}
    row.append(error(pictures["sphere"], lights, source, true["sphere"])[0])
    row.append(error(pictures["bumpy"], lights, source, true["bumpy"])[0])
    sigma = 0.0025 * float(np.percentile(pictures["bumpy"], 99))
    noisy = pictures["bumpy"] + np.random.default_rng(1).normal(0, sigma, pictures["bumpy"].shape)
    row.append(error(noisy, lights, source, true["bumpy"])[0])
    cut, saturation = eight_bits(pictures["bumpy"])
    row.append(error(cut, lights, source, true["bumpy"], saturation=saturation)[0])
    one = slice(0, 1)
    row.append(error(pictures["sphere"][one], lights[one], source, true["sphere"])[0])
    return row


COLUMNS = ("sphere", "bumpy", "noise", "8 bits", "one light")


def fitted(path: str) -> lobefit.Record:
    requests = [lobefit.Closures("measured", 2), lobefit.Closures("lobe", 2)]
    return lobefit.fit(path, norm="cosine-l1", closures=requests)


def speed(size: int) -> None:
    """Seconds a megapixel of six pictures and of one, from the formula."""
    source = ("classic", {"model": "classic-phong", "diffuse": [0.5, 0.3, 0.2],
                          "specular": [0.4] * 3, "exponent": 60.0})  # fmt: skip
    for shape, lights in (("bumpy", suns()), ("sphere", suns()[:1])):
        true = bumpy(size) if shape == "bumpy" else sphere(size)
        pictures = shade(true, lights, source)
        for threads in (1, 2):
            began, busy = time.perf_counter(), time.process_time()
            median, _ = error(pictures, lights, source, true, threads=threads)
            pixels = true.any(-1).sum() / 1e6
            seconds = (time.perf_counter() - began) / pixels
            busy = (time.process_time() - busy) / pixels
            print(
                f"{shape}, {len(lights)} pictures, {threads} threads: {seconds:.1f} s a megapixel, "
                f"{busy:.1f} s of processor time, median {median:.3f} degrees",
                flush=True,
            )


SIZE, GAP, LEFT, TOP = 200, 10, 150, 46
PAPER, INK = (0.115, 0.115, 0.125), (0.95, 0.95, 0.95)
TITLES = ("one of six", "true normals", "estimated", "error", "relit", "Cycles")
NEW_LIGHT = (-0.5, 0.75, 0.6)


def row_of_pictures(record: lobefit.Record, shape: str) -> tuple[list[np.ndarray], float]:
    """The pictures of a material and a shape in the order of TITLES, and the median error."""
    lights, source = suns(), reflectance_of(record, "measured")
    material = build_material(record, "measured", record.name)
    true = sphere(SIZE) if shape == "sphere" else bumpy(SIZE)
    relit = [lighting(tuple(Vector(NEW_LIGHT).normalized()))]
    pictures = rendered(material, shape, SIZE, [*lights, *relit])
    median, found = error(pictures[:-1], lights, source, true)
    white = picture.white_point(pictures[-1], 98)
    shown = [picture.encode(picture.expose(image, white)) for image in
             (pictures[1], shade(found, relit, source)[0], pictures[-1])]  # fmt: skip
    mask = true.any(-1)
    colors = np.zeros((SIZE, SIZE, 3), np.float32)
    for at, angle in zip(np.argwhere(mask), angles(found, true)[mask], strict=True):
        text = heat_map.color_of(angle / 10).removeprefix("#")
        colors[tuple(at)] = [int(text[i : i + 2], 16) / 255 for i in (0, 2, 4)]
    maps = [
        np.where(mask[..., None], as_normal_map(n.astype(np.float32)), 0) for n in (true, found)
    ]
    return [shown[0], *maps, colors, *shown[1:]], median


def draw(records: list[lobefit.Record], path: str) -> None:
    rows = [(record, shape) for record in records for shape in ("sphere", "bumpy")]
    step = SIZE + GAP
    sheet = picture.page(TOP + len(rows) * step, LEFT + len(TITLES) * step, PAPER)
    for column, title in enumerate(TITLES):
        middle = LEFT + column * step + SIZE / 2
        lettering.draw(sheet, title, middle, TOP - 16, 17.0, INK, "center")
    for index, (record, shape) in enumerate(rows):
        images, median = row_of_pictures(record, shape)
        top = TOP + index * step
        for line, text in enumerate((record.name, shape, f"{median:.2f} deg")):
            lettering.draw(
                sheet, text, LEFT - GAP, top + SIZE / 2 + 24 * line - 24, 15.0, INK, "right"
            )
        for column, image in enumerate(images):
            cover = picture.disc(SIZE) if shape == "sphere" else 1.0
            picture.paste(sheet, image, top, LEFT + column * step, cover)
    picture.write_png(path, sheet)


def main() -> None:
    parser = argparse.ArgumentParser(prog="normals")
    parser.add_argument("files", nargs="*", metavar="FILE")
    parser.add_argument("--size", type=int, default=200, help="pixels across")
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    parser.add_argument("--picture", metavar="PICTURE.png")
    parser.add_argument("--speed", type=int, metavar="PIXELS", help="only the run time, so wide")
    options = parser.parse_args()
    if options.speed:
        speed(options.speed)
        return
    records = [fitted(path) for path in options.files]
    if options.picture:
        draw(records, options.picture)
        return
    print(f"{'':28}{'kind':12}" + "".join(f"{title:>11}" for title in COLUMNS))
    rows = []
    for record in records:
        for kind in options.kinds:
            rows.append(study(record, kind, options.size))
            print(f"{Path(record.source['path']).stem:28}{kind:12}"
                  + "".join(f"{value:11.3f}" for value in rows[-1]), flush=True)  # fmt: skip
    print(f"{'median':40}" + "".join(f"{value:11.3f}" for value in np.median(rows, axis=0)))
    print(f"{'worst':40}" + "".join(f"{value:11.3f}" for value in np.max(rows, axis=0)))


if __name__ == "__main__":
    main()
