"""What EEVEE shows of each kind of material: ./dev bench eevee_colour FILE..

FILE is a measured file or a record; closures that a record lacks are fitted first. A sphere stands
under a sun and a grey sky. Compared are mean colours of its pictures, by their distance (sum of
|difference| over the channels) as a part of the other colour; at most 10 % is wanted between what
EEVEE shows of a material and its best-fit Principled BSDF. With --closures EEVEE is also made to
show the closures that only Cycles is meant to.

EEVEE needs OpenGL 4.3: a display, or Mesa (libegl-mesa0, libgl1-mesa-dri) with
EGL_PLATFORM=surfaceless LIBGL_ALWAYS_SOFTWARE=1, which compiles shaders for minutes.
"""

import argparse
import math
from pathlib import Path

import bpy
import numpy as np
from lobefit import Record
from lobefit.blender import quiet
from lobefit.fitting import Closures
from lobefit.inputs import record_of
from lobefit.record import VISUAL_NORM
from lobefit_addon import build_material
from lobefit_addon.scene import radiance, two_lights_scene, uniform_world
from numpy.typing import NDArray

SIZE, SAMPLES, SKY, SUN = 96, {"EEVEE": 16, "Cycles": 256}, 0.3, 2.0
KINDS = ("measured", "lobe", "live")
WANTED = [Closures("measured", 2), Closures("lobe", 2)]
EEVEE = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0) else "BLENDER_EEVEE"


def set_up_scene() -> bpy.types.Scene:
    """The sphere of the previews, with one of its suns and a sky."""
    scene = two_lights_scene(None, SIZE)
    key, grazing = (item for item in scene.objects if item.type == "LIGHT")
    bpy.data.objects.remove(grazing)
    key.data.energy, key.data.angle = SUN, math.radians(2)
    scene.world = uniform_world("sky", SKY)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.cycles.samples = SAMPLES["Cycles"]
    scene.eevee.taa_render_samples = SAMPLES["EEVEE"]
    return scene


def colour(material: bpy.types.Material, engine: str) -> NDArray[np.float64]:
    """The mean colour of the sphere in one of the renderers."""
    scene = bpy.context.scene
    scene.objects["Sphere"].data.materials[0] = material
    scene.render.engine = engine
    with quiet():
        return radiance(scene).mean((0, 1), np.float64)


def show_closures(material: bpy.types.Material) -> None:
    """Gives all renderers what the material keeps for Cycles."""
    tree = material.node_tree
    (link,) = tree.nodes["Cycles"].inputs["Surface"].links
    tree.links.new(link.from_socket, tree.nodes["All"].inputs["Surface"])


def distance(found: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    return float(np.abs(found - reference).sum() / reference.sum())


def row_of(record: Record, with_closures: bool) -> list[float]:
    principled = build_material(record, "principled")
    in_eevee, in_cycles = colour(principled, EEVEE), colour(principled, "CYCLES")
    materials = {kind: build_material(record, kind) for kind in KINDS}
    row = [distance(colour(material, EEVEE), in_eevee) for material in materials.values()]
    row.append(distance(in_eevee, in_cycles))
    row.append(distance(in_eevee, colour(materials["measured"], "CYCLES")))
    if with_closures:
        show_closures(materials["measured"])
        row.append(distance(colour(materials["measured"], EEVEE), in_eevee))
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--closures", action="store_true")
    options = parser.parse_args()
    heads = [f"EEVEE, {kind}, against EEVEE, Principled" for kind in KINDS]
    heads += ["EEVEE, Principled, against Cycles, Principled", "against Cycles, measured"]
    heads += ["EEVEE, closures, against EEVEE, Principled"] if options.closures else []
    print(f"| material | {' | '.join(heads)} |")
    print("|---" * (len(heads) + 1) + "|")
    for file in options.files:
        record = record_of(file, closures=WANTED, model="interpolated", norm=VISUAL_NORM)
        with quiet():
            bpy.ops.wm.read_factory_settings(use_empty=True)
            set_up_scene()
        cells = [f"{part:.1%}" for part in row_of(record, options.closures)]
        print(f"| {record.name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
