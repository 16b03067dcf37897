"""The few calls that need Blender; nothing of it is imported before one of them is made."""

import dataclasses
import importlib.util
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lobefit import memory, preview
from lobefit._native import InputError
from lobefit.atomic import place_to_write, written_aside
from lobefit.catalogues import Catalogues
from lobefit.fitting import TOLERANCE
from lobefit.inputs import Progress
from lobefit.library import Asset
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


_MEMORY = 1 << 30  # bytes; less is not enough for its exporters
_POLL = 0.1  # seconds between two looks at work under way


class Shown(NamedTuple):
    """What Cycles shows of a record, and how far it is off, in a few words each and as a number."""

    what: str
    off: str
    error: float  # the part of the measured light


def need_blender() -> None:
    """Raises InputError, with what to install, where Blender's Python module is missing.

    Raises MemoryError where there is too little for Blender, which would end the process.
    """
    for module in _MODULES:
        if importlib.util.find_spec(module) is None:
            raise InputError(
                f"expected the Python module {module}, found none; install it with: pip install "
                "bpy."
            )
    memory.need(_MEMORY)


def write_blend(
    path: str | os.PathLike[str],
    record: Record,
    kind: str = "live",
    count: int | None = None,
    tolerance: float = TOLERANCE,
) -> Shown:
    """Writes a Blender file with the material of a record on a sphere under two lights.

    `kind`, `count` and `tolerance` are those of `lobefit_addon.build_material`. Returns what Cycles
    shows.
    """
    _two_lights_scene(record, 512, kind, count=count, tolerance=tolerance)
    _save(path)
    return shown(record, kind, count, tolerance)


