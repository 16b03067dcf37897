"""What pictures of each kind of material cost: ./dev bench picture_cost FILE..

FILE is a measured file or a record; closures that a record lacks are fitted first. One table for
each material and scene (addon/cost.py): processor time per camera sample, the least of all rounds
and how far the median lies above it, the ratio to a Principled BSDF of Metallic 0.5, and what the
node trees hold. The last table has the worst ratio of each kind; two specular closures of the
measurement are to cost at most 1.0, three at most 1.3.
"""

import argparse
from collections import defaultdict
from pathlib import Path

import bpy
from lobefit import Record, pictures
from lobefit.blender import quiet
from lobefit.inputs import record_of
from lobefit.record import VISUAL_NORM
from lobefit_addon import build_material
from lobefit_addon.cost import SCENES, contents, diffuse_material, measure_costs
from lobefit_addon.nodes.principled import principled_node
from lobefit_addon.nodes.tree import empty_shader_tree

UNIT = "Principled, Metallic 0.5"
LIMITS = {"measured 2": 1.0, "measured 3": 1.3}
# A path of several bounces takes longer, so it needs fewer of them.
SAMPLES = {"sun": 32, "world": 32, "room": 8}


def principled(metallic: float) -> bpy.types.Material:
    """A grey Principled BSDF without multiple scattering, as all best fits are."""
    material = bpy.data.materials.new(f"Principled {metallic}")
    tree = empty_shader_tree(material)
    sockets = {"base_color": [0.5] * 3, "roughness": 0.5, "ior": 1.5, "specular_tint": [1.0] * 3}
    node = principled_node(tree, {**sockets, "metallic": metallic})
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def materials_of(record: Record) -> dict[str, bpy.types.Material]:
    materials = {"diffuse": diffuse_material()}
    for metallic in (0.0, 0.5, 1.0):
        materials[f"Principled, Metallic {metallic:g}"] = principled(metallic)
    materials["Principled, best fit"] = build_material(record, "principled")
    for target, count in pictures.COMPARED:
        materials[f"{target} {count}"] = build_material(record, target, count=count)
    materials["live"] = build_material(record, "live")
    return materials


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--scenes", nargs="*", choices=SCENES, default=list(SCENES))
    options = parser.parse_args()
    ratios: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for file in options.files:
        record = pictures.with_closures(record_of(file, model="interpolated", norm=VISUAL_NORM))
        bpy.ops.wm.read_factory_settings(use_empty=True)
        materials = materials_of(record)
        for lights in options.scenes:
            with quiet():
                costs = measure_costs(materials, lights, options.rounds, SAMPLES[lights])
            print(f"\n{record.name}, {SCENES[lights]}\n")
            print("| material | ns a sample | median over it | ratio | nodes | curves | closures |")
            print("|---" * 7 + "|")
            for name, cost in costs.items():
                ratio = cost.seconds / costs[UNIT].seconds
                ratios[name][lights].append(ratio)
                held = contents(materials[name])
                print(
                    f"| {name} | {cost.seconds * 1e9:.0f} | {cost.spread:.0%} | {ratio:.3f} |"
                    f" {held.nodes} | {held.curves} | {held.closures} |",
                    flush=True,
                )
    print(f"\nWorst ratio to {UNIT}, of {len(options.files)} materials\n")
    print("| material | " + " | ".join(options.scenes) + " | at most |")
    print("|---" * (len(options.scenes) + 2) + "|")
    for name, by_scene in ratios.items():
        worst = " | ".join(f"{max(by_scene[lights]):.3f}" for lights in options.scenes)
        print(f"| {name} | {worst} | {LIMITS.get(name, '')} |")


if __name__ == "__main__":
    main()
