"""Fits of tables whose truth is known: ./dev bench known_truth [--quick]

Tables of each of the three models, over a grid of exponents, interpolations and indices of
refraction, are fitted twice: as they are, and with 5 % Gaussian noise, .5 % of the values spiked
(times 100) and .2 % negated. Prints for each model the worst case of either kind:

    parameters  the largest relative error of rho_d, rho_s or k_s, s and eta, without noise
    alpha       the largest error of alpha, without noise
    excess      how far the fit's L1 over the unspiked values lies above the truth's own, with noise
"""

import argparse
import itertools

import numpy as np
from lobefit import _native

EXPONENTS = (0.2, 1, 5, 25, 100, 500, 2500, 1e4, 1e5)
IORS = (None, 1.05, 1.3, 1.7, 3.0)
INTERPOLATIONS = {"modified-phong": (None,), "modified-blinn-phong": (None,),
                  "interpolated": (0.0, 0.3, 1.0)}  # fmt: skip
NOISE, SPIKED, NEGATED = 0.05, 0.005, 0.002


def truth(model: str, exponent: float, alpha: float | None, ior: float | None) -> dict:
    """Parameters whose lobe reflects some 20 to 30 % of the light at normal incidence."""
    fresnel = ((ior - 1) / (ior + 1)) ** 2 if ior else 1.0
    scale = (exponent + 2) / (2 * np.pi) if model == "interpolated" else 1.0
    return {
        "model": model,
        "diffuse": [0.2, 0.15, 0.1],
        "specular": [rho * scale / fresnel for rho in (0.3, 0.25, 0.2)],
        "exponent": float(exponent),
        "interpolation": alpha,
        "ior": ior,
    }


def fit(measurement: _native.Measurement, known: dict) -> dict:
    job = _native.FitJob(measurement, model=known["model"], fresnel=known["ior"] is not None)
    while not job.wait(1.0):
        pass
    return job.result()["parameters"]


def errors(known: dict, found: dict) -> tuple[float, float]:
    """The largest relative error of the parameters, and the error of alpha."""
    worst = 0.0
    for key in ("diffuse", "specular", "exponent", "ior"):
        if known[key] is not None:
            worst = max(worst, np.max(np.abs(np.divide(found[key], known[key]) - 1)))
    return worst, abs((found["interpolation"] or 0) - (known["interpolation"] or 0))


def excess_under_noise(known: dict, values: np.ndarray, random: np.random.Generator) -> float:
    """(L1 of the fit - L1 of the truth) / L1 of the truth, over the values that are not spiked."""
    noisy = values * np.maximum(0, 1 + NOISE * random.standard_normal(values.shape))
    fate = random.random(values.shape)
    spiked = fate < SPIKED
    noisy[spiked] *= 100
    noisy[(fate >= SPIKED) & (fate < SPIKED + NEGATED)] *= -1
    measurement = _native.Measurement.from_values(noisy)
    fitted = _native.Measurement.from_model(fit(measurement, known)).values
    kept = ~np.isnan(measurement.values) & ~spiked
    of_truth = np.abs(values - noisy)[kept].sum()
    return float(np.abs(fitted - noisy)[kept].sum() / of_truth - 1)


def study(model: str, exponents: tuple, random: np.random.Generator) -> None:
    worst = {"parameters": (0.0, {}), "alpha": (0.0, {}), "excess": (-1.0, {})}
    cases = list(itertools.product(exponents, INTERPOLATIONS[model], IORS))
    for exponent, alpha, ior in cases:
        known = truth(model, exponent, alpha, ior)
        table = _native.Measurement.from_model(known)
        parameter_error, alpha_error = errors(known, fit(table, known))
        excess = excess_under_noise(known, np.array(table.values), random)
        case = {"s": exponent, "alpha": alpha, "eta": ior}
        for name, value in zip(worst, (parameter_error, alpha_error, excess), strict=True):
            if value > worst[name][0]:
                worst[name] = (value, case)
        if parameter_error > 0.01 or alpha_error > 0.01 or excess > 0.005:
            print(f"  {case}: {parameter_error:.2g}, alpha {alpha_error:.2g}, {excess:.2g}")
    print(f"{model}: {len(cases)} tables")
    for name, (value, case) in worst.items():
        print(f"  worst {name:10} {value:10.2g}  {case}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="three exponents only")
    exponents = EXPONENTS[::4] if parser.parse_args().quick else EXPONENTS
    random = np.random.default_rng(1)
    for model in INTERPOLATIONS:
        study(model, exponents, random)


if __name__ == "__main__":
    main()
