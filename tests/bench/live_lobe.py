"""The live node group against its formula: ./dev bench live_lobe --judge JUDGE.py [--python ..]

Renders the group for exponents 1 to 5000, interpolations 0 to 1, without Fresnel and with IOR 1.5,
and prints sphere errors (JUDGE.py FILE.blend MATERIAL --lobe PARAMETERS --json OUT) as a table, the
median and the worst of each exponent and of the sharp ones together, and how many nodes the group
has. Each --offset (degrees) repeats it with the judge's phase angles shifted. Each further --python
(an interpreter with another bpy) renders the same file; the largest difference of its figures is
printed.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import bpy
from lobefit_addon.nodes.live import live_group
from lobefit_addon.nodes.material import build_material

EXPONENTS = (1, 5, 10, 30, 100, 500, 5000)
# From here on one closure carries nearly all of the lobe; these are also summed up together.
SHARP = (30, 100, 500, 5000)
INTERPOLATIONS = (0.0, 0.25, 0.5, 0.75, 1.0)
IORS = (None, 1.5)
PRINCIPLED = {
    "base_color": [0.5] * 3,
    "metallic": 0.0,
    "roughness": 0.5,
    "ior": 1.5,
    "specular_tint": [1.0] * 3,
}


def lobe(exponent: float, interpolation: float, ior: float | None) -> dict:
    """Parameters as the judge takes them; it has no diffuse part, which is exact anyhow."""
    return {
        "diffuse": [0.0] * 3,
        "specular": [1.0] * 3,
        "exponent": exponent,
        "interpolation": interpolation,
        "ior": ior,
    }


def name_of(exponent: float, interpolation: float, ior: float | None) -> str:
    return f"{exponent:g} {interpolation:g} {ior}"


def write_blend(path: Path, lobes: dict[str, dict]) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    for name, parameters in lobes.items():
        record = SimpleNamespace(
            parameters={"model": "interpolated", **parameters},
            principled=PRINCIPLED,
            to_json=lambda: "{}",
        )
        build_material(record, name=name).use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def node_count() -> str:
    kinds = Counter(node.bl_idname for node in live_group().nodes)
    numbers = kinds["ShaderNodeMath"], kinds["ShaderNodeVectorMath"]
    inside = sum(kinds.values()) - kinds["NodeFrame"]
    return f"{inside} nodes, {numbers[0]} of them Math and {numbers[1]} Vector Math"


def sphere_errors(
    python: str, judge: Path, blend: Path, lobes: dict[str, dict], offset: float = 0.0
) -> dict[str, float]:
    errors = {}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.json"
        for name, parameters in lobes.items():
            command = [python, judge, blend, name, "--lobe", json.dumps(parameters)]
            command += ["--json", out, "--offset", str(offset)]
            subprocess.run(command, check=True, capture_output=True)
            errors[name] = json.loads(out.read_text())["sphere_error"]
    return errors


def print_table(errors: dict[str, float], exponents: list[float]) -> None:
    alphas = " / ".join(f"{alpha:g}" for alpha in INTERPOLATIONS)
    print(f"| s | no Fresnel, alpha {alphas} | IOR 1.5, alpha {alphas} | median | worst |")
    print("|---|---|---|---|---|")
    for s in exponents:
        rows = [[errors[name_of(s, alpha, ior)] for alpha in INTERPOLATIONS] for ior in IORS]
        cells = [" / ".join(f"{error:.4f}" for error in row) for row in rows]
        every = rows[0] + rows[1]
        summary = f"{statistics.median(every):.4f} | {max(every):.4f}"
        print(f"| {s:g} | {cells[0]} | {cells[1]} | {summary} |", flush=True)
    sharp = [
        errors[name_of(s, alpha, ior)]
        for s in exponents
        if s in SHARP
        for alpha in INTERPOLATIONS
        for ior in IORS
    ]
    if sharp:
        median, worst = statistics.median(sharp), max(sharp)
        print(f"exponents from {min(SHARP)} up: median {median:.4f}, worst {worst:.4f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", type=Path, required=True)
    parser.add_argument("--exponents", type=float, nargs="*", default=list(EXPONENTS))
    parser.add_argument("--offset", type=float, nargs="*", default=[])
    parser.add_argument("--python", nargs="*", default=[])
    options = parser.parse_args()
    lobes = {
        name_of(s, alpha, ior): lobe(s, alpha, ior)
        for s in options.exponents
        for alpha in INTERPOLATIONS
        for ior in IORS
    }
    with tempfile.TemporaryDirectory() as folder:
        blend = Path(folder) / "lobes.blend"
        write_blend(blend, lobes)
        print(f"the group has {node_count()}", flush=True)
        errors = sphere_errors(sys.executable, options.judge, blend, lobes)
        print_table(errors, options.exponents)
        for offset in options.offset:
            print(f"phase angles shifted by {offset:g} degrees:")
            shifted = sphere_errors(sys.executable, options.judge, blend, lobes, offset)
            print_table(shifted, options.exponents)
        for python in options.python:
            other = sphere_errors(python, options.judge, blend, lobes)
            worst = max(abs(other[name] - errors[name]) for name in lobes)
            print(f"{python}: largest difference {worst:.1e}", flush=True)


if __name__ == "__main__":
    main()