def write_library(
    path: str | os.PathLike[str],
    contents: Sequence[tuple[Record, Asset]],
    kind: str = "measured",
    count: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Writes a Blender file whose materials are assets, and their catalogues beside it.

    Each material carries its record, with the name of the measured file but not its folder. `kind`
    and `count` are those of `lobefit_addon.build_material`. The file is opened again before it gets
    its name. Returns the number of `materials`, their `catalogues`, the `catalogue_file`, and in
    `opens_in` the oldest Blender that opens the library. Raises InputError where it cannot be
    written.
    """
    catalogues = Catalogues(place_to_write(path).parent)
    from lobefit_addon.assets import missing_assets, oldest_release
    from lobefit_addon.records import KEY

    with quiet():
        _empty_file()
    made = []
    for index, (record, asset) in enumerate(contents):
        if progress:
            progress(index / len(contents), record.name)
        material = _asset(_portable(record), asset, catalogues, kind, count)
        made.append((material.name, material[KEY]))
    if progress:
        progress(1.0, "writing")
    with written_aside(path) as aside:
        _save_as(aside, path)
        _open(aside)
        missing = missing_assets(made)
        if missing:
            raise InputError(f"{path}: expected {missing[0]} in what was written, found it lost.")
        catalogues.save()
    return {
        "materials": len(made),
        "catalogues": sorted({asset.catalogue for _, asset in contents}),
        "catalogue_file": str(catalogues.path),
        "opens_in": oldest_release(),
    }


def shown(
    record: Record, kind: str, count: int | None = None, tolerance: float = TOLERANCE
) -> Shown:
    """What is built of a record with these arguments of `lobefit_addon.build_material`."""
    from lobefit_addon.nodes.material import choose

    choice = choose(record, kind, count, tolerance)
    plural = "" if choice.count == 1 else "s"
    closures = f", {choice.count} specular closure{plural}" if choice.closures else ""
    return Shown(choice.kind + closures, choice.told_error(record), choice.error(record))


def render(record: Record, size: int, kind: str = "live") -> NDArray[np.float32]:
    """The radiance (size, size, 3) that Cycles gives a record's material under the two lights."""
    from lobefit_addon.scene import render_pixels

    scene = _two_lights_scene(record, size, kind)
    with quiet():
        pixels: NDArray[np.float32] = render_pixels(scene)
    return pixels


def render_materials(
    path: str | os.PathLike[str], size: int, progress: Progress | None = None
) -> dict[str, NDArray[np.float32]]:
    """The measured materials of a Blender file as Cycles shows them under the two lights.

    The radiance (size, size, 3) of a sphere by the name of the material. Raises InputError for a
    file that cannot be read.
    """
    _open(path)
    import bpy
    from lobefit_addon.records import KEY
    from lobefit_addon.scene import render_pixels, two_lights_scene

    rendered = {}
    materials = [item for item in bpy.data.materials if KEY in item]
    for index, material in enumerate(materials):
        if progress:
            progress(index / len(materials), f"Rendering {material.name}")
        with quiet():
            rendered[material.name] = render_pixels(two_lights_scene(material, size))
    return rendered


def costs(record: Record) -> dict[tuple[str, int | None], float]:
    """Processor seconds a camera sample of every kind of material of a record, by kind and count.

    Both are those of `lobefit_addon.build_material`; the count is None where a kind has no choice
    of it. ("diffuse", None) is a plain diffuse surface. Measured under a constant world, which lets
    Cycles both evaluate and sample each closure.
    """
    from lobefit_addon import build_material
    from lobefit_addon.cost import diffuse_material, measure_costs

    ways = [("live", None), ("principled", None)]
    ways += [(entry["target"], entry["count"]) for entry in record.closures if entry["count"]]
    with quiet():
        _empty_file()
        materials = {("diffuse", None): diffuse_material()}
        for kind, count in ways:
            materials[kind, count] = build_material(record, kind=kind, count=count)
        measured = measure_costs(materials, "world", rounds=5, samples=16)
    return {way: cost.seconds for way, cost in measured.items()}


def records_in(path: str | os.PathLike[str]) -> dict[str, str]:
    """The records, in JSON, of the materials of a Blender file, by the names of the materials."""
    _open(path)
    import bpy
    from lobefit_addon.records import KEY

    return {item.name_full: str(item[KEY]) for item in bpy.data.materials if KEY in item}


def export_principled(path: str | os.PathLike[str], name: str, record: Record) -> None:
    """Writes a sphere of a record's Principled BSDF, by Blender's exporter of glTF or of USD.

    The suffix of `path` tells which, .glb or .usdc; `name` is that of the material.
    """
    import bpy
    from lobefit_addon import build_material
    from lobefit_addon.scene import sphere_mesh

    with quiet():
        _empty_file()
        mesh = sphere_mesh(build_material(record, "principled", name), subdivisions=5)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))
    with written_aside(path) as aside, quiet():
        export = bpy.ops.wm.usd_export
        if aside.suffix == ".glb":
            export = bpy.ops.export_scene.gltf
        try:
            export(filepath=str(aside.absolute()))
            whole = _is_whole(aside)
        except AttributeError as error:
            reason = "this Blender was built without an exporter for it"
            raise InputError(f"{path}: cannot be written, {reason}.") from error
        except RuntimeError as error:
            raise InputError(f"{path}: cannot be written, {_one_line(error)}.") from error
        if not whole:
            raise InputError(f"{path}: cannot be written, its end is missing.")


def _is_whole(path: Path) -> bool:
    """Whether a .glb or a .usdc is as long as it says; exporters do not tell of a full disk."""
    data = path.read_bytes()

    def number(place: int, size: int) -> int:
        return int.from_bytes(data[place : place + size], "little")

    if path.suffix == ".glb":
        return len(data) == number(8, 4)
    # It ends with a table of contents, which is as many entries as it says.
    table = number(16, 8)
    return 0 < table < len(data) and len(data) == table + 8 + 32 * number(table, 8)


def leave_after_gltf(code: int) -> int:
    """The exit code, for a program that ends now; it does not return where the end would crash.

    The bpy 4.2 wheel does, after its exporter of glTF has run.
    """
    import bpy

    if bpy.app.version < (4, 3) and not is_this_program():
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    return code


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


