"""Measured files from file to rendered sphere: ./dev bench measured_files FILE.. --judge JUDGE.py

For each file one row: L1, the relative figures, sphere error of the `live` material rendered by
Cycles (JUDGE.py FILE.blend MATERIAL --merl FILE --json OUT), seconds by stage and peak memory of
`lobefit fit`, for the default schedule, and a second time with --norm cosine-l1.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path


def lobefit(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "lobefit", *arguments], check=True, capture_output=True)


def peak_memory_of_fit(arguments: list[str]) -> float:
    """MiB that a process of its own needs at most for `lobefit fit`."""
    program = (
        "import resource, sys; from lobefit.command_line import main; code = main(sys.argv[1:]);"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss); sys.exit(code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], check=True, capture_output=True, text=True
    )
    return int(done.stdout.split()[-1]) / 1024


def sphere_error(judge: Path, record: Path, measured: Path, folder: Path) -> dict:
    blend, out = folder / "material.blend", folder / "sphere.json"
    lobefit("material", str(record), "--kind", "live", "-o", str(blend))
    find = (
        "import bpy, sys\n"
        "with bpy.data.libraries.load(sys.argv[1]) as (found, _): print(found.materials[0])"
    )
    named = subprocess.run(
        [sys.executable, "-c", find, str(blend)], check=True, capture_output=True, text=True
    )
    material = named.stdout.strip().splitlines()[-1]
    subprocess.run(
        [sys.executable, judge, blend, material, "--merl", measured, "--json", out],
        check=True,
        capture_output=True,
    )
    return json.loads(out.read_text())


def row(judge: Path, measured: Path, norm: str) -> str:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record_path = folder / "record.json"
        memory = peak_memory_of_fit(["fit", str(measured), "--norm", norm, "-o", str(record_path)])
        record = json.loads(record_path.read_text())
        sphere = sphere_error(judge, record_path, measured, folder)
    error, seconds = record["error"], record["seconds"]
    figures = [error["l1"]["pooled"]] + [
        error[key]["pooled"] for key in ("relative_l1", "relative_l1_80", "relative_l1_cosine")
    ]
    return (
        f"| {measured.stem} | {norm} | {figures[0]:.4g} | "
        + " | ".join(f"{figure:.3f}" for figure in figures[1:])
        + f" | {sphere['sphere_error']:.3f} | "
        + " | ".join(f"{seconds[key]:.2f}" for key in ("read", "start", "fit", "total"))
        + f" | {memory:.0f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--judge", type=Path, required=True)
    options = parser.parse_args()
    print(
        "| file | norm | L1 | relative | to 80 deg | cosine | sphere error |"
        " read s | start s | fit s | total s | MiB |"
    )
    print("|---" * 12 + "|")
    for file in options.files:
        for norm in ("l1", "cosine-l1"):
            print(row(options.judge, file, norm), flush=True)
    own = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"largest child, renders included: {own:.0f} MiB")


if __name__ == "__main__":
    main()
