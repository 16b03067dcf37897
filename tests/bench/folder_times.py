"""A folder of tables with one job and with several: ./dev bench folder_times DIR

Seconds of `lobefit fit DIR` from outside, into an empty folder each time, and files per second: the
least of a few rounds, in which the numbers of jobs take turns. The files are read once before, so
that none comes from a disk.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from lobefit.inputs import MEASUREMENT_SUFFIXES, files_in


def fit_seconds(folder: Path, jobs: int) -> float:
    with tempfile.TemporaryDirectory() as output:
        command = [sys.executable, "-P", "-m", "lobefit", "fit", str(folder)]
        start = time.perf_counter()
        subprocess.run(
            [*command, "--jobs", str(jobs), "-o", output], check=True, stdout=subprocess.DEVNULL
        )
        return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    files = files_in(options.folder, MEASUREMENT_SUFFIXES)
    for path in files:
        path.read_bytes()
    times: dict[int, list[float]] = {jobs: [] for jobs in options.jobs}
    for _ in range(options.rounds):
        for jobs, seconds in times.items():
            seconds.append(fit_seconds(options.folder, jobs))
    print("| jobs | seconds | files per second |")
    print("|---" * 3 + "|")
    for jobs, seconds in times.items():
        print(f"| {jobs} | {min(seconds):.1f} | {len(files) / min(seconds):.2f} |")


if __name__ == "__main__":
    main()
