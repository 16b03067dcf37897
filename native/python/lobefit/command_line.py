"""The command line: `lobefit COMMAND`, a thin layer over the Python interface.

Exit codes: 0 done; 1 some of several inputs failed, each named, the others done, or the self-test
did; 2 wrong use or an unreadable input; 130 interrupted. Results go to stdout, messages and the
progress bar to stderr.
"""

import argparse
import dataclasses
import io
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np

from lobefit import (
    _native,
    alterations,
    blender,
    export,
    images,
    methods,
    normals,
    picture,
    pictures,
    preview,
    report,
    simplified,
)
from lobefit._native import Cancelled, InputError
from lobefit.albedo import excess
from lobefit.atomic import make_folder, place_to_write, reason, remove_empty, write_bytes
from lobefit.batch import Batch, Ended, Task, in_processes, on_cluster, tasks_at, tasks_in
from lobefit.classic import LEAST_EXPONENT, match_exponent
from lobefit.classic import MOST_EXPONENT as MOST_EXPONENT_TO_MATCH
from lobefit.diagnosis import diagnose
from lobefit.fitting import MOST_CLOSURES, TARGETS, TOLERANCE, Closures, closures_for, read
from lobefit.inputs import (
    MEASUREMENT_SUFFIXES,
    RECORD_SUFFIX,
    Progress,
    record_of,
    spread,
)
from lobefit.library import items_of, records_folder
from lobefit.lights import in_order, read_lights
from lobefit.origin import origin_of, write_samples
from lobefit.phong_energy import LOBES, MOST_EXPONENT, energy
from lobefit.record import MODELS, NORMS, SCHEDULES, VISUAL_NORM, Fit, Record

DONE, SOME_FAILED, WRONG, INTERRUPTED = 0, 1, 2, 130

_BAR = 24  # characters
_LINE_PAUSE = 0.2  # seconds between two lines that tell how far we are
_WRITING = 0.1  # the share of a library's time that its pictures and its file take

Item = TypeVar("Item")
Bar = Callable[[str], AbstractContextManager[Progress | None]]


