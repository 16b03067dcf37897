"""What the extension adds to Blender's start: ./dev bench startup [PYTHON ..]

For each Python that has bpy (the one at hand, if none is named), the milliseconds of importing the
add-on and of `register`, the least of seven fresh processes, whose first one leaves the bytecode as
Blender does: by the clock and by processor time.

Python collects garbage among all objects whenever it has made so many, and in whose import that
falls is chance. The second row of a release is of a start after such a collection, and what this
one took, which is there without Lobefit too, stands beside it.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ADDON = Path(__file__).resolve().parents[2] / "addon"
ROUNDS = 7
PROGRAM = """
import gc, os, sys, time
import bpy
sys.path.insert(0, sys.argv[1])
clock = time.perf_counter()
if sys.argv[2] == "collected":
    gc.collect()
before = time.perf_counter() - clock
clock, own = time.perf_counter(), time.thread_time()
import started_addon
started_addon.register()
clock, own = time.perf_counter() - clock, time.thread_time() - own
print(bpy.app.version_string.split()[0], clock, own, before)
started_addon.unregister()
sys.stdout.flush()
os._exit(0)
"""


def once(python: str, folder: Path, garbage: str) -> tuple[float, float, float, str]:
    """Seconds by the clock, by processor time, of the collection before, and the release."""
    command = [python, "-c", PROGRAM, str(folder), garbage]
    bytecode = {"PYTHONPYCACHEPREFIX": str(folder / "bytecode"), "PYTHONDONTWRITEBYTECODE": ""}
    answer = subprocess.run(
        command, env=os.environ | bytecode, check=True, capture_output=True, text=True
    )
    release, *seconds = answer.stdout.splitlines()[-1].split()
    return *map(float, seconds), release


def main() -> None:
    print("| Blender | garbage | ms by the clock | ms of the processor | ms of the collection |")
    print("|---" * 5 + "|")
    for python in sys.argv[1:] or [sys.executable]:
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "started_addon").symlink_to(ADDON)
            for garbage in ("as Blender left it", "collected"):
                rounds = [once(python, Path(folder), garbage) for _ in range(ROUNDS)]
                *seconds, release = (min(column) for column in zip(*rounds, strict=True))
                told = " | ".join(f"{value * 1e3:.1f}" for value in seconds)
                print(f"| {release} | {garbage} | {told} |", flush=True)


if __name__ == "__main__":
    main()
