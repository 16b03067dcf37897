"""The fit against other ways to the same end: its own parts, Ceres as one writes it, and scipy.

All fit the interpolated model with Fresnel, nine parameters, to a measurement by the L1 norm.
Ceres and scipy begin at the best start that the fit's own scan finds, which costs them nothing;
they smooth |r| as the fit does at its end, and have the same bounds. What is too slow for all bins
is given bins drawn as the fit draws its own, weighted so that their optimum is that of all.
"""

import csv
import importlib.util
import io
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lobefit import _native
from lobefit._native import Measurement
from lobefit.inputs import Progress

TITLES = {
    "polish": "Lobefit",
    "subsample": "without the end on all bins",
    "joint": "all bins from one start",
    "stages": "the paper's stages",
    "ceres": "Ceres, a block per value",
    "scipy": "scipy least_squares",
}
OWN = ("polish", "subsample", "joint", "stages")
# Bins that a report gives the slow ones: enough for the optimum of all to about a part in 1,000.
DRAWN = 4000

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Trial:
    """What a method came to.

    `l1` (in 1/sr) and `relative_l1` are those of all bins, whichever were fitted; `seconds` as
    measured, of a fit to one bin in `every`. `bins` counts those that its last step saw, `passes`
    how often it went over its bins; what went over a part counts for that part. `converged` is what
    the method says of itself.
    """

    method: str
    l1: float
    relative_l1: float
    seconds: float
    every: float
    bins: int
    iterations: int
    passes: float
    converged: bool

    @property
    def extrapolated(self) -> bool:
        """Whether `seconds_of_all` was not measured."""
        return self.every > 1

    @property
    def seconds_of_all(self) -> float:
        """The seconds that all bins take if the time grows as their number."""
        return self.seconds * self.every


def compare(
    measurement: Measurement, progress: Progress | None = None, threads: int = 0
) -> list[Trial]:
    """Every method, those of others on some `DRAWN` bins; scipy where it is installed."""
    methods = [method for method in TITLES if method != "scipy" or has_scipy()]
    start = _native.best_start(measurement, threads)
    trials = []
    for index, method in enumerate(methods):
        if progress:
            progress(index / len(methods), f"Comparing with {TITLES[method]}")
        trials.append(run(method, measurement, DRAWN, threads, start))
    return trials


def run(
    method: str,
    measurement: Measurement,
    bins: int = 0,
    threads: int = 0,
    start: dict[str, Any] | None = None,
) -> Trial:
    """One method (a key of `TITLES`).

    One that is not of our own gets about so many `bins`, or all (0), and begins at `start`, which
    is looked for if None.
    """
    valid = measurement.bins["valid"]
    if method in OWN:
        began = time.perf_counter()
        found = _native.fit_by(measurement, method, threads)
        found["seconds"] = time.perf_counter() - began
        fitted = valid
    else:
        rival = _native.fit_naively if method == "ceres" else fit_by_scipy
        start = start or _native.best_start(measurement, threads)
        found = rival(measurement, start, bins, threads)
        fitted = min(found["bins"], valid)
    return Trial(
        method,
        found["error"]["l1"]["pooled"],
        found["error"]["relative_l1"]["pooled"],
        found["seconds"],
        valid / max(fitted, 1),
        min(found["bins"], valid),
        found["iterations"],
        found["touched"] / max(fitted, 1),
        found["converged"],
    )