def main(arguments: list[str] | None = None) -> int:
    """Runs one command and returns its exit code; never a traceback for what a user may do."""
    try:
        options = _parser().parse_args(arguments)
        _keep_what_is_read(options)
        code: int = options.run(options)
        sys.stdout.flush()
        return code
    except InputError as error:
        return _complain(error)
    except (KeyboardInterrupt, Cancelled):
        print("lobefit: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        _drop_output()
        return DONE
    except OSError as error:
        if error.filename is None:  # the output's, or a process's that could not be started
            _drop_output()
            return _complain(f"stopped, {reason(error)}.")
        return _complain(f"{error.filename}: cannot be used, {reason(error)}.")
    except MemoryError:
        return _complain("expected enough memory, found too little.")
    except ImportError as error:
        return _complain(f"stopped, a part of Python cannot be loaded ({error}).")


def _keep_what_is_read(options: argparse.Namespace) -> None:
    """Refuses to write over a file that is read, or two results to one file.

    Closures are added to a record that may keep its place, and a Blender file is changed where it
    is if that is asked for: neither loses anything.
    """
    if options.run in (_closures, _simplify):
        return
    given = vars(options)
    read: list[str] = [*given.get("files", ()), *given.get("images", ())]
    read += [given[name] for name in ("file", "lights", "mask", "material") if given.get(name)]
    kept = {os.path.realpath(path): f"{path}, which is read" for path in read}
    for place in (given.get("output"), given.get("height")):
        if not place or os.path.isdir(place):
            continue
        if what := kept.get(os.path.realpath(place)):
            raise InputError(f"{place}: expected the name of another file to write, found {what}.")
        kept[os.path.realpath(place)] = f"{place}, which is written too"


def _drop_output() -> None:
    """Whoever takes our results is gone; what Python still flushes at its end goes nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(problem: object) -> int:
    print(f"lobefit: {problem}", file=sys.stderr)
    return WRONG


def for_each(items: Iterable[Item], work: Callable[[Item], None]) -> int:
    """Does `work` for every item, tells of those that fail on stderr, and returns the exit code."""
    count = failed = 0
    for item in items:
        count += 1
        try:
            work(item)
        except InputError as error:
            failed += 1
            _complain(error)
    if failed == 0:
        return DONE
    return SOME_FAILED if count > 1 else WRONG


@contextmanager
def progress_bar(name: str) -> Iterator[Progress | None]:
    """A bar on stderr while the block runs; None where stderr is no terminal."""
    if not sys.stderr.isatty():
        yield None
        return

    def show(share: float, stage: str) -> None:
        full = round(share * _BAR)
        bar = "#" * full + "-" * (_BAR - full)
        sys.stderr.write(f"\r\033[K{name} [{bar}] {share:4.0%} {stage}")
        sys.stderr.flush()

    try:
        yield show
    finally:
        sys.stderr.write("\r\033[K")
        sys.stderr.flush()


@contextmanager
def progress_lines(name: str) -> Iterator[Progress]:
    """Lines of JSON on stdout while the block runs, for a program that shows how far we are."""
    last = 0.0

    def show(share: float, stage: str) -> None:
        nonlocal last
        if share == 1.0 or time.monotonic() > last + _LINE_PAUSE:
            last = time.monotonic()
            print(json.dumps({"progress": share, "text": stage or name}), flush=True)

    yield show


def part_of(bar: Bar, start: float, end: float) -> Bar:
    """A bar whose shares from 0 to 1 are those from `start` to `end` of `bar`."""

    @contextmanager
    def part(name: str) -> Iterator[Progress | None]:
        with bar(name) as progress:
            yield progress and (lambda share, stage: progress(start + share * (end - start), stage))

    return part


class _FitOption(argparse.Action):
    """Stores a value, or the constant of a flag, and that it was given: a record needs no fit."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        setattr(namespace, self.dest, self.const if self.nargs == 0 else values)
        namespace.given_for_fits = [*namespace.given_for_fits, option_string]


class _Parser(argparse.ArgumentParser):
    """Says in one sentence what is wrong with a command line, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see {self.prog} --help.")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="lobefit", description="Measured materials as Cycles node groups.")
    parser.add_argument("--version", action="version", version=f"lobefit {_native.version}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for add in (
        _add_sample,
        _add_info,
        _add_fit,
        _add_closures,
        _add_preview,
        _add_render,
        _add_material,
        _add_library,
        _add_export,
        _add_simplify,
        _add_energy,
        _add_match_exponent,
        _add_normals,
        _add_report,
        _add_diagnose,
    ):
        add(commands)
    return parser


def _add(commands: Any, run: Callable[[argparse.Namespace], int], text: str) -> Any:
    """A command named as the function that runs it."""
    name = run.__name__.removeprefix("_").replace("_", "-")
    command = commands.add_parser(name, help=text, description=f"{text[0].upper()}{text[1:]}.")
    command.set_defaults(run=run)
    return command


def _add_json(command: argparse.ArgumentParser) -> None:
    command.add_argument("--json", action="store_true", help="print one line of JSON a result")


def _add_sample(commands: Any) -> None:
    command = _add(commands, _sample, "write sample measurements made from published figures")
    command.add_argument("folder", metavar="DIR", help="also of samples.csv, which names them")
    command.add_argument("names", metavar="NAME", nargs="*", help="all when none is given")
    _add_json(command)


def _add_info(commands: Any) -> None:
    command = _add(commands, _info, "say what measured files or records hold")
    command.add_argument("files", metavar="FILE|RECORD.json", nargs="+")
    _add_json(command)


def _add_fit(commands: Any) -> None:
    command = _add(commands, _fit, "fit a model to measured files")
    command.add_argument(
        "files",
        metavar="FILE",
        nargs="+",
        help="measured files, or folders: all *.binary and *.bsdf in them, not below",
    )
    _add_fit_options(command, model="interpolated", norm="l1")
    _add_record_output(command)


def _add_closures(commands: Any) -> None:
    command = _add(commands, _closures, "find the few Cycles closures that come nearest")
    command.add_argument(
        "files",
        metavar="FILE|RECORD.json",
        nargs="+",
        help="or folders: all *.binary, *.bsdf and *.json in them, not below",
    )
    command.add_argument("--target", choices=TARGETS, default="measured", help=_DEFAULT)
    _add_closure_options(command)
    _add_fit_options(command, model="interpolated", norm=VISUAL_NORM)
    _add_record_output(command)


def _add_record_output(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "-o", dest="output", required=True, help="RECORD.json, or a folder for several files"
    )
    command.add_argument(
        "--uncertainty",
        action=_FitOption,
        nargs=0,
        const=True,
        help="also how well the data determine the parameters (up to 3 more times as long)",
    )
    _add_batch_options(command)


def _add_batch_options(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--again",
        action="store_true",
        help="also what is there already, of the same settings",
    )
    where = command.add_mutually_exclusive_group()
    where.add_argument(
        "--jobs",
        type=_within(int, 1, 1024, "a number"),
        default=1,
        metavar="N",
        help="files at once, each in a process with its share of the processors; " + _DEFAULT,
    )
    where.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of a Dask cluster to compute on, as tcp://HOST:8786; its workers have the same build "
        "of Lobefit and read the files by the same paths",
    )
    _add_json(command)


def _add_closure_options(command: argparse.ArgumentParser, tolerance: bool = True) -> None:
    command.set_defaults(tolerance=None)
    group = command.add_argument_group("closures")
    number = group.add_mutually_exclusive_group()
    number.add_argument(
        "--closures",
        type=_within(int, 0, MOST_CLOSURES, "a number"),
        default=2,
        metavar="N",
        help="specular closures besides the diffuse one; " + _DEFAULT,
    )
    if tolerance:
        number.add_argument(
            "--tolerance",
            type=_within(float, 0, 1, "a part of the light"),
            metavar="E",
            help="take as few as keep the error of spheres to this part of the light, 0.05 is 5 %%",
        )
    group.add_argument(
        "--cap-albedo", action="store_true", help="keep the albedo at 1 where a measurement is over"
    )


def _add_fit_options(command: argparse.ArgumentParser, model: str, norm: str) -> None:
    command.set_defaults(uncertainty=False, given_for_fits=[])
    group = command.add_argument_group("fit of a measured file")
    add = partial(group.add_argument, action=_FitOption)
    add("--model", choices=(*MODELS, "all"), default=model, help=_DEFAULT)
    add(
        "--no-fresnel",
        dest="fresnel",
        nargs=0,
        const=False,
        default=True,
        help="leave out the Fresnel factor of the specular part",
    )
    add(
        "--schedule",
        choices=SCHEDULES,
        default="polish",
        help="polish: all parameters from many starts, at last on all bins; subsample: without "
        "that end; joint: on all bins from one start; stages: from there the paper's three; "
        + _DEFAULT,
    )
    add(
        "--norm",
        choices=NORMS,
        default=norm,
        help="of the misfit: l1 is the paper's, cosine-l1 weighs by both cosines as pictures do, "
        "l2, and log-l2 of the logarithms; " + _DEFAULT,
    )
    add(
        "--max-angle",
        type=_within(float, 1, 90, "degrees"),
        default=90.0,
        metavar="DEG",
        help="leave out light and views beyond, 1 to 90; " + _DEFAULT,
    )
    add(
        "--channels",
        choices=("shared", "separate"),
        default="shared",
        help="one exponent for red, green and blue, or one each; " + _DEFAULT,
    )
    group.add_argument(
        "--threads",
        type=_within(int, 0, 1024, "a number"),
        default=0,
        metavar="N",
        help="0: every processor, or a job's share of them; on a cluster one",
    )


_DEFAULT = "default: %(default)s"


def _add_preview(commands: Any) -> None:
    command = _add(commands, _preview, "draw measurement and fits as spheres under two lights")
    command.add_argument("files", metavar="FILE|RECORD.json", nargs="+")
    _add_fit_options(command, model="all", norm=VISUAL_NORM)
    command.add_argument(
        "--size",
        type=_within(int, 16, 2048, "pixels"),
        default=preview.SPHERE,
        help="pixels a sphere; " + _DEFAULT,
    )
    command.add_argument(
        "--classic",
        action="store_true",
        help="also as classic Phong and Blinn-Phong, which old renderers and games have, show it",
    )
    command.add_argument("-o", dest="output", required=True, metavar="PICTURE.png")


def _add_render(commands: Any) -> None:
    command = _add(
        commands, _render, "render the measured materials of a Blender file as spheres (needs bpy)"
    )
    command.add_argument("file", metavar="FILE.blend")
    command.add_argument(
        "--size",
        type=_within(int, 16, 4096, "pixels"),
        default=512,
        help="pixels a sphere; " + _DEFAULT,
    )
    command.add_argument(
        "--linear",
        action="store_true",
        help="NAME.npy, the radiance as float32 (rows, columns, 3), in the place of NAME.png",
    )
    command.add_argument("-o", dest="output", required=True, metavar="DIR")
    _add_json(command)


def _add_material(commands: Any) -> None:
    command = _add(commands, _material, "make a Blender file with the material (needs bpy)")
    command.add_argument("file", metavar="FILE|RECORD.json")
    command.add_argument("--kind", choices=blender.KINDS, default="measured", help=_DEFAULT)
    _add_closure_options(command)
    _add_fit_options(command, model="interpolated", norm=VISUAL_NORM)
    command.add_argument("-o", dest="output", required=True, metavar="OUT.blend")


def _add_library(commands: Any) -> None:
    command = _add(
        commands, _library, "make an asset library of measured files or records (needs bpy)"
    )
    command.add_argument(
        "files",
        metavar="DIR|FILE|RECORD.json",
        nargs="+",
        help="of a folder all in and below it; materials.csv beside the files tells their name, "
        "catalogue, tags, author, licence and source",
    )
    # `auto` judges by a tolerance, and a record does not tell whether it was made for the same.
    kinds = [kind for kind in blender.KINDS if kind != "auto"]
    command.add_argument("--kind", choices=kinds, default="measured", help=_DEFAULT)
    _add_closure_options(command, tolerance=False)
    _add_fit_options(command, model="interpolated", norm=VISUAL_NORM)
    command.add_argument(
        "-o",
        dest="output",
        required=True,
        metavar="OUT.blend",
        help="its records stay in OUT.records beside it, so that it goes on where it stopped",
    )
    _add_batch_options(command)


def _add_export(commands: Any) -> None:
    command = _add(
        commands, _export, "write what the measured materials of a Blender file hold (needs bpy)"
    )
    command.add_argument("file", metavar="FILE.blend")
    group = command.add_argument_group("what to write; without any of them, all")
    for kind, text in export.KINDS.items():
        group.add_argument(f"--{kind}", dest="kinds", action="append_const", const=kind, help=text)
    command.add_argument("-o", dest="output", required=True, metavar="DIR")
    _add_json(command)


def _add_simplify(commands: Any) -> None:
    command = _add(
        commands,
        _simplify,
        "leave out of materials what the scene of a file does not need (needs bpy)",
    )
    command.add_argument("file", metavar="FILE.blend")
    command.add_argument(
        "--tolerance",
        type=_within(float, 0, 100, "a percentage"),
        default=1.0,
        metavar="PERCENT",
        help="of the picture's light that may change on any sampled frame; " + _DEFAULT,
    )
    command.add_argument(
        "--frames",
        type=_within(int, 1, 10000, "a number"),
        default=8,
        metavar="N",
        help="how many to look at, evenly spread; " + _DEFAULT,
    )
    command.add_argument(
        "--diffuse-bounces",
        action="store_true",
        help="show only a diffuse closure to light that bounced off a diffuse surface",
    )
    command.add_argument(
        "--time", action="store_true", help="render the current frame before and after"
    )
    command.add_argument(
        "--restore", action="store_true", help="put back what was shown before, and nothing else"
    )
    command.add_argument(
        "-o", dest="output", metavar="OUT.blend", help="without it nothing is written"
    )
    _add_json(command)


def _add_energy(commands: Any) -> None:
    command = _add(commands, _energy, "tell how much a Phong lobe reflects, which normalises it")
    command.add_argument("--model", choices=LOBES, required=True)
    command.add_argument(
        "--exponent",
        type=_within(float, 0, MOST_EXPONENT, "an exponent"),
        nargs="+",
        required=True,
        metavar="N",
        help=f"of the lobe, at most {MOST_EXPONENT:g}; several are told one after another",
    )
    command.add_argument(
        "--angle",
        type=_within(float, 0, 90, "degrees"),
        required=True,
        metavar="DEG",
        help="between the normal and the viewer",
    )
    _add_json(command)


def _add_match_exponent(commands: Any) -> None:
    command = _add(
        commands, _match_exponent, "find Blinn-Phong's exponent that comes nearest to Phong's"
    )
    command.add_argument(
        "--exponent",
        type=_within(float, LEAST_EXPONENT, MOST_EXPONENT_TO_MATCH, "an exponent"),
        nargs="+",
        required=True,
        metavar="N",
        help="of classic Phong's (R.V)^N; several make a table",
    )
    command.add_argument(
        "--angle",
        type=_within(float, 0, 90, "degrees"),
        metavar="DEG",
        help="between the normal and the viewer; without it, over spheres lit from everywhere",
    )
    _add_json(command)


def _add_normals(commands: Any) -> None:
    command = _add(commands, _normals, "find normals and heights from shading under known lights")
    command.add_argument(
        "images",
        metavar="IMAGE",
        nargs="+",
        help="pictures of the same points; one or two are enough where a silhouette shows",
    )
    command.add_argument(
        "--lights", required=True, metavar="LIGHTS.json", help="what lit each of them; see README"
    )
    material = command.add_mutually_exclusive_group(required=True)
    material.add_argument(
        "--material",
        metavar="FILE|RECORD.json",
        help="what is shown: a measurement, or what --kind tells of a record",
    )
    material.add_argument(
        "--classic",
        choices=("phong", "blinn-phong"),
        help="what is shown: the classic model with --diffuse, --specular and --exponent",
    )
    command.add_argument(
        "--kind",
        choices=normals.KINDS,
        help="the fitted model, or what Cycles renders of this kind of material; for photographs "
        "the measured file itself is nearest; default: model",
    )
    for name, text in {"diffuse": "k_d", "specular": "k_s"}.items():
        command.add_argument(
            f"--{name}",
            type=_within(float, 0, 1e6, "a number"),
            nargs=3,
            metavar=("R", "G", "B"),
            help=f"{text} of the classic model",
        )
    command.add_argument(
        "--exponent", type=_within(float, 0, 1e8, "an exponent"), metavar="N", help="of the same"
    )
    command.add_argument(
        "--mask",
        metavar="IMAGE",
        help="bright where the surface is; default: alpha, or else what is not black",
    )
    command.add_argument(
        "--linear", action="store_true", help="take files of whole numbers for linear, not for sRGB"
    )
    command.add_argument(
        "--noise",
        type=_within(float, 0, 1e6, "a value"),
        metavar="SIGMA",
        help="standard deviation of a pixel in linear light; default: told by the pictures",
    )
    command.add_argument(
        "--saturation",
        type=_within(float, 1e-6, 1e30, "a value"),
        metavar="VALUE",
        help="pixels of this linear value and more were cut off; default: full scale",
    )
    command.add_argument(
        "--threads",
        type=_within(int, 0, 1024, "a number"),
        default=0,
        metavar="N",
        help="0: every processor",
    )
    command.add_argument(
        "--height", metavar="FILE.png|FILE.exr", help="also the heights, for a Displacement node"
    )
    command.add_argument("-o", dest="output", required=True, metavar="NORMAL.png|NORMAL.exr")
    _add_json(command)


def _add_report(commands: Any) -> None:
    command = _add(commands, _report, "write a page of pictures, errors and run times")
    command.add_argument("files", metavar="FILE|RECORD.json|DIR", nargs="+")
    _add_fit_options(command, model="all", norm=VISUAL_NORM)
    command.set_defaults(uncertainty=True)
    command.add_argument("-o", dest="output", required=True, metavar="DIR")


def _add_diagnose(commands: Any) -> None:
    _add_json(_add(commands, _diagnose, "tell versions, machine and a self-test, for a report"))


def _within(kind: type, low: float, high: float, what: str) -> Callable[[str], Any]:
    """A reader of numbers from low to high for argparse."""

    def read_number(text: str) -> Any:
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"expected {what} from {low} to {high}, found {text!r}"
            )
        return value

    return read_number


def _sample(options: argparse.Namespace) -> int:
    known = _native.sample_names()
    for name in options.names:
        if name not in known:
            raise InputError(f"{name}: expected one of {', '.join(known)}.")
    for path in write_samples(options.folder, options.names or known):
        result = {"path": str(path), "name": origin_of(path).name}
        print(json.dumps(result) if options.json else f"{path}: {result['name']}")
    return DONE


def _info(options: argparse.Namespace) -> int:
    def tell(path: Path) -> None:
        if path.suffix.lower() == RECORD_SUFFIX:
            _tell_of_record(Record.load(path), path, options.json)
            return
        measurement = read(path)
        bins, origin, size = dict(measurement.bins), origin_of(path), path.stat().st_size
        warnings = measurement.warnings + _bin_warnings(bins)
        if options.json:
            facts = origin.entries() | {"format": measurement.format, "bytes": size}
            print(json.dumps(facts | {"bins": bins, "warnings": warnings}))
            return
        named = f", {origin.name}" if origin.name else ""
        print(f"{path}: {measurement.format}{named}, {size:,} bytes, ", end="")
        print(f"{bins['valid']:,} valid bins")
        print(f"  rejected: {bins['below_horizon']:,} below the horizon, ", end="")
        print(f"{bins['negative']:,} negative, {bins['non_finite']:,} not finite")
        for warning in warnings:
            print(f"  warning: {warning}")

    return for_each(map(Path, options.files), tell)


def _tell_of_record(record: Record, path: Path, as_json: bool) -> None:
    if as_json:
        print(json.dumps(json.loads(record.to_json())))
        return
    print(f"{path}: {record.name}, norm {record.norm}, schedule {record.schedule}")
    for model, fit in record.fits.items():
        print(f" {preview.TITLES[model]}{'' if fit.converged else ', not converged'}")
        for line in _fit_lines(fit):
            print(f"   {line}")
    for entry in record.closures:
        print(f" closures: {entry['target']}, {entry['count']}, sphere error {entry['error']:.4f}")
        if more := _excess(entry):
            print(f"   {more}")


def _fit_lines(fit: Fit) -> Iterator[str]:
    """What a fit found out, a line each."""
    for name in ("diffuse", "specular", "exponent", "interpolation", "ior"):
        if fit.parameters[name] is None:
            continue
        yield f"{name:14} {_numbers(fit.parameters[name])}"
        for variable, (low, high) in fit.intervals.items():
            if variable.split()[0] == name:
                mark = "  undetermined" if variable in fit.uncertainty["undetermined"] else ""
                yield f"  {variable:14} {low:.4g} to {high:.4g}{mark}"
    for name, figure in fit.error.items():
        yield f"{name:20} {_numbers(figure['pooled'])}  (rgb {_numbers(figure['rgb'])})"
    if fit.error_by_angle:
        view = fit.error_by_angle["view"]
        steps = zip(pairwise(view["view_angle"]), view["misfit"], view["measured"], strict=True)
        for (low, high), misfit, measured in list(steps)[::3]:
            error = misfit / measured if measured > 0 else None
            yield f"view at {low:2g} to {high:2g} deg  relative error {_numbers(error)}"
    albedos = (fit.albedo[name] for name in ("view_angle", "measured", "model"))
    for angle, measured, model in zip(*albedos, strict=True):
        yield f"albedo at {angle:2g} deg  measured {_numbers(measured)}, model {_numbers(model)}"
    for warning in fit.warnings:
        yield f"warning: {warning}"


def _numbers(values: Any) -> str:
    if isinstance(values, list):
        return " ".join(map(_numbers, values))
    return "unknown" if values is None else f"{values:.4g}"


def _bin_warnings(bins: dict[str, int]) -> list[str]:
    """What a user should know of bins that are damaged and not merely below the horizon."""
    above = sum(bins.values()) - bins["below_horizon"]
    kinds = {"negative": "have a negative channel", "non_finite": "have a channel without a number"}
    return [
        f"{bins[kind] / above:.1%} of the bins above the horizon {what}"
        for kind, what in kinds.items()
        if bins[kind]
    ]


def _fit(options: argparse.Namespace) -> int:
    return _write_records(options, MEASUREMENT_SUFFIXES, [], _print_fit)


def _closures(options: argparse.Namespace) -> int:
    request = Closures(options.target, options.closures, options.tolerance, options.cap_albedo)
    suffixes = (*MEASUREMENT_SUFFIXES, RECORD_SUFFIX)
    return _write_records(options, suffixes, [request], partial(_print_closures, request))


def _write_records(
    options: argparse.Namespace,
    suffixes: tuple[str, ...],
    closures: list[Closures],
    tell: Callable[[Record, Path], None],
) -> int:
    """Writes the record of every file of a command line, and tells of it."""
    output, fitted = Path(options.output), _fit_options(options)
    one = len(options.files) == 1 and not Path(options.files[0]).is_dir()
    if one:
        _need_suffix(output, RECORD_SUFFIX)
    paths = spread(options.files, suffixes)
    _refuse_idle_options(options, paths)
    if one:
        tasks = [Task(paths[0], output, closures, fitted)]
    else:
        tasks = tasks_in(output, paths, closures, fitted)
        make_folder(output)

    def show(task: Task, record: Record) -> None:
        if options.json:
            print(json.dumps({"record": str(task.place)} | json.loads(record.to_json())))
        else:
            tell(record, task.place)

    # A folder that was interrupted goes on where it stopped.
    return _run(options, tasks, not one and not options.again, show, progress_bar)


def _run(
    options: argparse.Namespace,
    tasks: Sequence[Task],
    keep: bool,
    show: Callable[[Task, Record], None],
    bar: Bar,
) -> int:
    """Computes the record of every task, shows those that end well, and tells of the others."""
    way = on_cluster(options.scheduler) if options.scheduler else in_processes(options.jobs)

    def show_ended(ended: Ended) -> None:
        task, record = ended
        if isinstance(record, InputError):
            raise record
        show(task, record)

    batch = Batch(tasks, way, keep=keep, bar=bar)
    with closing(batch.run()) as ended:
        code = for_each(ended, show_ended)
    if batch.kept and not options.json:
        kept = f"{batch.kept} of {len(tasks)} kept from before (--again computes them anew)"
        print(f"lobefit: {kept}", file=sys.stderr)
    return code


def _fit_options(options: argparse.Namespace) -> dict[str, Any]:
    names = ("model", "fresnel", "schedule", "norm", "max_angle", "channels", "threads")
    return {name: getattr(options, name) for name in (*names, "uncertainty")}


def _need_suffix(place: Path, suffix: str) -> None:
    """Raises InputError for another file name: that file would be written over."""
    if place.suffix.lower() != suffix and not place.is_dir():
        raise InputError(f"{place}: expected a name that ends in {suffix}.")


def _refuse_idle_options(options: argparse.Namespace, paths: Sequence[Path]) -> None:
    """Raises InputError for options of a fit where every file is a record, which has its fit."""
    if options.given_for_fits and all(path.suffix.lower() == RECORD_SUFFIX for path in paths):
        option = options.given_for_fits[0]
        raise InputError(
            f"{paths[0]}: expected a measured file to fit with {option}, found a record, which "
            "keeps its fit."
        )


def _record(path: Path, options: argparse.Namespace, closures: Sequence[Closures] = ()) -> Record:
    with progress_bar(path.name) as progress:
        return record_of(path, progress, closures=closures, **_fit_options(options))


def _print_closures(asked: Closures, record: Record, place: Path) -> None:
    print(f"{place}: {record.name}")
    for entry in record.closures:
        names = ", ".join(lobe["distribution"] for lobe in entry["specular"]) or "diffuse alone"
        print(
            f"   {entry['target']}, {entry['count']} specular ({names}): sphere error "
            f"{entry['error']:.4f}, {entry['seconds']:.2f} s"
        )
        if more := _excess(entry):
            print(f"     {more}")
    print(f"   principled: sphere error {record.principled['error']:.4f}")
    least = min(e["error"] for e in record.closures if e["target"] == asked.target)
    if asked.tolerance is not None and least > asked.tolerance:
        print(f"   none of {asked.target} keeps to {asked.tolerance:g}")


def _excess(entry: Mapping[str, Any]) -> str:
    table = entry["by_view"]
    return excess(table["view_angle"], table["target_albedo"], table["closures_albedo"])


def _print_fit(record: Record, place: Path) -> None:
    print(f"{place}: {record.name}")
    for model, fit in record.fits.items():
        error = fit.error[record.leading_figure]["pooled"]
        figure = preview.FIGURES[record.leading_figure]
        mark = "*" if record.models and model == record.model else " "
        print(f" {mark} {model:20} {figure} {error:.4f}, {fit.seconds['total']:.2f} s")
        if fit.uncertainty and fit.uncertainty["undetermined"]:
            print(f"   undetermined: {', '.join(fit.uncertainty['undetermined'])}")
    for warning in record.warnings:
        print(f"   warning: {warning}")


def _records(options: argparse.Namespace, records: list[Record]) -> int:
    """Collects in `records` what the files of a command line stand for."""
    paths = spread(options.files, (RECORD_SUFFIX,))
    _refuse_idle_options(options, paths)
    return for_each(paths, lambda path: records.append(_record(path, options)))


def _preview(options: argparse.Namespace) -> int:
    if place_to_write(options.output).suffix.lower() not in ("", ".png"):
        raise InputError(f"{options.output}: expected a name that ends in .png.")
    records: list[Record] = []
    code = _records(options, records)
    if records:
        size = options.size
        rows = [
            preview.row(record, preview.measurement_of(record), size, classic=options.classic)
            for record in records
        ]
        picture.write_png(options.output, preview.sheet(rows, size))
        print(options.output)
    return code


def _render(options: argparse.Namespace) -> int:
    blender.need_blender()
    bar = progress_lines if options.json else progress_bar
    with bar(Path(options.file).name) as progress:
        pixels = blender.render_materials(options.file, options.size, progress)
    if not pixels:
        raise InputError(f"{options.file}: expected a measured material, found none.")
    for name, stem in export.places_in(make_folder(options.output), pixels):
        path = stem.with_suffix(".npy" if options.linear else ".png")
        if options.linear:
            data = io.BytesIO()
            np.save(data, pixels[name])
            write_bytes(path, data.getvalue())
        else:
            # A white diffuse surface that faces one of the lights is white.
            picture.write_png(path, picture.encode(picture.expose(pixels[name], 1 / math.pi)))
        result = {"material": name, "picture": str(path)}
        print(json.dumps(result) if options.json else path)
    return DONE


def _material(options: argparse.Namespace) -> int:
    blender.need_blender()
    _refuse_idle_options(options, [Path(options.file)])
    if options.tolerance is not None and options.kind != "auto":
        raise InputError(f"--tolerance: expected the kind auto, found {options.kind}.")
    _need_suffix(place_to_write(options.output), ".blend")
    tolerance = TOLERANCE if options.tolerance is None else options.tolerance
    requests = closures_for(options.kind, options.closures, tolerance, options.cap_albedo)
    record = _record(Path(options.file), options, requests)
    count = options.closures if options.kind in TARGETS else None
    shown = blender.write_blend(options.output, record, options.kind, count, tolerance)
    print(f"{options.output}: {record.name}, {shown.what}, {shown.off}")
    if options.kind == "auto" and shown.error > tolerance:
        print(f"   none keeps to {tolerance:g}: this is the nearest")
    return DONE


def _library(options: argparse.Namespace) -> int:
    blender.need_blender()
    _need_suffix(place_to_write(options.output), ".blend")
    items = items_of(options.files, records_folder(options.output))
    _refuse_idle_options(options, [item.file for item in items])
    requests = closures_for(options.kind, options.closures, cap_albedo=options.cap_albedo)
    count = options.closures if options.kind in TARGETS else None
    places = [(item.file, item.place) for item in items]
    tasks = tasks_at(places, requests, _fit_options(options))
    for task in tasks:
        make_folder(task.place.parent)
    records: dict[Path, Record] = {}

    def show(task: Task, record: Record) -> None:
        records[task.place] = record
        shown = blender.shown(record, options.kind, count)
        if options.json:
            told = {"file": str(task.source), "name": record.name}
            print(json.dumps(told | {"shown": shown.what, "error": shown.error}), flush=True)
        else:
            print(f"{task.source}: {record.name}, {shown.what}, {shown.off}")

    bar = progress_lines if options.json else progress_bar
    try:
        code = _run(options, tasks, not options.again, show, part_of(bar, 0.0, 1 - _WRITING))
    finally:
        remove_empty(records_folder(options.output))
    contents = [(records[item.place], item.asset) for item in items if item.place in records]
    if contents:
        with part_of(bar, 1 - _WRITING, 1.0)(Path(options.output).name) as progress:
            result = blender.write_library(options.output, contents, options.kind, count, progress)
        _tell_of_library(options.output, result, options.json)
    return code


def _tell_of_library(path: str, result: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print(json.dumps({"library": path} | result), flush=True)
        return
    told = f"{result['materials']} materials in {', '.join(result['catalogues'])}"
    print(f"{path}: {told}; opens in Blender {result['opens_in']} and later")


def _export(options: argparse.Namespace) -> int:
    blender.need_blender()
    texts = blender.records_in(options.file)
    if not texts:
        raise InputError(f"{options.file}: expected a measured material, found none.")
    folder, kinds = make_folder(options.output), options.kinds or export.KINDS
    records: dict[str, Record] = {}

    def tell(path: Path) -> None:
        print(json.dumps({"path": str(path)}) if options.json else path)

    def write(named: tuple[str, Path]) -> None:
        name, stem = named
        record = records[name] = Record.from_json(texts[name], f"{options.file}, {name}")
        for path in export.write_material(record, name, stem, kinds):
            tell(path)

    code = for_each(export.places_in(folder, texts), write)
    if records and "csv" in kinds:
        write_bytes(folder / export.TABLE, export.table(records).encode())
        tell(folder / export.TABLE)
    return blender.leave_after_gltf(code) if "gltf" in kinds else code


def _simplify(options: argparse.Namespace) -> int:
    blender.need_blender()
    if options.output is not None:
        place_to_write(options.output)
    if options.restore:
        result = blender.restore(options.file, options.output)
        lines = simplified.restored_lines(result)
    else:
        with progress_bar(Path(options.file).name) as progress:
            result = blender.simplify(
                options.file,
                options.output,
                options.tolerance / 100,
                options.frames,
                options.diffuse_bounces,
                options.time,
                progress,
            )
        lines = simplified.lines(result)
        if options.time and result["seconds"]["after"] is None:
            _complain("rendering is timed in Cycles only, found a scene of another renderer.")
    if options.output is None:
        lines.append("nothing is written without -o OUT.blend")
    print(json.dumps(result) if options.json else "\n".join(lines))
    return DONE


def _energy(options: argparse.Namespace) -> int:
    for exponent in options.exponent:
        found = energy(options.model, exponent, options.angle)
        figures = {
            "exponent": exponent,
            "energy-conserving factor": found.conserving,
            "energy-normalised factor": found.normalising,
            "by exponent": found.by_exponent,
            "by angle": found.by_angle,
            "integral": found.integral,
        }
        if options.json:
            keys = (name.replace(" ", "_").replace("-", "_") for name in figures)
            print(json.dumps(dict(zip(keys, figures.values(), strict=True))))
        else:
            for name, value in figures.items():
                print(f"{name:24} {value:.17g}")
    return DONE


def _match_exponent(options: argparse.Namespace) -> int:
    if not options.json:
        print(f"{'exponent':>10}{'matched':>12}{'times':>9}{'error':>9}{'error of 4 times':>18}")
    for exponent in options.exponent:
        match = match_exponent(exponent, options.angle)
        if options.json:
            print(json.dumps({"phong_exponent": exponent, **vars(match)}))
        else:
            print(
                f"{exponent:10g}{match.exponent:12.6g}{match.exponent / exponent:9.3f}"
                f"{match.error:9.4f}{match.error_of_four:18.4f}"
            )
    return DONE


def _normals(options: argparse.Namespace) -> int:
    images.need_library()
    places = [options.output, *([options.height] if options.height else [])]
    for place in places:
        images.place_for(place)
    names = [Path(path).name for path in options.images]
    pictures = normals.read_pictures(options.images, options.mask, options.linear)
    lighting = in_order(read_lights(options.lights), names, options.lights)
    source = _shown_material(options)
    if options.saturation:
        pictures = dataclasses.replace(pictures, saturation=options.saturation)
    began = time.perf_counter()
    with progress_bar(names[0]) as progress:
        surface = normals.normals(
            pictures.values,
            lighting,
            source,
            progress,
            mask=pictures.mask,
            saturation=pictures.saturation,
            noise=options.noise,
            threads=options.threads,
        )
    seconds = time.perf_counter() - began
    shown = normals.shade(surface.normals, lighting, source)
    off = normals.unexplained(pictures, shown)
    images.write_image(options.output, normals.as_normal_map(surface.normals))
    result = {
        "normals": options.output,
        "pictures": len(names),
        "pixels": int(pictures.mask.sum()),
        "unexplained": off,
        "seconds": seconds,
    }
    if options.height:
        exact = options.height.lower().endswith(".exr")
        heights, scale = normals.as_displacement(surface.heights)
        images.write_image(options.height, heights * scale if exact else heights)
        result |= {"height": options.height, "scale": 1.0 if exact else scale}
    if options.json:
        print(json.dumps(result))
        return DONE
    count = f"{len(names)} picture{'s' if len(names) > 1 else ''}"
    print(
        f"{options.output}: {result['pixels']:,} pixels, {count}, {off:.1%} of their light is not "
        f"explained, {seconds:.1f} s"
    )
    if options.height:
        print(
            f"{options.height}: in a Displacement node with Midlevel 0 and Scale "
            f"{result['scale']:.4g} times the width that the picture has"
        )
    return DONE


def _shown_material(options: argparse.Namespace) -> Any:
    """The reflectance that a command line tells of, as `normals.Job` takes it."""
    classic = {name: getattr(options, name) for name in ("diffuse", "specular", "exponent")}
    given = [f"--{name}" for name, value in classic.items() if value is not None]
    if options.classic:
        missing = [f"--{name}" for name, value in classic.items() if value is None]
        if missing or options.kind:
            wrong = f"found no {missing[0]}" if missing else "found --kind, which is of records"
            raise InputError(f"expected the parameters of the classic model, {wrong}.")
        return "classic", {"model": f"classic-{options.classic}", **classic}
    if given:
        raise InputError(f"expected {given[0]} with --classic, found it with --material.")
    path = Path(options.material)
    if path.suffix.lower() == RECORD_SUFFIX:
        return normals.reflectance_of(Record.load(path), options.kind or "model")
    if options.kind:
        raise InputError(f"{path}: expected a record for --kind, found another file.")
    return read(path)


def _report(options: argparse.Namespace) -> int:
    records: list[Record] = []
    code = _records(options, records)
    if records:
        ways = {}
        if blender.has_blender():
            records = [_with_closures(record) for record in records]
            ways = {record.name: pictures.measure(record) for record in records}
        trials = {record.name: _trials(record, options.threads) for record in records}
        with progress_bar("report") as progress:
            report.write(
                options.output,
                records,
                ways=ways,
                trials=trials,
                terms=alterations.measure(),
                progress=progress,
            )
        print(Path(options.output) / "index.html")
    return code


def _diagnose(options: argparse.Namespace) -> int:
    diagnosis = diagnose()
    print(json.dumps(diagnosis.entries()) if options.json else diagnosis)
    return DONE if diagnosis.passed else SOME_FAILED


def _trials(record: Record, threads: int) -> list[methods.Trial]:
    measurement = preview.measurement_of(record)
    if measurement is None:
        return []
    with progress_bar(record.name) as progress:
        return methods.compare(measurement, progress, threads)


def _with_closures(record: Record) -> Record:
    with progress_bar(record.name) as progress:
        return pictures.with_closures(record, progress)
