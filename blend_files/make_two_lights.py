"""Makes two_lights.blend: a sphere under the two lights of the previews, ready for a material.

Usage: python make_two_lights.py [FILE.blend], in a Python with bpy 4.2 and lobefit, so that every
supported release opens the file.
"""

import sys
from pathlib import Path

import bpy
from lobefit_addon.scene import two_lights_scene

output = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("two_lights.blend")
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.preferences.filepaths.save_version = 0  # no two_lights.blend1
bpy.context.scene.name = "Two Lights"
material = bpy.data.materials.new("Material")
material.use_nodes = True
two_lights_scene(material, 512)
bpy.ops.wm.save_as_mainfile(filepath=str(output.resolve()), compress=True)
