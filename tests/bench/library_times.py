"""An asset library of a folder of tables: ./dev bench library_times DIR [--sheet PICTURE.png]

Seconds of `lobefit library DIR` from outside, and the processor time of all its processes: all of
it into an empty folder, and once more with the records kept, which leaves reading the tables (their
hashes), the pictures, and writing and opening the file. The least of a few rounds; the files are
read once before, so that none comes from a disk. The sheet shows the pictures of the assets, as
Blender reads them from the file.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from lobefit import picture
from lobefit.inputs import MEASUREMENT_SUFFIXES, files_in

PAGE = 0.35  # the grey around the spheres
ACROSS = 9


def cost(folder: Path, library: Path, jobs: int) -> tuple[float, float]:
    """Seconds, and seconds of the processors, of making the library."""
    command = [sys.executable, "-P", "-m", "lobefit", "library", str(folder), "--jobs", str(jobs)]
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([*command, "-o", str(library)], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processors = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - start, processors


def sheet(library: Path) -> np.ndarray:
    """The pictures of the assets of a library, by name."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(library))
    spheres = [sphere(item.preview) for item in bpy.data.materials if item.asset_data]
    spheres += [np.full_like(spheres[0], PAGE)] * (-len(spheres) % ACROSS)
    rows = [spheres[first : first + ACROSS] for first in range(0, len(spheres), ACROSS)]
    return np.concatenate([np.concatenate(row, axis=1) for row in rows])


def sphere(preview) -> np.ndarray:
    columns, rows = preview.image_size
    pixels = np.empty(rows * columns * 4, np.float32)
    preview.image_pixels_float.foreach_get(pixels)
    pixels = pixels.reshape(rows, columns, 4)[::-1]
    return PAGE + pixels[..., 3:] * (pixels[..., :3] - PAGE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--sheet", type=Path)
    options = parser.parse_args()
    files = files_in(options.folder, MEASUREMENT_SUFFIXES)
    for path in files:
        path.read_bytes()
    costs: dict[str, list[tuple[float, float]]] = {"all of it": [], "with its records": []}
    for _ in range(options.rounds):
        with tempfile.TemporaryDirectory() as output:
            library = Path(output) / "library.blend"
            for measured in costs.values():
                measured.append(cost(options.folder, library, options.jobs))
            size = library.stat().st_size
            if options.sheet:
                picture.write_png(options.sheet, sheet(library))
    print(f"{len(files)} tables, {options.jobs} jobs, {size / 1e6:.2f} MB")
    print("| | seconds | of the processors |")
    print("|---|---|---|")
    for name, measured in costs.items():
        seconds, processors = (min(column) for column in zip(*measured, strict=True))
        print(f"| {name} | {seconds:.1f} | {processors:.1f} |")


if __name__ == "__main__":
    main()
