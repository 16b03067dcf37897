"""The few calls that need Blender; nothing of it is imported before one of them is made."""

import importlib.util
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lobefit._native import InputError
from lobefit.atomic import written_aside
from lobefit.record import Record

KINDS = ("measured", "lobe", "live", "principled", "auto")

_MODULES = ("bpy", "lobefit_addon")


def has_blender() -> bool:
    """Whether Blender's Python module and the add-on are there."""
    return all(importlib.util.find_spec(module) for module in _MODULES)


def need_blender() -> None:
    """Raises InputError, with what to install, where Blender's Python module is missing."""
    for module in _MODULES:
        if importlib.util.find_spec(module) is None:
            raise InputError(
                f"expected the Python module {module} to make a material, found none; install it "
                "with: pip install 'lobefit[blender]'."
            )


def write_blend(
    path: str | os.PathLike[str], record: Record, kind: str = "live", **options: Any
) -> None:
    """Writes a Blender file with the material of a record on a sphere under two lights.

    `kind` and `options` are those of `lobefit_addon.build_material`.
    """
    _two_lights_scene([record], 512, kind, **options)
    _save(path)


def write_library(path: str | os.PathLike[str], records: list[Record], kind: str = "live") -> None:
    """Writes a Blender file with the materials of all records, the first of them on a sphere."""
    _two_lights_scene(records, 512, kind)
    _save(path)


def render(record: Record, size: int, kind: str = "live") -> NDArray[np.float32]:
    """The radiance (size, size, 3) that Cycles gives a record's material under the two lights."""
    from lobefit_addon.scene import render_pixels

    scene = _two_lights_scene([record], size, kind)
    with quiet():
        pixels: NDArray[np.float32] = render_pixels(scene)
    return pixels


def costs(record: Record) -> dict[tuple[str, int | None], float]:
    """Processor seconds a camera sample of every kind of material of a record, by kind and count.

    Both are those of `lobefit_addon.build_material`; the count is None where a kind has no choice
    of it. ("diffuse", None) is a plain diffuse surface. Measured under a constant world, which lets
    Cycles both evaluate and sample each closure.
    """
    import bpy
    from lobefit_addon import build_material
    from lobefit_addon.cost import diffuse_material, measure_costs

    ways = [("live", None), ("principled", None)]
    ways += [(entry["target"], entry["count"]) for entry in record.closures if entry["count"]]
    with quiet():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        materials = {("diffuse", None): diffuse_material()}
        for kind, count in ways:
            materials[kind, count] = build_material(record, kind=kind, count=count)
        measured = measure_costs(materials, "world", rounds=5, samples=16)
    return {way: cost.seconds for way, cost in measured.items()}


def _two_lights_scene(records: list[Record], size: int, kind: str, **options: Any) -> Any:
    """An otherwise empty Blender with the materials; the scene shows the first, `size` pixels."""
    import bpy
    from lobefit_addon import build_material
    from lobefit_addon.scene import two_lights_scene

    with quiet():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        materials = [build_material(record, kind, record.name, **options) for record in records]
        for material in materials:
            material.use_fake_user = True
        return two_lights_scene(materials[0], size)


def _save(path: str | os.PathLike[str]) -> None:
    import bpy

    with written_aside(path) as aside, quiet():
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(aside.absolute()), copy=True, compress=True)
        except RuntimeError as error:
            raise InputError(f"{path}: cannot be written, {str(error).strip()}.") from error


@contextmanager
def quiet() -> Iterator[None]:
    """Keeps what Blender itself prints out of our results on stdout."""
    sys.stdout.flush()
    ours = os.dup(1)
    try:
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
        yield
    finally:
        os.dup2(ours, 1)
        os.close(ours)
