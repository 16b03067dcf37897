"""What a scene loses and gains when it is simplified: ./dev bench shelf_scene FILE..

FILE is a measured file or a record; closures that a record lacks are fitted first. Each stands on
the steps of a shelf with all that its record can show: as a sphere near the camera or far away, as
a tile that lies (seen at grazing) or stands (seen from in front), and the last one behind the
camera. The camera passes by; two suns and a grey sky light the scene, and nothing else is in it but
grey boards. For each tolerance: what `lobefit simplify` chose, on frames it looked at and between
them the part of the picture's light that changed (mean |difference| / mean of the unsimplified
picture), and processor time a frame, before and after in turn. Pictures have noise of their own,
which counts as change: the first table tells how far two pictures of the unsimplified scene differ
by the seed alone. At last every simplified file is restored and compared with the first one.
"""

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from lobefit import Record, blender, picture, simplified
from lobefit.blender import quiet
from lobefit.fitting import MOST_CLOSURES, Closures
from lobefit.inputs import record_of
from lobefit.record import VISUAL_NORM
from lobefit_addon import build_material
from lobefit_addon.cost import diffuse_material
from lobefit_addon.scene import radiance, sphere_mesh, uniform_world
from lobefit_addon.swaps import tree_content
from mathutils import Matrix, Vector
from numpy.typing import NDArray

FRAMES = 50
# What stands where: the depth and height of a step, the way between two things, and their turn.
STEPS = {
    "grazing": ((-2.5, -0.9), 2.2, 0.0),
    "near": ((0.0, 0.0), 2.0, 0.0),
    "facing": ((4.0, 2.0), 2.2, 90.0),
    "far": ((16.0, 5.2), 3.2, 0.0),
}
# What the files are in turn: the near and far spheres are the most.
ROLES = ("near", "far", "grazing", "near", "far", "facing")
RADIUS = 0.9  # of the spheres, and half of what a tile is wide
UNSEEN = (0.0, -40.0, 0.0)
# Of the camera, and of what it looks at.
PATH = (((-9.0, -9.0, 1.0), (-3.0, 4.0, 1.3)), ((8.0, -11.0, 2.2), (2.5, 4.0, 1.3)))
SUNS = (((0.5, -0.8, 1.0), 3.0, 1.0), ((-0.8, -0.2, 0.5), 1.5, 4.0))  # toward, strength, degrees
SKY = 0.4
LOOKED_AT = 8  # frames
TIMED_SAMPLES, FEW_SAMPLES = 64, 16


def add(data: bpy.types.ID, place: Matrix) -> bpy.types.Object:
    item = bpy.data.objects.new(data.name, data)
    item.matrix_world = place
    bpy.context.scene.collection.objects.link(item)
    return item


def turned_to(direction: Sequence[float], axis: str) -> Matrix:
    """A turn that makes the axis point along the direction."""
    return Vector(direction).to_track_quat(axis, "Y").to_matrix().to_4x4()


def tile_mesh() -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("tile")
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(None)
    return mesh


def show(mesh: bpy.types.Mesh, material: bpy.types.Material, place: Matrix) -> None:
    """One of the things that share a mesh, with a material of its own."""
    slot = add(mesh, place).material_slots[0]
    slot.link, slot.material = "OBJECT", material


def fill_steps(materials: Sequence[bpy.types.Material]) -> None:
    sphere, tile = sphere_mesh(None), tile_mesh()
    *seen, unseen = materials
    show(sphere, unseen, Matrix.Translation(UNSEEN))
    for role, ((depth, height), pace, turn) in STEPS.items():
        here = [m for index, m in enumerate(seen) if ROLES[index % len(ROLES)] == role]
        mesh = sphere if role in ("near", "far") else tile
        for index, material in enumerate(here):
            across = pace * (index - (len(here) - 1) / 2)
            place = Matrix.Translation((across, depth, height))
            turned = Matrix.Rotation(np.radians(turn), 4, "X") @ Matrix.Scale(RADIUS, 4)
            show(mesh, material, place @ turned)
        below = height - (0.01 if role == "grazing" else RADIUS)
        size = Matrix.Diagonal((pace * len(here) / 2, 1.3, 1.0, 1.0))
        show(tile, grey(), Matrix.Translation((0.0, depth, below)) @ size)