def _empty_file() -> None:
    """A new file without data.

    Factory settings would have no extension enabled, and Blender then deletes the modules of all:
    those that the user's own Blender has loaded a part of.
    """
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def _open(path: str | os.PathLike[str]) -> None:
    if not Path(path).is_file():
        raise InputError(f"{path}: expected a Blender file, found no such file.")
    import bpy

    with quiet():
        try:
            # A file may be a stranger's: its scripts and drivers stay what they are, data.
            bpy.ops.wm.open_mainfile(
                filepath=str(Path(path).absolute()), load_ui=False, use_scripts=False
            )
        except RuntimeError as error:
            raise InputError(
                f"{path}: expected a Blender file, found one that cannot be opened "
                f"({_one_line(error)})."
            ) from error


def _one_line(error: RuntimeError) -> str:
    text = str(error)
    if "Traceback" in text:  # of an exporter in Python, followed by the place of the call
        lines = [line for line in text.splitlines() if line and not line.startswith("Location:")]
        return lines[-1].rstrip(".")
    return " ".join(str(error).removeprefix("Error:").split()).rstrip(".")


def _two_lights_scene(record: Record, size: int, kind: str, **options: Any) -> Any:
    """An otherwise empty Blender whose scene shows the material, `size` pixels wide."""
    from lobefit_addon import build_material
    from lobefit_addon.scene import two_lights_scene

    with quiet():
        _empty_file()
        material = build_material(record, kind, record.name, **options)
        material.use_fake_user = True
        return two_lights_scene(material, size)


def _asset(
    record: Record, asset: Asset, catalogues: Catalogues, kind: str, count: int | None
) -> Any:
    """A new material that is an asset, with its picture."""
    from lobefit_addon import build_material
    from lobefit_addon.assets import mark_asset, set_picture
    from lobefit_addon.nodes.material import choose

    material = build_material(record, kind, asset.name or record.name, count)
    looks = shown(record, kind, count)
    told = [f"{looks.what}, {looks.off}"]
    told += [f"Measured in {record.source['path']}"] if record.source["path"] else []
    told += [f"Source: {asset.source}"] if asset.source else []
    mark_asset(material, asset, catalogues.identifier(asset.catalogue), ". ".join(told))
    set_picture(material, preview.thumbnail(choose(record, kind, count).shown(record)))
    return material


def _portable(record: Record) -> Record:
    """The record with the name of its measured file, which may be shared, but not its folder."""
    path = record.source["path"]
    source = record.source | {"path": Path(path).name if path else None}
    return dataclasses.replace(record, source=source)


def _save(path: str | os.PathLike[str]) -> None:
    with written_aside(path) as aside:
        _save_as(aside, path)


def _save_as(aside: Path, path: str | os.PathLike[str]) -> None:
    """Saves to `aside`; what goes wrong is told of `path`."""
    import bpy

    with quiet():
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(aside.absolute()), copy=True, compress=True)
        except RuntimeError as error:
            raise InputError(f"{path}: cannot be written, {_one_line(error)}.") from error
        try:
            # Blender does not tell when the disk is full at the last of its blocks.
            with bpy.data.libraries.load(str(aside.absolute())):
                pass
        except OSError as error:
            raise InputError(f"{path}: cannot be written, its end is missing.") from error


@contextmanager
def quiet() -> Iterator[None]:
    """Keeps what Blender itself prints out of our results and messages."""
    sys.stdout.flush()
    sys.stderr.flush()
    ours = os.dup(1), os.dup(2)
    try:
        # Operators tell their reports through Python, the rest of Blender by itself.
        with (
            Path(os.devnull).open("w") as nowhere,
            redirect_stdout(nowhere),
            redirect_stderr(nowhere),
        ):
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
            yield
    finally:
        for number, kept in enumerate(ours, start=1):
            os.dup2(kept, number)
            os.close(kept)
