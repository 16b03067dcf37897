"""Where Phong's highlight is cut and Blinn-Phong's is not: ./dev bench classic_picture PICTURE.png

Spheres that Cycles renders with the group Classic Phong / Blinn-Phong, under one light from the
upper right: Phong's term ends at 90 degrees between the mirrored light and the viewer, which shows
as an edge where the exponent is small. docs/classic.png is made by this.
"""

import argparse

import bpy
import numpy as np
from lobefit import lettering, picture
from lobefit_addon.nodes.classic import classic_group, light_socket
from lobefit_addon.nodes.tree import empty_shader_tree
from lobefit_addon.scene import radiance, two_lights_scene

EXPONENTS = (0.3, 1.0, 4.0, 20.0)
ROWS = {
    "Phong": {"Blinn-Phong": 0.0, "Match Exponent": 0.0},
    "Blinn-Phong": {"Blinn-Phong": 1.0, "Match Exponent": 0.0},
    "matched": {"Blinn-Phong": 1.0, "Match Exponent": 1.0},
}
LIGHT = (0.45, 0.45, 0.77)
COLOURS = {
    "Ambient Color": (0.02, 0.02, 0.02, 1.0),
    "Diffuse Color": (0.1, 0.02, 0.01, 1.0),
    "Specular Color": (0.8, 0.8, 0.8, 1.0),
    "Ambient Light": (1.0, 1.0, 1.0, 1.0),
}
SIZE, FINER, GAP, LEFT, TOP = 180, 3, 16, 130, 46
PAPER, INK = (0.115, 0.115, 0.125), (0.95, 0.95, 0.95)


def sphere(**inputs: float) -> picture.Image:
    """A sphere with these inputs of the group, sRGB, as Cycles renders it."""
    material = bpy.data.materials.new("Classic")
    tree = empty_shader_tree(material)
    node, output = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Group", "OutputMaterial"))
    node.node_tree = classic_group()
    tree.links.new(node.outputs["Emission"], output.inputs["Surface"])
    for name, value in {**COLOURS, light_socket(0, "Direction"): LIGHT, **inputs}.items():
        node.inputs[name].default_value = value
    scene = two_lights_scene(material, SIZE * FINER)
    scene.cycles.samples = 1
    return picture.encode(picture.shrink(np.array(radiance(scene)), FINER))


def main() -> None:
    parser = argparse.ArgumentParser(prog="classic_picture")
    parser.add_argument("output", metavar="PICTURE.png")
    output = parser.parse_args().output
    step = SIZE + GAP
    sheet = picture.page(TOP + len(ROWS) * step, LEFT + len(EXPONENTS) * step, PAPER)
    for column, exponent in enumerate(EXPONENTS):
        left = LEFT + column * step
        title = f"exponent {exponent:g}"
        lettering.draw(sheet, title, left + SIZE / 2, TOP - 16, 17.0, INK, "center")
        for row, inputs in enumerate(ROWS.values()):
            shown = sphere(Exponent=exponent, **inputs)
            picture.paste(sheet, shown, TOP + row * step, left, picture.disc(SIZE))
    for row, name in enumerate(ROWS):
        middle = TOP + row * step + SIZE / 2
        lettering.draw(sheet, name, LEFT - GAP, middle + 6, 17.0, INK, "right")
    picture.write_png(output, sheet)


if __name__ == "__main__":
    main()
