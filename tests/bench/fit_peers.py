"""The fit against other ways to it on all bins: ./dev bench fit_peers FILE..

For each file, by two threads: reading it into memory that was touched before (the least of nine);
`lobefit.fit` from the file to the record (the least of five), which the others are compared with;
and from a measurement in memory its fit alone (the least of five) and, once each, Ceres with a
residual block per value and scipy's least_squares (see lobefit/methods.py), which begin at
Lobefit's best start and are not charged for finding it. Each in a process of its own, with the
processor time and the most memory of that process, and the L1 error over all bins at their centres.
Last, whether the two take as many times as long as they should, and how far Lobefit's error is
above theirs, which may be .1 %. Takes some minutes a file.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import lobefit
from lobefit import methods

THREADS = 2
ROUNDS = 5
LEAST_RATIO = {"ceres": 300, "scipy": 150}
MOST_EXCESS = 1e-3


def peak_memory() -> float:
    """MiB. Not ru_maxrss, which begins with what the process that started this one held."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))


def least_of(rounds: int, work) -> tuple[float, float, object]:
    """Seconds, processor seconds and result of the round that took least."""
    best = None
    for _ in range(rounds):
        wall, processor = time.perf_counter(), time.process_time()
        result = work()
        taken = time.perf_counter() - wall, time.process_time() - processor, result
        best = taken if best is None or taken[0] < best[0] else best
    return best


def measure(way: str, path: Path) -> dict:
    """One way, in this process."""
    if way == "read":
        buffer = bytearray(path.stat().st_size)
        taken = least_of(9, lambda: path.open("rb", buffering=0).readinto(buffer))
        return figures(*taken[:2], None)
    if way == "file":
        seconds, processor, record = least_of(ROUNDS, lambda: lobefit.fit(path, threads=THREADS))
        return figures(seconds, processor, record.error["l1"]["pooled"])
    measurement = lobefit.read(path)
    rounds = ROUNDS if way in methods.OWN else 1
    _, processor, trial = least_of(rounds, lambda: methods.run(way, measurement, threads=THREADS))
    return figures(trial.seconds, processor, trial.l1)


def figures(seconds: float, processor: float, l1: float | None) -> dict:
    return {"seconds": seconds, "processor": processor, "l1": l1, "memory": peak_memory()}


def measured_apart(way: str, path: Path) -> dict:
    """One way, in a process of its own."""
    command = [sys.executable, "-P", __file__, "--only", way, str(path)]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": str(THREADS)}
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment)
    return json.loads(done.stdout)


def compare(path: Path) -> bool:
    """Prints the rows of a file and says whether all is as asked."""
    own = measured_apart("file", path)
    titles = {**methods.TITLES, "read": "read", "file": "Lobefit", "polish": "its fit alone"}
    reached = True
    for way in ("read", "file", "polish", *LEAST_RATIO):
        found = own if way == "file" else measured_apart(way, path)
        ratio = found["seconds"] / own["seconds"]
        verdict = ""
        if way in LEAST_RATIO:
            fast = ratio >= LEAST_RATIO[way]
            exact = own["l1"] <= (1 + MOST_EXCESS) * found["l1"]
            reached &= fast and exact
            verdict = f"{'>=' if fast else '<'} {LEAST_RATIO[way]}, "
            verdict += f"Lobefit's L1 {100 * (own['l1'] / found['l1'] - 1):+.3f} %"
        error = "" if found["l1"] is None else f"{found['l1']:.6g}"
        print(
            f"| {path.stem} | {titles[way]} | {found['seconds']:.3f} | {found['processor']:.3f} | "
            f"{found['memory']:.0f} | {error} | {ratio:.2f} | {verdict} |",
            flush=True,
        )
    return reached


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--only", help="print what one way takes, as JSON")
    options = parser.parse_args()
    if options.only:
        print(json.dumps(measure(options.only, options.files[0])))
        return 0
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    print("| file | way | seconds | processor s | peak MiB | L1 | of Lobefit | |")
    print("|---" * 8 + "|")
    reached = [compare(path) for path in options.files]
    print(f"all as asked on {sum(reached)} of {len(reached)} files")
    return 0 if all(reached) else 1


if __name__ == "__main__":
    sys.exit(main())
