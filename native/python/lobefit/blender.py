"""The few calls that need Blender; nothing of it is imported before one of them is made."""

import importlib.util
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lobefit._native import InputError
from lobefit.atomic import written_aside
from lobefit.fitting import TOLERANCE
from lobefit.inputs import Progress
from lobefit.record import Record

KINDS = ("measured", "lobe", "live", "principled", "auto")

_MODULES = ("bpy", "lobefit_addon")


def has_blender() -> bool:
    """Whether Blender's Python module and the add-on are there."""
    return all(importlib.util.find_spec(module) for module in _MODULES)


def is_this_program() -> bool:
    """Whether this process is Blender, and not a Python with the module bpy."""
    bpy = sys.modules.get("bpy")
    return bpy is not None and bool(bpy.app.binary_path)


_POLL = 0.1  # seconds between two looks at work under way


def need_blender() -> None:
    """Raises InputError, with what to install, where Blender's Python module is missing."""
    for module in _MODULES:
        if importlib.util.find_spec(module) is None:
            raise InputError(
                f"expected the Python module {module} to make a material, found none; install it "
                "with: pip install bpy."
            )


def write_blend(
    path: str | os.PathLike[str],
    record: Record,
    kind: str = "live",
    count: int | None = None,
    tolerance: float = TOLERANCE,
) -> tuple[str, float]:
    """Writes a Blender file with the material of a record on a sphere under two lights.

    `kind`, `count` and `tolerance` are those of `lobefit_addon.build_material`. Returns what Cycles
    shows, in a few words, and the part of the light that is off.
    """
    _two_lights_scene([record], 512, kind, count=count, tolerance=tolerance)
    _save(path)
    from lobefit_addon.nodes.material import choose

    choice = choose(record, kind, count, tolerance)
    closures = f", {choice.count} specular closures" if choice.closures else ""
    return choice.kind + closures, choice.error(record)


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


def simplify(
    path: str | os.PathLike[str],
    output: str | os.PathLike[str] | None,
    tolerance: float,
    frames: int,
    diffuse_bounces: bool = False,
    timed: bool = False,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Simplifies the measured materials of a Blender file's scene; returns what was done.

    `tolerance` is a part of the picture's light. Nothing is written where `output` is None. Raises
    InputError for a file that cannot be read, or whose scene has no camera to look through.
    """
    _open(path)
    import bpy
    from lobefit_addon.simplification import simplify as simplify_scene
    from lobefit_addon.survey import Survey

    survey = Survey(bpy.context, frames)
    try:
        while not survey.advance(_POLL):
            if progress:
                progress(survey.progress, survey.text)
    finally:
        survey.stop()
    if survey.problem:
        raise InputError(f"{path}: {survey.problem}")
    with quiet():
        result: dict[str, Any] = simplify_scene(
            bpy.context, survey, tolerance, diffuse_bounces, timed
        )
    if output is not None:
        _save(output)
    return result


def restore(path: str | os.PathLike[str], output: str | os.PathLike[str] | None) -> dict[str, Any]:
    """Puts back what simplified materials of a Blender file showed; returns their names."""
    _open(path)
    from lobefit_addon.simplification import restore_all

    result: dict[str, Any] = restore_all()
    if output is not None:
        _save(output)
    return result


def _open(path: str | os.PathLike[str]) -> None:
    if not Path(path).is_file():
        raise InputError(f"{path}: expected a Blender file, found no such file.")
    import bpy

    with quiet():
        try:
            bpy.ops.wm.open_mainfile(filepath=str(Path(path).absolute()), load_ui=False)
        except RuntimeError as error:
            raise InputError(
                f"{path}: expected a Blender file, found one that cannot be opened "
                f"({_one_line(error)})."
            ) from error


def _one_line(error: RuntimeError) -> str:
    return " ".join(str(error).removeprefix("Error:").split()).rstrip(".")


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
        # Operators tell their reports through Python, the rest of Blender by itself.
        with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere):
            os.dup2(nowhere.fileno(), 1)
            yield
    finally:
        os.dup2(ours, 1)
        os.close(ours)
