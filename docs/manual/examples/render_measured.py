"""Imports a measured file into Blender and renders it on a sphere.

blender --background --python render_measured.py -- nickel.binary nickel.png

The extension has to be installed and enabled.
"""

import math
import sys
from pathlib import Path

import bpy


def main(measured: str, output: str) -> None:
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64)
    bpy.ops.object.shade_smooth()
    # The material goes to the active object. An error is raised: a RuntimeError with one sentence.
    bpy.ops.lobefit.import_measured(filepath=str(Path(measured).resolve()), kind="measured")
    print("made", bpy.context.object.active_material.name)

    bpy.ops.object.light_add(type="SUN", rotation=(math.radians(50), 0, math.radians(30)))
    bpy.context.object.data.energy = 3
    bpy.ops.object.camera_add(location=(0, -6, 0), rotation=(math.radians(90), 0, 0))
    scene = bpy.context.scene
    scene.camera = bpy.context.object
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 64, False
    scene.render.resolution_x = scene.render.resolution_y = 256
    scene.render.film_transparent = True
    scene.render.filepath = str(Path(output).resolve())
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    if len(arguments) != 2:
        usage = "blender --background --python render_measured.py -- nickel.binary nickel.png"
        sys.exit(f"usage: {usage}")
    main(*arguments)