def grey() -> bpy.types.Material:
    """The material of all boards."""
    return bpy.data.materials.get("board") or diffuse_material("board", 0.1)


def add_camera(scene: bpy.types.Scene) -> None:
    data = bpy.data.cameras.new("camera")
    data.lens = 34.0
    scene.camera = add(data, Matrix.Identity(4))
    for frame, (place, target) in zip((1, FRAMES), PATH, strict=True):
        toward = Vector(target) - Vector(place)
        scene.camera.matrix_world = Matrix.Translation(place) @ turned_to(toward, "-Z")
        scene.camera.keyframe_insert("location", frame=frame)
        scene.camera.keyframe_insert("rotation_euler", frame=frame)


def add_lights(scene: bpy.types.Scene) -> None:
    for toward, strength, angle in SUNS:
        sun = bpy.data.lights.new("sun", "SUN")
        sun.energy, sun.angle = strength, np.radians(angle)
        add(sun, turned_to(toward, "Z"))
    scene.world = uniform_world("sky", SKY)


def set_up_cycles(scene: bpy.types.Scene, width: int) -> None:
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.threads_mode, render.threads = "FIXED", 1
    render.resolution_x, render.resolution_y = width, width * 9 // 16
    render.resolution_percentage = 100
    # The sky behind the shelf is no part of the light that can change.
    render.film_transparent = True
    cycles.device, cycles.max_bounces = "CPU", 2
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.caustics_reflective = False


