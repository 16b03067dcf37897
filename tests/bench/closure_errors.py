"""How near each kind of material comes: ./dev bench closure_errors FILE.. --judge JUDGE.py

For each measured file, the sphere error of its materials rendered by Cycles (JUDGE.py FILE.blend
MATERIAL --merl FILE --json OUT): `measured` with 1, 2 and 3 specular closures, the best-fit
Principled BSDF, and `lobe` with 2 closures, the last against the fitted lobe itself. With --lobes
in place of files it is the published grid of lobes (exponent, interpolation, with and without
Fresnel). --offset shifts the judge's phases; each further --python (an interpreter with another
bpy) renders the same files, and the largest difference of its figures is printed. The column FLIP,
a figure nearer to the eye, is the mean HDR-FLIP (Andersson et al. 2021) of the same pictures, black
surroundings included, at its defaults: 0 is what no eye tells apart, 1 the most. It takes the worst
of many exposures, up to one that shows the darker half of a picture: of a metal under one sun that
is thousands of times darker than the highlight, and rules the figure.
"""

import argparse
import importlib.util
import json
import statistics
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import bpy
import flip_evaluator
import lobefit
import numpy as np
from lobefit.blender import quiet
from lobefit_addon import build_material
from numpy.typing import NDArray

EXPONENTS = (1.0, 5.0, 10.0, 30.0, 100.0, 500.0, 5000.0)
INTERPOLATIONS = (0.0, 0.25, 0.5, 0.75, 1.0)
IORS = (None, 1.5)
LOBE_KEYS = ("diffuse", "specular", "exponent", "interpolation", "ior")
SIZE = 96  # pixels of the judge's spheres


@dataclass
class Case:
    """A material in a file, what it is to be compared with, and what the engine says of it."""

    name: str
    reference: list[str]
    predicted: float
    seconds: float = 0.0


@dataclass
class Verdict:
    """The judge's figures of a material, and the mean HDR-FLIP of the same pictures."""

    sphere_error: float
    grazing: float  # phases from 130 degrees on
    worst_phase: float
    worst: float
    channels: NDArray[np.float64]
    flip: float


def measured_cases(path: Path, counts: list[int]) -> list[Case]:
    """Builds the materials of a measured file."""
    requests = [lobefit.Closures(count=count) for count in counts]
    requests.append(lobefit.Closures("lobe", 2))
    record = lobefit.fit(path, norm="cosine-l1", closures=requests)
    table = ["--merl", str(path)]
    cases = []
    for entry in record.closures:
        kind, count = entry["target"], entry["count"]
        name = f"{path.stem} {kind} {count}"
        build_material(record, kind, name, count=count).use_fake_user = True
        reference = table if kind == "measured" else lobe_reference(record.parameters)
        cases.append(Case(name, reference, entry["error"], entry["seconds"]))
    name = f"{path.stem} principled"
    build_material(record, "principled", name).use_fake_user = True
    return [*cases, Case(name, table, record.principled["error"])]


def lobe_reference(parameters: dict[str, Any]) -> list[str]:
    return ["--lobe", json.dumps({key: parameters[key] for key in LOBE_KEYS})]


def lobe_case(exponent: float, interpolation: float, ior: float | None) -> Case:
    """Builds the material of one lobe without a diffuse part."""
    values = ([0.0] * 3, [1.0] * 3, exponent, interpolation, ior)
    parameters = dict(zip(LOBE_KEYS, values, strict=True))
    # A record needs a fit; of it only the Principled BSDF for other renderers is used here.
    record = blank_record(parameters)
    record = lobefit.closures(record, target="lobe", count=2)
    name = f"{exponent:g} {interpolation:g} {ior}"
    build_material(record, "lobe", name, count=2).use_fake_user = True
    entry = record.closures[0]
    return Case(name, lobe_reference(parameters), entry["error"], entry["seconds"])


def blank_record(parameters: dict[str, Any]) -> lobefit.Record:
    figure = {"pooled": 0.0, "rgb": [0.0] * 3}
    black = dict(base_color=[0.0] * 3, metallic=0.0, roughness=0.5, ior=1.0, error=0.0)
    return lobefit.Record(
        model="interpolated",
        parameters={"model": "interpolated", **parameters},
        error=dict.fromkeys(("l1", "relative_l1", "relative_l1_80", "relative_l1_cosine"), figure),
        stages=[],
        seconds=dict.fromkeys(("read", "start", "fit", "total"), 0.0),
        converged=True,
        certainty={"starts": 0, "agree": 0, "spread": 0.0},
        albedo={"view_angle": [], "measured": [], "model": []},
        warnings=[],
        principled=black | {"specular_tint": [1.0] * 3},
        source={"path": None, "sha256": None, "format": "MERL", "bins": {}},
        schedule="polish",
        norm="cosine-l1",
        channels="shared",
        max_angle=90.0,
    )


