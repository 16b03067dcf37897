"""From file to material as Blender's window sees it: ./dev bench import_stalls FILE..

For each file: the seconds from the start of an import of the kind Measured to its material, which
then has its error, and the longest that the main thread was held up at once, with what it did. The
import is polled as by its timer; a window, which this has none of, draws in between
(tests/gui/stalls.py has one). Processor time, that of all threads and that of the main thread in
the step, tells what was their own where the machine has other work too.
"""

import argparse
import os
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import lobefit_addon
from lobefit_addon.jobs import Batch
from lobefit_addon.operators.import_measured import LOBEFIT_OT_import_measured
from lobefit_addon.operators.run import POLL, RunsFits
from lobefit_addon.properties import FitOptions


class Import(RunsFits):
    """The operator with its options as they are at first, outside of Blender's hands."""

    bl_label = LOBEFIT_OT_import_measured.bl_label
    apply = LOBEFIT_OT_import_measured.apply
    _make_materials = LOBEFIT_OT_import_measured._make_materials
    _target = None

    def __init__(self) -> None:
        self.problems: list[str] = []
        for owner in reversed(FitOptions.__mro__):
            for name, option in vars(owner).get("__annotations__", {}).items():
                setattr(self, name, option.keywords["default"])

    def report(self, kind: set[str], text: str) -> None:
        if "INFO" not in kind:
            self.problems.append(text)


class Steps:
    """What the main thread did: the longest step by the clock, with its processor time."""

    def __init__(self) -> None:
        self.longest = (0.0, 0.0, "")

    def take(self, name: str, step: Callable[[], Any]) -> Any:
        start, spent = time.perf_counter(), time.thread_time()
        try:
            return step()
        finally:
            taken = time.perf_counter() - start, time.thread_time() - spent, name
            self.longest = max(self.longest, taken)


def import_file(path: Path) -> tuple[float, float, Steps]:
    """Imports a file; the seconds it took by the clock and of the processors, and its steps."""
    steps, operator = Steps(), Import()
    start, spent = time.perf_counter(), time.process_time()
    batch = Batch([str(path)], operator.fit_options())
    while not steps.take(batch.text, lambda: batch.advance(0.0)):
        time.sleep(POLL)
    conclusion = operator.conclude_in_steps(bpy.context, batch)
    try:
        while True:
            steps.take("the material", lambda: next(conclusion))
            time.sleep(POLL)
    except StopIteration:
        seconds, spent = time.perf_counter() - start, time.process_time() - spent
    if operator.problems:
        raise SystemExit(operator.problems[0])
    return seconds, spent, steps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    options = parser.parse_args()
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    lobefit_addon.register()
    print(f"Blender {bpy.app.version_string}")
    print("| file | s to the material | s of processors | longest step ms | processor ms | at |")
    print("|---" * 6 + "|")
    rows = []
    for path in options.files:
        seconds, spent, steps = import_file(path)
        stall, own, name = steps.longest
        rows.append((seconds, spent, stall, own))
        cells = f"{seconds:.2f}", f"{spent:.2f}", f"{stall * 1e3:.0f}", f"{own * 1e3:.0f}"
        print(f"| {path.stem} | {' | '.join(cells)} | {name} |", flush=True)
    seconds, spent, stalls, own = zip(*rows, strict=True)
    print(
        f"median {statistics.median(seconds):.2f} s, {statistics.median(spent):.2f} s of processors"
    )
    print(f"longest step {max(stalls) * 1e3:.0f} ms, {max(own) * 1e3:.0f} ms of the processor")
    # bpy 4.5 may crash or hang at its exit where any class is registered.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
