"""The record: one JSON file that holds all a fit found out, and all that a material needs."""

import dataclasses
import itertools
import json
import math
import os
import platform
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lobefit import _native
from lobefit.atomic import write_bytes
from lobefit.checks import (
    Check,
    Mismatch,
    Missing,
    bytes_of,
    checked_json,
    choice,
    kind,
    list_of,
    number,
    object_of,
    or_null,
)

SCHEMA = 1
MODELS = ("modified-phong", "modified-blinn-phong", "interpolated")
# How a fit goes about it; see `Job`.
SCHEDULES = ("stages", "polish", "joint", "subsample")
NORMS = ("l1", "cosine-l1", "l2", "log-l2")
ERRORS = ("l1", "relative_l1", "relative_l1_80", "relative_l1_cosine")

_CHANNELS = ("red", "green", "blue")

# The norm of fits that are made to be looked at: plain L1 is the paper's, but bins near grazing,
# of which a picture shows little, rule it.
VISUAL_NORM = "cosine-l1"


def figure_of(norm: str) -> str:
    """The error figure, one of `ERRORS`, by which fits with this norm are compared."""
    return "relative_l1_cosine" if norm == VISUAL_NORM else "relative_l1"


@dataclass(kw_only=True)
class Fit:
    """One model fitted to one measurement.

    `parameters` holds `model`, `diffuse` [3], `specular` [3] (rho_s of eq. 1 and 2, k_s of eq. 3 of
    Nielsen et al.), `exponent` (one number, or three with separate channels), `interpolation`
    (None but for eq. 3) and `ior` (None without Fresnel). `error` has the figures of `ERRORS`, each
    with `pooled` and `rgb`. `stages` are {name, l1, seconds, iterations} in the order they ran.

    `error_by_angle` tells where the error stands, by sums of |f - m| (`misfit`) and of m
    (`measured`) of the parts of the hemisphere, both relative to all that was measured. So the
    misfits add up to the relative error of the whole, and misfit / measured is that of a part.
    `half_difference` {theta_h, theta_d, misfit, measured} has a row for each step of theta_h, of
    bins as they are (`relative_l1`); `view` {view_angle, misfit, measured} goes by the viewer's
    angle from the normal, of bins weighted as in `relative_l1_cosine`. Angles are in degrees and
    one more than the steps, which they stand between.

    `uncertainty` is None where it was not asked for. `low` and `high` are parameters: the ends of
    intervals of `confidence` around the fit, from a jackknife over `blocks` parts of the data.
    `undetermined` names those of `variables` whose interval is wider than a factor of 2 (the
    interpolation: than half of its range), `correlation` is a matrix of all variables.
    """

    model: str
    parameters: dict[str, Any]
    error: dict[str, dict[str, Any]]
    stages: list[dict[str, Any]]
    seconds: dict[str, float]
    converged: bool
    certainty: dict[str, Any]
    albedo: dict[str, list[Any]]
    warnings: list[str]
    principled: dict[str, Any]
    error_by_angle: dict[str, dict[str, Any]] | None = None
    uncertainty: dict[str, Any] | None = None

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """The ends of the interval of each variable ("diffuse red", .., "ior"), if known."""
        if self.uncertainty is None:
            return {}
        low, high = self.uncertainty["low"], self.uncertainty["high"]
        return {
            variable: (_of_variable(low, variable), _of_variable(high, variable))
            for variable in self.uncertainty["variables"]
        }


