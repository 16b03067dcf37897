"""The live node group against its formula: ./dev bench live_lobe --judge JUDGE.py [--python ..]

Renders the group for exponents 5 to 5000, interpolations 0, .5, 1, without Fresnel and with IOR
1.5, and prints sphere errors (JUDGE.py FILE.blend MATERIAL --lobe PARAMETERS --json OUT) as a
table. Each further --python (an interpreter with another bpy) renders the same file; the largest
difference of its figures is printed.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import bpy
from lobefit_addon.nodes.material import build_material

EXPONENTS = (5, 15, 30, 50, 100, 500, 5000)
INTERPOLATIONS = (0.0, 0.5, 1.0)
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


def sphere_errors(python: str, judge: Path, blend: Path, lobes: dict[str, dict]) -> dict:
    errors = {}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.json"
        for name, parameters in lobes.items():
            command = [python, judge, blend, name, "--lobe", json.dumps(parameters), "--json", out]
            subprocess.run(command, check=True, capture_output=True)
            errors[name] = json.loads(out.read_text())["sphere_error"]
    return errors


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", type=Path, required=True)
    parser.add_argument("--python", nargs="*", default=[])
    options = parser.parse_args()
    lobes = {
        f"{s} {alpha} {ior}": lobe(s, alpha, ior)
        for ior in IORS
        for s in EXPONENTS
        for alpha in INTERPOLATIONS
    }
    with tempfile.TemporaryDirectory() as folder:
        blend = Path(folder) / "lobes.blend"
        write_blend(blend, lobes)
        errors = sphere_errors(sys.executable, options.judge, blend, lobes)
        print("| s | no Fresnel, alpha 0 / .5 / 1 | IOR 1.5, alpha 0 / .5 / 1 |\n|---|---|---|")
        for s in EXPONENTS:
            cells = [
                " / ".join(f"{errors[f'{s} {alpha} {ior}']:.4f}" for alpha in INTERPOLATIONS)
                for ior in IORS
            ]
            print(f"| {s} | {cells[0]} | {cells[1]} |", flush=True)
        for python in options.python:
            other = sphere_errors(python, options.judge, blend, lobes)
            worst = max(abs(other[name] - errors[name]) for name in lobes)
            print(f"{python}: largest difference {worst:.1e}", flush=True)


if __name__ == "__main__":
    main()
