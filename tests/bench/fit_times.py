"""Whole fits against the time to read a file: ./dev bench fit_times FILE..

For each file, by two threads and in the default schedule: the time of reading it into memory that
was touched before (the least of nine), of `lobefit.fit` from outside (the least of a few), their
ratio, where the time goes by the record's own account, and the most memory that a fresh Python has
held after one fit. The files are read once before, so that none comes from a disk.
"""

import argparse
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import lobefit

THREADS = 2
MEMORY = """
import pathlib, sys, lobefit
lobefit.fit(sys.argv[1], threads=int(sys.argv[2]))
# Not ru_maxrss, which begins with what the process that started this one held.
lines = pathlib.Path("/proc/self/status").read_text().splitlines()
print(next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM")))
"""


def least_seconds(work: Callable[[], object], rounds: int) -> float:
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def read_seconds(path: Path) -> float:
    buffer = bytearray(path.read_bytes())

    def read() -> None:
        with path.open("rb", buffering=0) as file:
            file.readinto(buffer)

    return least_seconds(read, 9)


def peak_memory(path: Path) -> float:
    """MiB."""
    command = [sys.executable, "-P", "-c", MEMORY, str(path), str(THREADS)]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    print("| file | read ms | fit ms | ratio | read, start, fit, other ms | L1 | peak MiB |")
    print("|---" * 7 + "|")
    ratios = []
    for path in options.files:
        records = []
        read = read_seconds(path)
        fit = least_seconds(
            lambda path=path, records=records: records.append(lobefit.fit(path, threads=THREADS)),
            options.rounds,
        )
        seconds = records[-1].seconds
        parts = [seconds[part] for part in ("read", "start", "fit")]
        parts.append(seconds["total"] - sum(parts))
        ratios.append(fit / read)
        print(
            f"| {path.stem} | {read * 1e3:.1f} | {fit * 1e3:.0f} | {ratios[-1]:.1f} | "
            f"{', '.join(f'{part * 1e3:.0f}' for part in parts)} | "
            f"{records[-1].error['l1']['pooled']:.6g} | {peak_memory(path):.0f} |",
            flush=True,
        )
    print(f"ratio: median {statistics.median(ratios):.1f}, worst {max(ratios):.1f}")


if __name__ == "__main__":
    main()
