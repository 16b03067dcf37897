"""Makes saved/NAME.blend: small files as each version of the node groups was saved.

Usage: python make_saved.py [NAME..], in a Python with bpy 4.2 and lobefit, so that every supported
release opens the files. A file of an earlier version is made by the nodes of that time, from this
repository's history; the others by those that are installed. Each has a sphere under the two
lights and materials of a sample made from published figures, and beside it NAME.npz has what
Blender 4.2 renders of each. They are made once: a change of what is saved gets a file of its own,
and the others stay as they are.
"""

import dataclasses
import importlib
import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

os.environ["HOME"] = os.sep  # the folder of a file browser, which is saved with the file

import bpy
import lobefit
import lobefit_addon.scene
import numpy as np
from lobefit import _native

FOLDER = Path(__file__).with_name("saved")
SIZE = 24  # pixels of the pictures
ROUND = 3  # subdivisions of the sphere: 162 vertices

# The commit that has the nodes (None: they are installed), and the materials to make.
VERSIONS: dict[str, tuple[str | None, tuple[str, ...]]] = {
    "live-1": ("7c1bbf70a7675ed3ece4cbf5a8af590afcda4b2f", ("live", "principled")),
    "live-2": ("29dee27ba4691faf9e2b99f6216da41fc0558560", ("live", "principled")),
    "live-3": ("c9df98d3f965c94e5177f2b6313037707aa1ec4a", ("live", "principled")),
    "baked-1": ("f253ca022a0fc31b8e7043fdf8bc2bb624c4f408", ("measured", "lobe")),
    "baked-2": ("c9df98d3f965c94e5177f2b6313037707aa1ec4a", ("measured", "lobe", "bounces")),
    "classic-1": (None, ("classic",)),
    # From here on a material tells which version built it.
    "material-1": (None, ("live", "principled", "measured", "lobe", "bounces")),
}
# What records did not hold at the time of the first version.
LATER = ("closures", "error_by_angle", "uncertainty")


def main(names: list[str]) -> None:
    FOLDER.mkdir(exist_ok=True)
    record = sample_record()
    for name in names or VERSIONS:
        commit, kinds = VERSIONS[name]
        with tempfile.TemporaryDirectory() as folder:
            nodes = nodes_of(commit, Path(folder))
            write(FOLDER / name, [builder(nodes, record, name, kind) for kind in kinds])


def sample_record() -> lobefit.Record:
    """A record of the sample nickel, in which nothing is of the machine that made it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "nickel.binary"
        _native.sample("nickel").write(str(path))
        record = lobefit.closures(path, count=2, norm="cosine-l1")
    record = lobefit.closures(record, target="lobe", count=1)
    record.source |= {"path": path.name, "name": lobefit.origin.sample_title(path.stem)}
    record.machine.update(system="", processor="", threads=1)
    return record


def nodes_of(commit: str | None, folder: Path) -> ModuleType:
    """The extension's package of nodes, out of the history into `folder` if a commit is given."""
    if commit is None:
        return importlib.import_module("lobefit_addon.nodes")
    name = f"addon_{commit}"
    root = str(Path(__file__).parents[1])
    command = ["git", "-C", root, "archive", f"--prefix={name}/", f"{commit}:addon"]
    archive = subprocess.run(command, check=True, capture_output=True).stdout
    with tarfile.open(fileobj=io.BytesIO(archive)) as files:
        files.extractall(folder, filter="data")
    sys.path.insert(0, str(folder))
    return importlib.import_module(f"{name}.nodes")


def builder(
    nodes: ModuleType, record: lobefit.Record, version: str, kind: str
) -> Callable[[], bpy.types.Material]:
    """Makes the material `kind` in the open file."""
    if kind == "classic":
        return classic_material
    options: dict[str, Any] = {"kind": kind, "name": kind}
    if kind == "bounces":
        options |= {"kind": "measured", "diffuse_bounces": True}
    if kind in ("live", "principled"):
        record = dataclasses.replace(record, closures=[])
    entries = json.loads(record.to_json())
    if version == "live-1":
        entries = {key: value for key, value in entries.items() if key not in LATER}
    told = SimpleNamespace(
        parameters=record.parameters,
        principled=record.principled,
        closures=record.closures,
        albedo=record.albedo,
        to_json=lambda: json.dumps(entries, indent=1) + "\n",
    )
    return lambda: nodes.material.build_material(told, **options)


def classic_material() -> bpy.types.Material:
    """Classic Phong / Blinn-Phong, under a light of its own, with every input away from 0."""
    from lobefit_addon.nodes.classic import classic_group
    from lobefit_addon.nodes.tree import empty_shader_tree

    material = bpy.data.materials.new("classic")
    tree = empty_shader_tree(material)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = classic_group()
    node.inputs["Blinn-Phong"].default_value = 0.5
    node.inputs["Match Exponent"].default_value = 1.0
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["Emission"], output.inputs["Surface"])
    return material


def smooth_sphere() -> bpy.types.Mesh:
    """A unit sphere without normals of its own, which releases save in different ways."""
    import bmesh  # there once bpy is

    mesh = bpy.data.meshes.new("Sphere")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=ROUND, radius=1.0)
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    return mesh


def write(place: Path, builders: list[Callable[[], bpy.types.Material]]) -> None:
    """Writes a file with all materials, the first one on the sphere, and the pictures of them."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.save_version = 0  # no second file beside
    materials = [build() for build in builders]
    scene = lobefit_addon.scene.two_lights_scene(None, SIZE)
    sphere = scene.objects["Sphere"]
    bpy.data.batch_remove([sphere.data, *bpy.data.brushes])
    sphere = bpy.data.objects.new("Sphere", smooth_sphere())
    scene.collection.objects.link(sphere)
    sphere.data.materials.append(materials[0])
    pictures = {}
    for material in materials:
        material.use_fake_user = True
        sphere.data.materials[0] = material
        pictures[material.name] = lobefit_addon.scene.render_pixels(scene)
    sphere.data.materials[0] = materials[0]
    bpy.data.orphans_purge()
    path = place.with_suffix(".blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), compress=True)
    np.savez_compressed(place.with_suffix(".npz"), **pictures)
    print(f"{path}: {path.stat().st_size:,} bytes, {', '.join(pictures)}")


if __name__ == "__main__":
    main(sys.argv[1:])