@dataclass(kw_only=True)
class Record(Fit):
    """RECORD.json, schema 1.

    `source` is {path, sha256, format, bins} with the `name` of a sample where the file is one; path
    and sha256 are None for a measurement that was never a file. `models` holds a fit for each model
    when several were fitted; the record's own model is then the one with the least error.

    `closures` are approximations of the measurement or the fitted lobe by a few Cycles closures,
    each {target, count, cap_albedo, error, seconds, by_view, diffuse, specular}: `target` is
    "measured" or "lobe", `count` the number of specular closures asked for, `error` the mean L1
    difference of pictures of a sphere over all angles between light and viewer,
    `by_view` {view_angle, target_albedo, closures_albedo, relative_error}, `diffuse` three weight
    curves (red, green, blue) and `specular` {distribution, roughness, anisotropy, bend,
    weight [3]}. A curve is a list of points [cosine of the view angle, value], linear between.
    """

    source: dict[str, Any]
    schedule: str
    norm: str
    channels: str
    max_angle: float
    machine: dict[str, Any] = field(default_factory=lambda: this_machine())
    models: dict[str, Fit] = field(default_factory=dict)
    closures: list[dict[str, Any]] = field(default_factory=list)
    schema: int = SCHEMA

    @property
    def name(self) -> str:
        """What to call the material in a picture or a report."""
        path = self.source["path"]
        return self.source.get("name") or (Path(path).stem if path else "measurement")

    @property
    def fits(self) -> dict[str, Fit]:
        """Every fit in this record by its model, in the order of `MODELS`."""
        fits = self.models or {self.model: self}
        return {model: fits[model] for model in MODELS if model in fits}

    @property
    def leading_figure(self) -> str:
        """The error figure, one of `ERRORS`, by which this record's fits are compared."""
        return figure_of(self.norm)

    def command(self) -> str:
        """The command line that makes this record again."""
        path = Path(self.source["path"] or "MEASUREMENT.binary")
        words = ["lobefit", "fit", str(path), "--model", "all" if self.models else self.model]
        words += ["--no-fresnel"] if self.parameters["ior"] is None else []
        words += ["--schedule", self.schedule, "--norm", self.norm, "--channels", self.channels]
        words += ["--max-angle", f"{self.max_angle:g}"]
        words += ["--uncertainty"] if self.uncertainty else []
        words += ["-o", f"{path.stem}.json"]
        return shlex.join(words)

    def to_json(self) -> str:
        """The record as JSON, an entry a line; every number is exact when read back."""
        lines = (
            f'"{name}": {json.dumps(value, allow_nan=False, default=_entries)}'
            for name, value in _entries(self).items()
        )
        return "{" + ",\n".join(lines) + "}\n"

    @classmethod
    def from_json(cls, text: str | bytes, name: str = "record") -> "Record":
        """The record in `text`. Raises InputError with `name`, what was expected and found."""
        data = checked_json(text, name, "a record", _record)
        known = {key: data[key] for key in _names(cls) if key in data}
        known["models"] = {
            model: Fit(**{key: fit[key] for key in _names(Fit) if key in fit})
            for model, fit in data.get("models", {}).items()
        }
        return cls(**known)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the record to `path`, all of it or nothing."""
        write_bytes(path, self.to_json().encode())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Record":
        """The record in the file `path`. Raises InputError where it cannot be read."""
        return cls.from_json(bytes_of(path, "a record"), str(path))


def this_machine() -> dict[str, Any]:
    """What the run time of a fit depends on, and the build that did it."""
    return {
        "system": platform.platform(terse=True),
        "processor": _processor(),
        "threads": os.cpu_count() or 1,
        "version": _native.version,
        "build": _native.build_id,
    }


def _processor() -> str:
    """The processor's name as the system tells it; Python itself knows it on some systems only."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or platform.machine()


def _entries(item: Any) -> dict[str, Any]:
    """What a dataclass holds, by name."""
    return {name: getattr(item, name) for name in _names(type(item))}


def _names(kind: type) -> list[str]:
    return [item.name for item in dataclasses.fields(kind)]


def _of_variable(parameters: dict[str, Any], variable: str) -> float:
    name, _, channel = variable.partition(" ")
    value = parameters[name]
    return value[_CHANNELS.index(channel)] if isinstance(value, list) else value


def without_nan(value: Any) -> Any:
    """`value` with None for an unknown number (an albedo never measured): JSON has no NaN."""
    if isinstance(value, dict):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


