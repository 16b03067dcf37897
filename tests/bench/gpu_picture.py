"""The same picture on a graphics card: ./dev bench gpu_picture RECORD..

RECORD is a record or a measured file; closures that a record lacks are fitted first. Each kind of
material is rendered by Cycles on the processor and on the graphics card: the sphere under its two
lights, one sample a sun, and in a constant world. Off is the sum of |difference| as a part of the
sum of the picture, worst the largest difference of a pixel as a part of the brightest one; at most
1e-3 is wanted of the first. The last columns are the seconds that the card takes for 1024 samples
a pixel of the world's picture, the least of three, and their ratio to the best-fit Principled BSDF.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from lobefit import pictures
from lobefit.blender import quiet
from lobefit.inputs import record_of
from lobefit.record import VISUAL_NORM
from lobefit_addon import build_material
from lobefit_addon.scene import radiance, render_pixels, two_lights_scene, uniform_world
from numpy.typing import NDArray

# Kind and count of specular closures; the first is the unit of the seconds.
WAYS = [("principled", None), *pictures.COMPARED, ("live", None)]
BACKENDS = ("OPTIX", "CUDA", "HIP", "ONEAPI", "METAL")
SIZE, SAMPLES, MANY_SAMPLES = 256, 16, 1024


def use_card(wanted: str | None) -> str:
    """Makes Cycles use a graphics card where a scene asks for one; returns its name."""
    preferences = bpy.context.preferences.addons["cycles"].preferences
    for backend in [wanted] if wanted else BACKENDS:
        try:
            preferences.compute_device_type = backend
        except TypeError:  # this Blender has no such backend
            continue
        preferences.get_devices()
        cards = [device for device in preferences.devices if device.type == backend]
        for device in preferences.devices:
            device.use = device.type == backend
        if cards:
            return f"{cards[0].name}, {backend}"
    sys.exit("not measured: Cycles finds no graphics card here")


@contextmanager
def in_world(scene: bpy.types.Scene, samples: int) -> Iterator[None]:
    """Lights the scene by a constant world alone for as long as the block runs."""
    suns = [item for item in scene.objects if item.type == "LIGHT"]
    for sun in suns:
        sun.hide_render = True
    scene.world, before = uniform_world("world", 1.0), scene.cycles.samples
    scene.cycles.samples = samples
    try:
        yield
    finally:
        scene.cycles.samples = before
        bpy.data.worlds.remove(scene.world)
        for sun in suns:
            sun.hide_render = False


def under_suns(scene: bpy.types.Scene) -> NDArray[np.float32]:
    return render_pixels(scene)


def under_world(scene: bpy.types.Scene) -> NDArray[np.float32]:
    with in_world(scene, SAMPLES):
        return radiance(scene)


def compare(scene: bpy.types.Scene) -> Iterator[tuple[float, float]]:
    for render in (under_suns, under_world):
        pictures_by_device = []
        for device in ("CPU", "GPU"):
            scene.cycles.device = device
            pictures_by_device.append(render(scene).astype(np.float64))
        processor, card = pictures_by_device
        off = np.abs(card - processor)
        yield off.sum() / processor.sum(), off.max() / processor.max()


def seconds(scene: bpy.types.Scene) -> float:
    scene.cycles.device = "GPU"
    times = []
    with in_world(scene, MANY_SAMPLES):
        for _ in range(3):
            start = time.perf_counter()
            bpy.ops.render.render(scene=scene.name)
            times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("records", nargs="+", type=Path)
    parser.add_argument("--backend", choices=BACKENDS, help="by default the first that works")
    options = parser.parse_args()
    print(f"{use_card(options.backend)}, Blender {bpy.app.version_string}\n")
    heads = "suns: off | worst | world: off | worst | seconds | ratio"
    print(f"| record | material | {heads} |")
    print("|---" * 8 + "|")
    scene = two_lights_scene(None, SIZE)
    (sphere,) = (item for item in scene.objects if item.type == "MESH")
    for path in options.records:
        record = pictures.with_closures(record_of(path, model="interpolated", norm=VISUAL_NORM))
        unit = None
        for kind, count in WAYS:
            sphere.data.materials[0] = build_material(record, kind, count=count)
            with quiet():
                figures = [figure for pair in compare(scene) for figure in pair]
                taken = seconds(scene)
            unit = unit or taken
            cells = [record.name, f"{kind} {count or ''}", *(f"{figure:.1e}" for figure in figures)]
            print(f"| {' | '.join(cells)} | {taken:.3f} | {taken / unit:.3f} |", flush=True)


if __name__ == "__main__":
    main()
