"""`python -m lobefit.demo [FILE..] [-o DIR]`: from measured files to rendered Blender materials.

Without files it makes four samples from published figures. Every material is fitted, built,
rendered with Cycles and reported; one that fails is named and the others go on (exit code 1).
"""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from lobefit import blender, methods, picture, pictures, preview, report
from lobefit._native import Cancelled, InputError
from lobefit.atomic import make_folder
from lobefit.command_line import DONE, INTERRUPTED, SOME_FAILED, WRONG, progress_bar
from lobefit.fitting import Closures, read
from lobefit.inputs import MEASUREMENT_SUFFIXES, record_of, spread
from lobefit.library import Asset
from lobefit.origin import write_samples
from lobefit.record import VISUAL_NORM, Record, figure_of

KIND = "measured"
SAMPLES = ["nickel", "two-layer-silver", "violet-rubber", "red-fabric2"]


@dataclass
class _Demo:
    """What is made in `folder`, and what went wrong."""

    folder: Path
    has_blender: bool = False
    records: list[Record] = field(default_factory=list)
    rows: list[preview.Row] = field(default_factory=list)
    renderings: dict[str, report.Rendering] = field(default_factory=dict)
    ways: dict[str, list[pictures.Picture]] = field(default_factory=dict)
    trials: dict[str, list[methods.Trial]] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)

    def add(self, path: Path) -> None:
        """One material, from its file to its picture."""
        with progress_bar(path.name) as progress:
            fitted = {"model": "all", "norm": VISUAL_NORM, "uncertainty": True}
            record = record_of(path, progress, closures=[Closures()], **fitted)
            if self.has_blender:
                record = pictures.with_closures(record, progress)
            measurement = read(path)
            self.trials[record.name] = methods.compare(measurement, progress)
        record.save(make_folder(self.folder / "records") / f"{path.stem}.json")
        self.records.append(record)
        if self.has_blender:
            self.attempt(path.name, partial(self.build, record, path.stem))
        rendering = self.renderings.get(record.name)
        pixels = rendering.pixels if rendering else None
        self.rows.append(preview.row(record, measurement, rendered=pixels))

    def build(self, record: Record, name: str) -> None:
        """The Blender file of a record, the picture that Cycles makes of it, and what it costs."""
        blender.write_blend(make_folder(self.folder / "blend") / f"{name}.blend", record, KIND)
        start = time.perf_counter()
        pixels = blender.render(record, preview.SPHERE * preview.FINER, KIND)
        self.renderings[record.name] = report.Rendering(pixels, time.perf_counter() - start)
        self.ways[record.name] = pictures.measure(record)
        shown = picture.encode(picture.expose(pixels, picture.white_point(pixels)))
        picture.write_png(make_folder(self.folder / "pictures") / f"{name}.png", shown)

    def finish(self) -> None:
        """What is made of all materials together."""
        picture.write_png(self.folder / "materials.png", preview.sheet(self.rows))
        report.write(
            self.folder, self.records, self.renderings, self.failures, self.ways, self.trials
        )
        built = [record for record in self.records if record.name in self.renderings]
        if built:
            contents = [(record, Asset()) for record in built]
            blender.write_library(self.folder / "materials.blend", contents, KIND)

    def attempt(self, what: str, work: Callable[[], None]) -> bool:
        """Does the work and says whether it succeeded; a failure is named and remembered."""
        try:
            work()
            return True
        except (InputError, RuntimeError) as error:
            self.failures.append(f"{what}: {error}")
            print(f"lobefit: {self.failures[-1]}", file=sys.stderr)
            return False


def main(arguments: list[str] | None = None) -> int:
    """Runs the demonstration and returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="lobefit.demo", description="From measured files to rendered Blender materials."
    )
    parser.add_argument("files", metavar="FILE", nargs="*", help="samples when none is given")
    parser.add_argument("-o", dest="output", metavar="DIR", default="demo", help="%(default)s")
    options = parser.parse_args(arguments)
    try:
        return _run(options.files, Path(options.output))
    except InputError as error:
        print(f"lobefit: {error}", file=sys.stderr)
        return WRONG
    except (KeyboardInterrupt, Cancelled):
        print("lobefit: interrupted", file=sys.stderr)
        return INTERRUPTED


def _run(files: list[str], folder: Path) -> int:
    demo = _Demo(make_folder(folder))
    demo.has_blender = demo.attempt("Blender files and renderings", blender.need_blender)
    paths = spread(files, MEASUREMENT_SUFFIXES) or write_samples(folder / "samples", SAMPLES)
    for path in paths:
        demo.attempt(path.name, partial(demo.add, path))
    if demo.records:
        demo.attempt("the summary", demo.finish)
        print(_table(demo.records))
        print(f"\nPictures, errors and run times: {folder / 'index.html'}")
    return SOME_FAILED if demo.failures else DONE


def _table(records: list[Record]) -> str:
    wide = max(len("material"), *(len(record.name) for record in records)) + 2
    figure = figure_of(VISUAL_NORM)
    lines = [f"{'material':{wide}}{'model':22}{preview.FIGURES[figure]:>20}{'seconds':>9}"]
    for record in records:
        for model, fit in record.fits.items():
            error = fit.error[figure]["pooled"]
            title = preview.TITLES[model]
            seconds = fit.seconds["total"]
            lines.append(f"{record.name:{wide}}{title:22}{error:20.4f}{seconds:9.2f}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
