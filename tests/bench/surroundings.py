"""What baked materials do whatever stands around them: ./dev bench surroundings FILE..

For each measured file and the materials `measured` with 2 and 3 specular closures and `lobe` with
2: how far the picture of a plane under a white world, at view angles from 0 to 80 degrees, is off
what the formula integrates to (at most 0.01 of it is wanted). Then all these materials at once on
surfaces of random flat, smooth and connected normals under random lights
(tests/blender/surroundings.py): how many of so many pixels are NaN, infinite, negative, or black
without a reason (none is wanted).
"""

import argparse
import dataclasses
import sys
import tempfile
from pathlib import Path

import bpy
import lobefit
import numpy as np
from lobefit.blender import quiet
from lobefit.record import VISUAL_NORM
from lobefit_addon import build_material
from lobefit_addon.scene import uniform_world

sys.path.insert(0, str(Path(__file__).parents[1] / "blender"))
from surroundings import Crowd, albedo, bend_as_crowds_do, white_world_albedo

ANGLES = (0, 15, 22, 30, 38, 45, 52, 60, 65, 70, 75, 80)
CROWD = 400  # pixels across


def tell_albedo(folder: str, record: lobefit.Record, name: str) -> None:
    """Prints a line for each of the materials."""
    white = uniform_world("White", 1.0)
    for entry in record.closures:
        material = build_material(record, entry["target"], count=entry["count"])
        off = []
        for angle in ANGLES:
            with quiet():
                shown = white_world_albedo(folder, material, white, angle)
            expected = albedo(entry, np.cos(np.radians(angle)))
            off.append(np.abs(shown - expected).max() / expected.max())
        figures = " | ".join(f"{each:.4f}" for each in off)
        print(f"| {name} | {entry['target']} {entry['count']} | {figures} |", flush=True)


def crowd_materials(record: lobefit.Record) -> list[bpy.types.Material]:
    """The materials, with a bright diffuse closure that lights them wherever another is dark."""
    made = []
    for entry in record.closures:
        bright = dataclasses.replace(record, closures=[entry | {"diffuse": [[[0.0, 0.5]]] * 3}])
        material = build_material(bright, entry["target"], count=entry["count"])
        made.append(bend_as_crowds_do(material))
    return made


def random_lights(count: int) -> np.ndarray:
    """Unit vectors (N, 3) that light something which faces the camera."""
    lights = np.random.default_rng(1).normal(0, 1, (8 * count, 3))
    lights /= np.linalg.norm(lights, axis=1, keepdims=True)
    return lights[lights[:, 2] > -0.8][:count]


def tell_faults(folder: str, materials: list[bpy.types.Material], rounds: int) -> None:
    """Prints what is wrong with random pixels."""
    faults = np.zeros(3, int)
    for seed, light in enumerate(random_lights(rounds)):
        with quiet():
            faults += Crowd(materials, CROWD, seed).faults(folder, light)
    wrong, black, lit = faults
    print(f"{rounds * CROWD**2} pixels, {lit} of them lit: {wrong} wrong, {black} black")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--rounds", type=int, default=63)
    options = parser.parse_args()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    requests = [lobefit.Closures(count=2), lobefit.Closures(count=3), lobefit.Closures("lobe", 2)]
    crowd = []
    angles = " | ".join(f"{angle} degrees" for angle in ANGLES)
    print(f"| table | material | {angles} |\n" + "|---" * (2 + len(ANGLES)) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for path in options.files:
            record = lobefit.fit(path, norm=VISUAL_NORM, closures=requests)
            tell_albedo(folder, record, path.stem)
            crowd += crowd_materials(record)
        tell_faults(folder, crowd, options.rounds)


if __name__ == "__main__":
    main()
