"""How noisy pictures of each kind of material are: ./dev bench picture_noise FILE..

FILE is a measured file or a record; closures that a record lacks are fitted first. A sphere stands
under a sky with small bright suns, sampled as any HDR image is. Two figures, and their ratios to
those of the material's own best Principled BSDF (at most 1.2 is wanted): the variance of pixels at
equal samples, as a part of the squared mean of the picture, and the root mean square error of a
denoised picture of 64 samples against one of 4096, as a part of the mean. Few samples that meet a
sun make most of the variance, so that it takes hundreds of pictures to know it: its standard error
goes beside.
"""

import argparse
from pathlib import Path

import bpy
import numpy as np
from lobefit import Record, pictures
from lobefit.blender import quiet
from lobefit.inputs import record_of
from lobefit.record import VISUAL_NORM
from lobefit_addon import build_material
from lobefit_addon.nodes.tree import empty_shader_tree
from lobefit_addon.scene import radiance, two_lights_scene
from mathutils import Vector
from numpy.typing import NDArray

SIZE = 48
NOISY, RENDERS = 16, 240  # samples of a picture whose variance is taken, and how many of them
PARTS = 12  # of the renders, whose variances tell how sure that of all is
DENOISED, REFERENCE = 64, 4096
LIMIT = 1.2
# Direction, cosine of the half angle, radiance: two suns of some 3 and 5 degrees, and a window.
LAMPS = [((1, 1, 1.2), 0.999, 400.0), ((-1, -0.3, 0.4), 0.996, 60.0), ((-0.4, 1, -0.2), 0.97, 6.0)]


def sky() -> bpy.types.World:
    """A gradient from the ground to the zenith (+y in the picture), with bright discs in it."""
    world = bpy.data.worlds.new("Sky")
    tree = empty_shader_tree(world)
    nodes, links = tree.nodes, tree.links
    direction = nodes.new("ShaderNodeNewGeometry").outputs["Incoming"]

    def math(operation: str, *operands: object) -> bpy.types.NodeSocket:
        node = nodes.new("ShaderNodeMath")
        node.operation = operation
        for socket, value in zip(node.inputs, operands, strict=False):
            if isinstance(value, float):
                socket.default_value = value
            else:
                links.new(value, socket)
        return node.outputs[0]

    def cosine_to(toward: Vector) -> bpy.types.NodeSocket:
        node = nodes.new("ShaderNodeVectorMath")
        node.operation = "DOT_PRODUCT"
        links.new(direction, node.inputs[0])
        node.inputs[1].default_value = -toward.normalized()  # Incoming points back to the camera
        return node.outputs["Value"]

    total = math("MULTIPLY_ADD", cosine_to(Vector((0, 1, 0))), 0.3, 0.5)
    for toward, edge, strength in LAMPS:
        inside = math("GREATER_THAN", cosine_to(Vector(toward)), edge)
        total = math("MULTIPLY_ADD", inside, strength, total)
    background = nodes.new("ShaderNodeBackground")
    links.new(total, background.inputs["Strength"])
    output = nodes.new("ShaderNodeOutputWorld")
    links.new(background.outputs[0], output.inputs["Surface"])
    world.cycles.sampling_method = "MANUAL"
    world.cycles.sample_map_resolution = 512
    return world


def set_up_scene() -> bpy.types.Scene:
    scene = two_lights_scene(None, SIZE)
    for item in [item for item in scene.objects if item.type == "LIGHT"]:
        bpy.data.objects.remove(item)
    scene.world = sky()
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.use_persistent_data = True
    # Black around the sphere: the sky itself has no noise to compare.
    scene.render.film_transparent = True
    scene.cycles.denoiser = "OPENIMAGEDENOISE"
    return scene


def picture(
    scene: bpy.types.Scene, samples: int, seed: int, denoise: bool = False
) -> NDArray[np.float32]:
    scene.cycles.samples, scene.cycles.seed = samples, seed
    scene.cycles.use_denoising = denoise
    return radiance(scene)


def noise_of(scene: bpy.types.Scene) -> tuple[float, float, float]:
    """The relative variance of pixels, its standard error, and the denoised picture's error."""
    several = np.stack([picture(scene, NOISY, seed) for seed in range(RENDERS)])
    parts = [part.var(axis=0, ddof=1).mean() for part in np.split(several, PARTS)]
    variance, scale = np.mean(parts), several.mean() ** 2
    uncertain = np.std(parts, ddof=1) / PARTS**0.5
    reference = picture(scene, REFERENCE, 1000)
    errors = [
        np.sqrt(((picture(scene, DENOISED, seed, True) - reference) ** 2).mean())
        for seed in range(2000, 2004)
    ]
    return variance / scale, uncertain / scale, float(np.mean(errors) / reference.mean())


def materials_of(record: Record) -> dict[str, bpy.types.Material]:
    materials = {"Principled, best fit": build_material(record, "principled")}
    for target, count in pictures.COMPARED:
        if target == "measured":
            materials[f"{target} {count}"] = build_material(record, target, count=count)
    return materials


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    options = parser.parse_args()
    print(f"at most {LIMIT} is wanted of both ratios\n")
    print("| material | kind | variance | standard error | ratio | denoised error | ratio |")
    print("|---" * 7 + "|")
    for file in options.files:
        record = pictures.with_closures(record_of(file, model="interpolated", norm=VISUAL_NORM))
        with quiet():
            bpy.ops.wm.read_factory_settings(use_empty=True)
            scene = set_up_scene()
        unit = None
        for name, material in materials_of(record).items():
            with quiet():
                scene.objects["Sphere"].data.materials[0] = material
                variance, uncertain, denoised = noise_of(scene)
            unit = unit or (variance, denoised)
            print(
                f"| {record.name} | {name} | {variance:.4g} | {uncertain:.2g} | "
                f"{variance / unit[0]:.2f} | {denoised:.4g} | {denoised / unit[1]:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