def table(trials: Mapping[str, Sequence[Trial]]) -> str:
    """A line for every method on every material, as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    figures = ("l1", "relative_l1", "seconds", "seconds_of_all", "extrapolated")
    counts = ("bins", "iterations", "passes", "converged")
    writer.writerow(["material", "method", *figures, *counts])
    for name, row in trials.items():
        for trial in row:
            values = [getattr(trial, key) for key in figures + counts]
            writer.writerow([name, trial.method, *values])
    return text.getvalue()


def has_scipy() -> bool:
    return importlib.util.find_spec("scipy") is not None


def fit_by_scipy(
    measurement: Measurement, start: dict[str, Any], bins: int = 0, threads: int = 0
) -> dict[str, Any]:
    """The fit by scipy's least_squares, as `_native.fit_naively`; numpy chooses its own threads.

    Of its methods with bounds, dogbox needs a third of the evaluations of trf, which stops far from
    the optimum of nickel; and it comes closer after a coarser smoothing. Its steps grow so short on
    the ridge of s and k_s of metals that their length tells nothing about the end.
    """
    from scipy.optimize import least_squares

    problem = _Problem(measurement, bins)
    began = time.perf_counter()
    x = problem.variables(start)
    iterations = evaluations = 0
    for smoothing in (10 * problem.smoothing, problem.smoothing):
        found = least_squares(
            problem.misfit,
            np.clip(x, problem.lower, problem.upper),
            problem.jacobian,
            bounds=(problem.lower, problem.upper),
            method="dogbox",
            x_scale="jac",
            loss=problem.soft_l1,
            f_scale=smoothing,
            ftol=1e-6,
            xtol=None,
            max_nfev=100,
        )
        x = found.x
        iterations += found.njev
        evaluations += found.nfev + found.njev
    seconds = time.perf_counter() - began
    parameters = problem.parameters(np.clip(x, problem.lower, problem.upper))
    return {
        "parameters": parameters,
        "error": _native.error_figures(measurement, parameters),
        "bins": problem.bins,
        "iterations": iterations,
        "converged": found.status > 0,
        "touched": float(evaluations) * problem.bins,
        "seconds": seconds,
    }


class _Problem:
    """Misfits f - m of all channels of about so many bins (0: all), and their derivatives."""

    def __init__(self, measurement: Measurement, bins: int) -> None:
        terms = _native.l1_problem(measurement, bins)
        self._unit, self.smoothing = terms["unit"], terms["smoothing"]
        self.lower, self.upper = np.array(terms["lower"]), np.array(terms["upper"])
        columns = terms["columns"]
        self._u_phong, self._u_blinn = columns["u_phong"], columns["u_blinn"]
        self._cos_d = columns["cos_theta_d"]
        self._measured = np.stack([columns[name] for name in ("red", "green", "blue")])
        self._weight = np.tile(columns["weight"], 3)
        self.bins = self._cos_d.size

    def variables(self, parameters: dict[str, Any]) -> Floats:
        diffuse = np.divide(parameters["diffuse"], self._unit * np.pi)
        specular = np.divide(parameters["specular"], self._unit)
        shape = [
            np.log(parameters["exponent"]),
            parameters["interpolation"],
            np.log(parameters["ior"] - 1),
        ]
        return np.concatenate([diffuse, specular, shape])

    def parameters(self, x: Floats) -> dict[str, Any]:
        return {
            "model": "interpolated",
            "diffuse": (x[:3] * self._unit * np.pi).tolist(),
            "specular": (x[3:6] * self._unit).tolist(),
            "exponent": float(np.exp(x[6])),
            "interpolation": float(x[7]),
            "ior": 1 + float(np.exp(x[8])),
        }

    def soft_l1(self, z: Floats) -> Floats:
        """scipy's loss of this name and its derivatives, weighted."""
        root = np.sqrt(1 + z)
        return np.stack([2 * (root - 1), 1 / root, -0.5 / root**3]) * self._weight

    def misfit(self, x: Floats) -> Floats:
        _, power = self._lobe(x)
        fresnel, _ = self._fresnel(x[8])
        return (x[:3, None] + x[3:6, None] * (fresnel * power) - self._measured).ravel()

    def jacobian(self, x: Floats) -> Floats:
        base, power = self._lobe(x)
        fresnel, fresnel_slope = self._fresnel(x[8])
        exponent = np.exp(x[6])
        slopes = np.stack(
            [
                fresnel * power * exponent * np.log(base),
                fresnel * power * exponent / base * (self._u_phong - self._u_blinn),
                fresnel_slope * power,
            ],
            axis=1,
        )
        jacobian = np.zeros((3, self.bins, x.size))
        for channel in range(3):
            jacobian[channel, :, channel] = 1
            jacobian[channel, :, 3 + channel] = fresnel * power
            jacobian[channel, :, 6:] = x[3 + channel] * slopes
        return jacobian.reshape(-1, x.size)

    def _lobe(self, x: Floats) -> tuple[Floats, Floats]:
        """The base, 1 where the lobe is 0, and its power."""
        base = 1 - (1 - x[7]) * self._u_phong - x[7] * self._u_blinn
        inside = base > 0
        base = np.where(inside, base, 1.0)
        return base, np.where(inside, np.exp(np.exp(x[6]) * np.log(base)), 0.0)

    def _fresnel(self, log_excess_ior: float) -> tuple[Floats, Floats]:
        """R_F and its derivative by log(eta - 1); see native/reflectance/fresnel.h."""
        excess_ior = np.exp(log_excess_ior)
        excess = excess_ior * (excess_ior + 2)
        c, g = self._cos_d, np.sqrt(excess + self._cos_d**2)
        total = g + c
        s, s_slope = excess / total**2, 2 * c / total**2
        upper, lower = c * total - 1, c * excess / total + 1
        ratio, ratio_slope = upper / lower, c * (lower - upper) / lower**2
        by_g = s * s_slope * (1 + ratio**2) + s**2 * ratio * ratio_slope
        return s**2 * (1 + ratio**2) / 2, by_g * (1 + excess_ior) / g * excess_ior
