"""The experiment of the paper on any measurements: ./dev bench paper_experiment FILE..

Modified Phong (1), modified Blinn-Phong (2) and the interpolated lobe (3) of Nielsen et al. (2014),
each without and with Fresnel, fitted by unweighted L1 over all bins as in the paper. For each file
the relative L1 after a joint polish, with by how much the paper's three stages alone end above it
in brackets, and the interpolation alpha of (3): 0 is Phong's lobe, 1 Blinn-Phong's. Below: for how
many files (3) is better than both others, and how many are like which.
"""

import argparse
from pathlib import Path

import lobefit
from lobefit.record import MODELS

LIKE = {"Phong (alpha < 0.25)": (-1.0, 0.25), "between": (0.25, 0.75), "Blinn-Phong": (0.75, 2.0)}


def relative_l1(measurement: lobefit.Measurement, **options: object) -> tuple[float, float | None]:
    """The error of a fit, and its alpha."""
    record = lobefit.fit(measurement, **options)
    return record.error["relative_l1"]["pooled"], record.parameters["interpolation"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    options = parser.parse_args()
    columns = [(fresnel, model) for fresnel in (False, True) for model in MODELS]
    titles = [f"({i}){' with Fresnel' * fresnel}" for fresnel in (0, 1) for i in (1, 2, 3)]
    print(f"| file | {' | '.join(titles)} | alpha | with Fresnel |")
    print("|---" * (len(titles) + 3) + "|")
    better = {False: 0, True: 0}
    alphas: dict[bool, list[float]] = {False: [], True: []}
    for path in options.files:
        measurement = lobefit.read(path)
        errors, cells = {}, []
        for fresnel, model in columns:
            ask = {"model": model, "fresnel": fresnel}
            polished, alpha = relative_l1(measurement, **ask)
            stages, _ = relative_l1(measurement, schedule="stages", **ask)
            errors[fresnel, model] = polished
            cells.append(f"{polished:.4f} ({100 * (stages / polished - 1):+.1f} %)")
            if model == MODELS[-1]:
                alphas[fresnel].append(alpha)
        for fresnel in better:
            *others, interpolated = (errors[fresnel, model] for model in MODELS)
            better[fresnel] += interpolated < min(others) * (1 - 1e-4)
        last = " | ".join(f"{alphas[fresnel][-1]:.3f}" for fresnel in (False, True))
        print(f"| {path.stem} | {' | '.join(cells)} | {last} |", flush=True)
    for fresnel, count in better.items():
        like = ", ".join(
            f"{sum(low <= alpha < high for alpha in alphas[fresnel])} {name}"
            for name, (low, high) in LIKE.items()
        )
        print(
            f"{'with' if fresnel else 'without'} Fresnel: (3) beats both others by over 0.01 % in "
            f"{count} of {len(options.files)} files; {like}"
        )


if __name__ == "__main__":
    main()