# What a record looks like: each check takes a value and where it stands, and raises Mismatch.


def _curve(value: Any, where: str) -> None:
    list_of(list_of(_NUMBER, 2))(value, where)
    cosines = [cosine for cosine, _ in value]
    if not cosines or any(a >= b for a, b in itertools.pairwise(cosines)):
        raise Mismatch(where, "points of rising cosine, at least one", value)


def _check_schema(data: Any) -> None:
    if not isinstance(data, dict):
        raise Mismatch("", "an object", data)
    if data.get("schema", Missing()) != SCHEMA:
        raise Mismatch("schema", f"{SCHEMA}", data.get("schema", Missing()))


def _exponent(value: Any, where: str) -> None:
    if isinstance(value, list):
        list_of(_AMOUNT, 3)(value, where)
    else:
        number(0, note="a number of at least 0 or a list of 3")(value, where)


def _fit(extra: dict[str, Check], optional: dict[str, Check] | None = None) -> Check:
    shape = object_of(_FIT | extra, _FIT_EXTRAS | (optional or {}))

    def check(value: Any, where: str) -> None:
        shape(value, where)
        inside = f"{where}.parameters" if where else "parameters"
        parameters = value["parameters"]
        choice(value["model"])(parameters["model"], f"{inside}.model")
        if value["model"] == "interpolated":
            _INTERPOLATION(parameters["interpolation"], f"{inside}.interpolation")

    return check


def _models(value: Any, where: str) -> None:
    if not isinstance(value, dict):
        raise Mismatch(where, "an object", value)
    for model, fit in value.items():
        choice(*MODELS)(model, f"the key in {where}")
        _fit({"model": choice(model)})(fit, f"{where}.{model}")


def _angles(value: Any, where: str) -> None:
    list_of(_AMOUNT)(value, where)
    if len(value) < 2 or any(a >= b for a, b in itertools.pairwise(value)):
        raise Mismatch(where, "rising angles, at least two", value)


def _parts(*angles: str) -> Check:
    """Sums over the steps of these angles; of two angles a list for each step of the first."""

    def check(value: Any, where: str) -> None:
        object_of({angle: _angles for angle in angles})(value, where)
        sums = _AMOUNT
        for angle in reversed(angles):
            sums = list_of(sums, len(value[angle]) - 1)
        object_of({"misfit": sums, "measured": sums})(value, where)

    return check


def _rows(rows: dict[str, Check]) -> Check:
    """An entry for each view angle; `rows` tells what each entry of a list is."""

    def check(value: Any, where: str) -> None:
        object_of({"view_angle": list_of(_NUMBER)})(value, where)
        count = len(value["view_angle"])
        object_of({name: list_of(row, count) for name, row in rows.items()})(value, where)

    return check


def _variables_of(parameters: dict[str, Any]) -> Iterator[str]:
    """The variables that these parameters have numbers of."""
    for name in ("diffuse", "specular", "exponent", "interpolation", "ior"):
        if isinstance(parameters[name], list):
            yield from (f"{name} {channel}" for channel in _CHANNELS)
        elif parameters[name] is not None:
            yield name


def _uncertainty(value: Any, where: str) -> None:
    object_of({"low": _PARAMETERS, "high": _PARAMETERS})(value, where)
    high = set(_variables_of(value["high"]))
    known = [name for name in _variables_of(value["low"]) if name in high]
    object_of({"variables": list_of(choice(*known))})(value, where)
    names = value["variables"]
    object_of(
        {
            "confidence": _INTERPOLATION,
            "blocks": _COUNT,
            "seconds": _AMOUNT,
            "undetermined": list_of(choice(*names)),
            "correlation": list_of(list_of(_NUMBER, len(names)), len(names)),
        }
    )(value, where)


