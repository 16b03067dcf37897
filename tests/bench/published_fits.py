"""Published fits beside this project's: ./dev bench published_fits FILE.. [--figures FOLDER]

For each measurement, named as the MERL material it is of, the error figures (relative L1 over all
bins, within 80 degrees, and cosine-weighted) of

    Ngan          the Blinn-Phong fit of Ngan, Durand, Matusik, "Experimental analysis of BRDF
                  models" (EGSR 2005, supplemental), f = diffuse/pi + specular (n+2)/(2 pi) (h.n)^n
    Low           the ABC fit of Low et al. (TOG 2012), as lobefit.sample has it
    Blinn-Phong   the modified Blinn-Phong model without Fresnel, fitted here: Ngan's lobe, with
                  another factor
    interpolated  the interpolated lobe with Fresnel, fitted here

both of the latter by L1 and by cosine-weighted L1. The published ones were fitted to the MERL
measurements, by other norms, and NP-MERL tables are smooth fits of these: the figures show what was
published, not what its models can do.
"""

import argparse
import csv
from pathlib import Path

import lobefit
import numpy as np
from lobefit import _native

FIGURES = Path(__file__).parents[2].parent / "shared" / "figures"
KINDS = ("relative_l1", "relative_l1_80", "relative_l1_cosine")


def bin_weights() -> tuple[np.ndarray, np.ndarray]:
    """Of all bins (theta_h, theta_d, phi_d): the lower cosine of light and viewer, and the weight
    of the cosine-weighted error."""
    edges = (np.arange(91) / 90) ** 2 * np.pi / 2
    theta_h = (((np.arange(90) + 0.5) / 90) ** 2 * np.pi / 2)[:, None, None]
    theta_d = np.radians(np.arange(90) + 0.5)[None, :, None]
    phi_d = np.radians(np.arange(180) + 0.5)[None, None, :]
    along = np.cos(theta_h) * np.cos(theta_d)
    across = np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
    solid_angle = (
        np.sin(theta_h) * np.diff(edges)[:, None, None] * np.sin(theta_d) * np.cos(theta_d)
    )
    return along - np.abs(across), solid_angle * (along - across) * (along + across)


COS_80 = np.cos(np.radians(80))
LOWER_COSINE, WEIGHT = bin_weights()


def error_figures(measured: np.ndarray, model: np.ndarray) -> list[float]:
    """The figures KINDS, over the bins that both know."""
    valid = ~np.isnan(measured[0]) & ~np.isnan(model[0])
    off = np.abs(model - measured).sum(0)
    mass = measured.sum(0)
    weights = (valid, valid & (LOWER_COSINE > COS_80), WEIGHT * valid)
    return [float(np.nansum(w * off) / np.nansum(w * mass)) for w in weights]


def ngan_parameters(row: dict[str, str]) -> dict:
    """Ngan's lobe as an interpolated one: (h.n)^n is (h.n)^4 to the power n/4."""
    exponent = float(row["exponent"])
    scale = (exponent + 2) / (2 * np.pi)
    return {
        "model": "interpolated",
        "diffuse": [float(row[f"diffuse_{c}"]) for c in "rgb"],
        "specular": [scale * float(row[f"specular_{c}"]) for c in "rgb"],
        "exponent": exponent / 4,
        "interpolation": 1.0,
        "ior": None,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--figures", type=Path, default=FIGURES, help="folder of the CSV of Ngan")
    options = parser.parse_args()
    with (options.figures / "ngan2005_blinn_phong.csv").open() as file:
        ngan = {row["material"]: ngan_parameters(row) for row in csv.DictReader(file)}
    samples = _native.sample_names()
    asked = {
        f"{title} {norm}": {"model": model, "fresnel": fresnel, "norm": norm}
        for title, model, fresnel in (
            ("Blinn-Phong", "modified-blinn-phong", False),
            ("interpolated", "interpolated", True),
        )
        for norm in ("l1", "cosine-l1")
    }
    titles = ["Ngan", "Low", *asked]
    print(f"| relative L1: all bins, to 80 deg, cosine | {' | '.join(titles)} |")
    print("|---" * (len(titles) + 1) + "|")
    sums: dict[str, list[list[float]]] = {title: [] for title in titles}
    for path in options.files:
        name = path.stem
        if name not in ngan and name not in samples:
            continue
        measurement = lobefit.read(path)
        measured = np.array(measurement.values)
        found = {}
        if name in ngan:
            found["Ngan"] = error_figures(
                measured, _native.Measurement.from_model(ngan[name]).values
            )
        if name in samples:
            found["Low"] = error_figures(measured, _native.sample(name).values)
        for title, ask in asked.items():
            error = lobefit.fit(measurement, **ask).error
            found[title] = [error[kind]["pooled"] for kind in KINDS]
        for title, figures in found.items():
            sums[title].append(figures)
        cells = (" ".join(f"{x:.3f}" for x in found.get(title, [])) or "-" for title in titles)
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    medians = (" ".join(f"{x:.3f}" for x in np.median(sums[title], 0)) if sums[title] else "-"
               for title in titles)  # fmt: skip
    print(f"| median | {' | '.join(medians)} |")


if __name__ == "__main__":
    main()