def save_shelf(path: Path, records: Sequence[Record], width: int) -> None:
    """Writes the scene with all its materials at their best."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    fill_steps([build_material(record, "measured", record.name) for record in records])
    add_camera(scene)
    add_lights(scene)
    set_up_cycles(scene, width)
    scene.frame_start, scene.frame_end = 1, FRAMES
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)


def pictures_of(
    path: Path, frames: Sequence[int], samples: int, seed: int = 0
) -> list[NDArray[np.float32]]:
    """What the frames of a file look like, in linear light."""
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(path))
        scene = bpy.context.scene
        scene.cycles.samples, scene.cycles.seed = samples, seed
        found = []
        for frame in frames:
            scene.frame_set(frame)
            found.append(radiance(scene))
    return found


def seconds_of(path: Path, frames: Sequence[int]) -> NDArray[np.float64]:
    """Processor time of each frame, with no picture written."""
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(path))
        scene = bpy.context.scene
        scene.cycles.samples = TIMED_SAMPLES
        found = []
        for frame in frames:
            scene.frame_set(frame)
            began = time.process_time()
            bpy.ops.render.render()
            found.append(time.process_time() - began)
    return np.array(found)


def materials_in(path: Path) -> dict[str, object]:
    """All that the materials of a file compute, by name."""
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(path))
    return {material.name: tree_content(material.node_tree) for material in bpy.data.materials}


def changed(
    pictures: Sequence[NDArray[np.float32]], references: Sequence[NDArray[np.float32]]
) -> list[float]:
    """The part of the light of each picture that is not where it was."""
    return [
        float(np.abs(now - before).sum() / before.sum())
        for now, before in zip(pictures, references, strict=True)
    ]


def print_row(name: str, cells: Sequence[str]) -> None:
    print(f"| {name} | {' | '.join(cells)} |", flush=True)


def print_head(title: str, frames: Sequence[int | str]) -> None:
    print(f"\n{title}\n")
    print_row("frame", list(map(str, frames)))
    print("|---" * (len(frames) + 1) + "|")


def write_pictures(
    folder: Path,
    frames: Sequence[int],
    full: Sequence[NDArray[np.float32]],
    others: dict[str, list[NDArray[np.float32]]],
) -> None:
    """A PNG a frame: as it was, and for each tolerance what became of it and the difference x 10"""
    folder.mkdir(parents=True, exist_ok=True)
    white = picture.white_point(full[0], 99.0)
    for index, frame in enumerate(frames):
        rows = [np.hstack([full[index], np.zeros_like(full[index])])]
        for pictures in others.values():
            off = 10 * np.abs(pictures[index] - full[index])
            rows.append(np.hstack([pictures[index], off]))
        shown = picture.encode(picture.expose(np.vstack(rows), white))
        picture.write_png(folder / f"shelf_{frame:03}.png", shown)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--tolerances", nargs="*", type=float, default=[1.0, 5.0], help="percent")
    parser.add_argument("--frames", nargs="*", type=int, default=[1, 13, 25, 38, 50])
    parser.add_argument("--width", type=int, default=192)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pictures", type=Path, metavar="FOLDER")
    options = parser.parse_args()
    wanted = [Closures("measured", count) for count in range(MOST_CLOSURES + 1)]
    records = [
        record_of(file, closures=wanted, model="interpolated", norm=VISUAL_NORM)
        for file in options.files
    ]
    with tempfile.TemporaryDirectory() as folder:
        run(Path(folder), records, options)


def run(folder: Path, records: Sequence[Record], options: argparse.Namespace) -> None:
    full = folder / "full.blend"
    with quiet():
        save_shelf(full, records, options.width)
    files = {}
    for tolerance in options.tolerances:
        path = files[f"simplified, {tolerance:g} %"] = folder / f"{tolerance:g}.blend"
        result = blender.simplify(full, path, tolerance / 100, LOOKED_AT)
        print("\n" + "\n".join(simplified.lines(result)), flush=True)
    print_changes(full, files, options)
    print_seconds({"as it was": full, **files}, options)
    print_restored(full, files, options.frames)


def print_changes(full: Path, files: dict[str, Path], options: argparse.Namespace) -> None:
    frames, samples = options.frames, options.samples
    print_head("Part of the picture's light that changed, noise included", frames)
    reference = pictures_of(full, frames, samples)
    noise = changed(pictures_of(full, frames, samples, seed=1), reference)
    print_row("another seed", [f"{part:.2%}" for part in noise])
    pictures = {}
    for name, path in files.items():
        pictures[name] = pictures_of(path, frames, samples)
        parts = changed(pictures[name], reference)
        print_row(name, [f"{part:.2%}" for part in parts])
    if options.pictures:
        write_pictures(options.pictures, frames, reference, pictures)


def print_seconds(files: dict[str, Path], options: argparse.Namespace) -> None:
    title = f"Processor seconds a frame, least of {options.rounds} rounds"
    print_head(title, [*options.frames, "all"])
    # A round goes through all files: a slow minute then slows all of them.
    rounds = [
        [seconds_of(path, options.frames) for path in files.values()] for _ in range(options.rounds)
    ]
    for name, least in zip(files, np.min(rounds, 0), strict=True):
        print_row(name, [f"{seconds:.2f}" for seconds in (*least, least.sum())])


def print_restored(full: Path, files: dict[str, Path], frames: Sequence[int]) -> None:
    print_head("Restored from the file: the largest difference of a pixel", frames)
    materials, before = materials_in(full), pictures_of(full, frames, FEW_SAMPLES)
    told = []
    for name, path in files.items():
        back = path.with_suffix(".restored.blend")
        blender.restore(path, back)
        pairs = zip(pictures_of(back, frames, FEW_SAMPLES), before, strict=True)
        print_row(name, [f"{np.abs(now - then).max():g}" for now, then in pairs])
        told.append(
            f"{name}: materials {'' if materials_in(back) == materials else 'not '}as before"
        )
    print("\n" + "\n".join(told))


if __name__ == "__main__":
    main()