class Judge:
    """The neutral judge of `script`, its phases shifted by `offset` degrees."""

    def __init__(self, script: Path, offset: float) -> None:
        self.script, self.offset = script, offset
        spec = importlib.util.spec_from_file_location("judge", script)
        self.module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.module)
        self.read = lru_cache(maxsize=1)(self.module.read_merl)

    def tell(self, blend: Path, case: Case) -> Verdict:
        """Judges a material in this process."""
        phases = [phase + self.offset for phase in self.module.PHASES]
        with quiet():
            images = self.module.render_spheres(str(blend), case.name, SIZE, phases)
        errors, references = self.module.compare(images, self._reference(case), SIZE, phases)
        pooled = {phase: error[0] for phase, error in errors.items()}
        return Verdict(
            sphere_error=statistics.mean(pooled.values()),
            grazing=statistics.mean(error for phase, error in pooled.items() if phase >= 130),
            worst_phase=max(pooled, key=pooled.get),
            worst=max(pooled.values()),
            channels=np.mean([error[1:] for error in errors.values()], axis=0),
            flip=statistics.mean(map(flip, references, images)),
        )

    def sphere_error_in(self, python: str, blend: Path, case: Case) -> float:
        """What the judge says when another interpreter, with a bpy of its own, renders."""
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out.json"
            command = [python, self.script, blend, case.name, *case.reference, "--json", out]
            command += ["--offset", self.offset]
            subprocess.run(list(map(str, command)), check=True, capture_output=True)
            return json.loads(out.read_text())["sphere_error"]

    def _reference(self, case: Case) -> Callable[..., NDArray[np.float64]]:
        option, value = case.reference
        if option == "--merl":
            return partial(self.module.lookup, self.read(value))
        return partial(self.module.interpolated_lobe, **json.loads(value))


def flip(reference: NDArray[np.float64], image: NDArray[np.float64]) -> float:
    """The mean HDR-FLIP of a picture."""
    pair = [pixels.reshape(SIZE, SIZE, 3).astype(np.float32) for pixels in (reference, image)]
    return flip_evaluator.evaluate(*pair, "HDR", applyMagma=False)[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--judge", type=Path, required=True)
    parser.add_argument("--lobes", action="store_true")
    parser.add_argument("--counts", nargs="*", type=int, default=[1, 2, 3])
    parser.add_argument("--offset", type=float, default=0.0)
    parser.add_argument("--python", nargs="*", default=[])
    options = parser.parse_args()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    cases: list[Case] = []
    if options.lobes:
        cases += [lobe_case(s, a, e) for s in EXPONENTS for e in IORS for a in INTERPOLATIONS]
    for path in options.files:
        cases += measured_cases(path, options.counts)
    with tempfile.TemporaryDirectory() as folder:
        blend = Path(folder) / "materials.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(blend))
        print(
            "| material | sphere error | grazing | worst (phase) | r, g, b | FLIP | predicted | s |"
        )
        print("|---" * 8 + "|")
        judge = Judge(options.judge, options.offset)
        found = {}
        for case in cases:
            told = judge.tell(blend, case)
            found[case.name] = told.sphere_error
            channels = ", ".join(f"{error:.3f}" for error in told.channels)
            print(
                f"| {case.name} | {told.sphere_error:.4f} | {told.grazing:.3f} | "
                f"{told.worst:.3f} ({told.worst_phase:g}) | {channels} | {told.flip:.4f} | "
                f"{case.predicted:.4f} | {case.seconds:.2f} |",
                flush=True,
            )
        for python in options.python:
            apart = [
                abs(judge.sphere_error_in(python, blend, case) - found[case.name]) for case in cases
            ]
            print(f"{python}: largest difference {max(apart):.1e}", flush=True)
    print(f"median {statistics.median(found.values()):.4f}, worst {max(found.values()):.4f}")


if __name__ == "__main__":
    main()