_TEXT = kind("text", lambda value: isinstance(value, str))
_FLAG = kind("true or false", lambda value: isinstance(value, bool))
_COUNT = kind(
    "a whole number of at least 0",
    lambda value: isinstance(value, int) and not isinstance(value, bool) and value >= 0,
)
_NUMBER = number(-math.inf)
_AMOUNT = number(0, note="a number of at least 0")
_INTERPOLATION = number(0, 1, "a number from 0 to 1")
_UNKNOWN = or_null(_NUMBER)
_COLOR = list_of(_AMOUNT, 3)
_UNKNOWN_COLOR = list_of(_UNKNOWN, 3)
_PARAMETERS = object_of(
    {
        "model": choice(*MODELS),
        "diffuse": _COLOR,
        "specular": _COLOR,
        "exponent": _exponent,
        "interpolation": or_null(_INTERPOLATION),
        "ior": or_null(number(1, note="a number of at least 1")),
    }
)
_FIGURE = object_of({"pooled": _UNKNOWN, "rgb": _UNKNOWN_COLOR})
_STAGE = object_of({"name": _TEXT, "l1": _UNKNOWN, "seconds": _AMOUNT, "iterations": _COUNT})
_PRINCIPLED = object_of(
    {
        "base_color": _COLOR,
        "metallic": _INTERPOLATION,
        "roughness": _INTERPOLATION,
        "ior": _AMOUNT,
        "specular_tint": _COLOR,
        "error": _UNKNOWN,
    }
)
_FIT: dict[str, Check] = {
    "model": choice(*MODELS),
    "parameters": _PARAMETERS,
    "error": object_of({name: _FIGURE for name in ERRORS}),
    "stages": list_of(_STAGE),
    "seconds": object_of({key: _AMOUNT for key in ("read", "start", "fit", "total")}),
    "converged": _FLAG,
    "certainty": object_of({"starts": _COUNT, "agree": _COUNT, "spread": _UNKNOWN}),
    "albedo": _rows({"measured": _UNKNOWN_COLOR, "model": _UNKNOWN_COLOR}),
    "warnings": list_of(_TEXT),
    "principled": _PRINCIPLED,
}
# What records of the first builds do not have.
_FIT_EXTRAS: dict[str, Check] = {
    "error_by_angle": or_null(
        object_of({"half_difference": _parts("theta_h", "theta_d"), "view": _parts("view_angle")})
    ),
    "uncertainty": or_null(_uncertainty),
}
_CLOSURES = object_of(
    {
        "target": choice("measured", "lobe"),
        "count": _COUNT,
        "cap_albedo": _FLAG,
        "error": _AMOUNT,
        "seconds": _AMOUNT,
        "by_view": _rows(
            {
                "target_albedo": _UNKNOWN_COLOR,
                "closures_albedo": _UNKNOWN_COLOR,
                "relative_error": _AMOUNT,
            }
        ),
        "diffuse": list_of(_curve, 3),
        "specular": list_of(
            object_of(
                {
                    "distribution": choice("ggx", "beckmann"),
                    "roughness": _curve,
                    "anisotropy": _curve,
                    "bend": _curve,
                    "weight": list_of(_curve, 3),
                }
            )
        ),
    }
)
_BINS = object_of({key: _COUNT for key in ("valid", "below_horizon", "negative", "non_finite")})
_RECORD = _fit(
    {
        "source": object_of(
            {"path": or_null(_TEXT), "sha256": or_null(_TEXT), "format": _TEXT, "bins": _BINS},
            {"name": _TEXT},
        ),
        "schedule": choice(*SCHEDULES),
        "norm": choice(*NORMS),
        "channels": choice("shared", "separate"),
        "max_angle": number(0, 90, "a number from 0 to 90"),
    },
    {
        "machine": object_of({"system": _TEXT, "processor": _TEXT, "threads": _COUNT}),
        "models": _models,
        "closures": list_of(_CLOSURES),
    },
)


def _record(data: Any, where: str) -> None:
    _check_schema(data)
    _RECORD(data, where)
