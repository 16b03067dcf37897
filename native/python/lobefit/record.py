"""The record: one JSON file that holds all a fit found out, and all that a material needs."""

import dataclasses
import itertools
import json
import math
import os
import platform
import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lobefit import _native
from lobefit._native import InputError
from lobefit.atomic import reason, write_bytes

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
        """The record as JSON; every number is exact when read back."""
        return json.dumps(dataclasses.asdict(self), indent=1, allow_nan=False) + "\n"

    @classmethod
    def from_json(cls, text: str | bytes, name: str = "record") -> "Record":
        """The record in `text`. Raises InputError with `name`, what was expected and found."""
        try:
            data = json.loads(text, parse_constant=_refuse_constant)
        except UnicodeDecodeError as error:
            raise InputError(f"{name}: expected a record in UTF-8, found other bytes.") from error
        except RecursionError as error:
            raise InputError(f"{name}: expected a record, found JSON nested too deeply.") from error
        except ValueError as error:
            raise InputError(f"{name}: expected a record in JSON, found {error}.") from error
        try:
            _check_schema(data)
            _RECORD(data, "")
        except _Mismatch as mismatch:
            raise InputError(f"{name}: {mismatch}.") from None
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
        try:
            text = Path(path).read_bytes()
        except IsADirectoryError:
            raise InputError(f"{path}: expected a record, found a folder.") from None
        except FileNotFoundError:
            raise InputError(f"{path}: expected a record, found no such file.") from None
        except OSError as error:
            raise InputError(f"{path}: cannot be read, {reason(error)}.") from error
        return cls.from_json(text, str(path))


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


# What a record looks like: each check takes a value and where it stands, and raises _Mismatch.

_Check = Callable[[Any, str], None]


class _Mismatch(Exception):
    def __init__(self, where: str, expected: str, found: Any) -> None:
        shown = found if isinstance(found, _Missing) else json.dumps(found)
        shown = f"{str(shown)[:40]}..." if len(str(shown)) > 43 else str(shown)
        super().__init__(f"expected {where or 'the record'} to be {expected}, found {shown}")


class _Missing:
    def __str__(self) -> str:
        return "nothing"


def _refuse_constant(name: str) -> float:
    raise ValueError(f"the constant {name}, which JSON does not have")


def _kind(expected: str, accepts: Callable[[Any], bool]) -> _Check:
    def check(value: Any, where: str) -> None:
        if not accepts(value):
            raise _Mismatch(where, expected, value)

    return check


def _is_number(value: Any) -> bool:
    # The comparison also holds for integers that are too large for a float.
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e308


def _number(low: float, high: float = math.inf, note: str = "a number") -> _Check:
    return _kind(note, lambda value: _is_number(value) and low <= value <= high)


def _choice(*names: str) -> _Check:
    return _kind(f"one of {', '.join(names)}", lambda value: value in names)


def _or_null(check: _Check) -> _Check:
    def checked(value: Any, where: str) -> None:
        if value is not None:
            check(value, where)

    return checked


def _list(item: _Check, length: int | None = None) -> _Check:
    expected = "a list" if length is None else f"a list of {length}"

    def check(value: Any, where: str) -> None:
        if not isinstance(value, list) or length not in (None, len(value)):
            raise _Mismatch(where, expected, value)
        for index, entry in enumerate(value):
            item(entry, f"{where}[{index}]")

    return check


def _curve(value: Any, where: str) -> None:
    _list(_list(_NUMBER, 2))(value, where)
    cosines = [cosine for cosine, _ in value]
    if not cosines or any(a >= b for a, b in itertools.pairwise(cosines)):
        raise _Mismatch(where, "points of rising cosine, at least one", value)


def _object(required: dict[str, _Check], optional: dict[str, _Check] | None = None) -> _Check:
    """An object with these keys; keys of a later version are no error."""

    def check(value: Any, where: str) -> None:
        if not isinstance(value, dict):
            raise _Mismatch(where, "an object", value)
        for key, item in (required | (optional or {})).items():
            if key in value or key in required:
                item(value.get(key, _Missing()), f"{where}.{key}" if where else key)

    return check


def _check_schema(data: Any) -> None:
    if not isinstance(data, dict):
        raise _Mismatch("", "an object", data)
    if data.get("schema", _Missing()) != SCHEMA:
        raise _Mismatch("schema", f"{SCHEMA}", data.get("schema", _Missing()))


def _exponent(value: Any, where: str) -> None:
    if isinstance(value, list):
        _list(_AMOUNT, 3)(value, where)
    else:
        _number(0, note="a number of at least 0 or a list of 3")(value, where)


def _fit(extra: dict[str, _Check], optional: dict[str, _Check] | None = None) -> _Check:
    shape = _object(_FIT | extra, _FIT_EXTRAS | (optional or {}))

    def check(value: Any, where: str) -> None:
        shape(value, where)
        inside = f"{where}.parameters" if where else "parameters"
        parameters = value["parameters"]
        _choice(value["model"])(parameters["model"], f"{inside}.model")
        if value["model"] == "interpolated":
            _INTERPOLATION(parameters["interpolation"], f"{inside}.interpolation")

    return check


def _models(value: Any, where: str) -> None:
    if not isinstance(value, dict):
        raise _Mismatch(where, "an object", value)
    for model, fit in value.items():
        _choice(*MODELS)(model, f"the key in {where}")
        _fit({"model": _choice(model)})(fit, f"{where}.{model}")


def _angles(value: Any, where: str) -> None:
    _list(_AMOUNT)(value, where)
    if len(value) < 2 or any(a >= b for a, b in itertools.pairwise(value)):
        raise _Mismatch(where, "rising angles, at least two", value)


def _parts(*angles: str) -> _Check:
    """Sums over the steps of these angles; of two angles a list for each step of the first."""

    def check(value: Any, where: str) -> None:
        _object({angle: _angles for angle in angles})(value, where)
        sums = _AMOUNT
        for angle in reversed(angles):
            sums = _list(sums, len(value[angle]) - 1)
        _object({"misfit": sums, "measured": sums})(value, where)

    return check


def _rows(rows: dict[str, _Check]) -> _Check:
    """An entry for each view angle; `rows` tells what each entry of a list is."""

    def check(value: Any, where: str) -> None:
        _object({"view_angle": _list(_NUMBER)})(value, where)
        count = len(value["view_angle"])
        _object({name: _list(row, count) for name, row in rows.items()})(value, where)

    return check


def _variables_of(parameters: dict[str, Any]) -> Iterator[str]:
    """The variables that these parameters have numbers of."""
    for name in ("diffuse", "specular", "exponent", "interpolation", "ior"):
        if isinstance(parameters[name], list):
            yield from (f"{name} {channel}" for channel in _CHANNELS)
        elif parameters[name] is not None:
            yield name


def _uncertainty(value: Any, where: str) -> None:
    _object({"low": _PARAMETERS, "high": _PARAMETERS})(value, where)
    high = set(_variables_of(value["high"]))
    known = [name for name in _variables_of(value["low"]) if name in high]
    _object({"variables": _list(_choice(*known))})(value, where)
    names = value["variables"]
    _object(
        {
            "confidence": _INTERPOLATION,
            "blocks": _COUNT,
            "seconds": _AMOUNT,
            "undetermined": _list(_choice(*names)),
            "correlation": _list(_list(_NUMBER, len(names)), len(names)),
        }
    )(value, where)


_TEXT = _kind("text", lambda value: isinstance(value, str))
_FLAG = _kind("true or false", lambda value: isinstance(value, bool))
_COUNT = _kind(
    "a whole number of at least 0",
    lambda value: isinstance(value, int) and not isinstance(value, bool) and value >= 0,
)
_NUMBER = _number(-math.inf)
_AMOUNT = _number(0, note="a number of at least 0")
_INTERPOLATION = _number(0, 1, "a number from 0 to 1")
_UNKNOWN = _or_null(_NUMBER)
_COLOR = _list(_AMOUNT, 3)
_UNKNOWN_COLOR = _list(_UNKNOWN, 3)
_PARAMETERS = _object(
    {
        "model": _choice(*MODELS),
        "diffuse": _COLOR,
        "specular": _COLOR,
        "exponent": _exponent,
        "interpolation": _or_null(_INTERPOLATION),
        "ior": _or_null(_number(1, note="a number of at least 1")),
    }
)
_FIGURE = _object({"pooled": _UNKNOWN, "rgb": _UNKNOWN_COLOR})
_STAGE = _object({"name": _TEXT, "l1": _UNKNOWN, "seconds": _AMOUNT, "iterations": _COUNT})
_PRINCIPLED = _object(
    {
        "base_color": _COLOR,
        "metallic": _INTERPOLATION,
        "roughness": _INTERPOLATION,
        "ior": _AMOUNT,
        "specular_tint": _COLOR,
        "error": _UNKNOWN,
    }
)
_FIT: dict[str, _Check] = {
    "model": _choice(*MODELS),
    "parameters": _PARAMETERS,
    "error": _object({name: _FIGURE for name in ERRORS}),
    "stages": _list(_STAGE),
    "seconds": _object({key: _AMOUNT for key in ("read", "start", "fit", "total")}),
    "converged": _FLAG,
    "certainty": _object({"starts": _COUNT, "agree": _COUNT, "spread": _UNKNOWN}),
    "albedo": _rows({"measured": _UNKNOWN_COLOR, "model": _UNKNOWN_COLOR}),
    "warnings": _list(_TEXT),
    "principled": _PRINCIPLED,
}
# What records of the first builds do not have.
_FIT_EXTRAS: dict[str, _Check] = {
    "error_by_angle": _or_null(
        _object({"half_difference": _parts("theta_h", "theta_d"), "view": _parts("view_angle")})
    ),
    "uncertainty": _or_null(_uncertainty),
}
_CLOSURES = _object(
    {
        "target": _choice("measured", "lobe"),
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
        "diffuse": _list(_curve, 3),
        "specular": _list(
            _object(
                {
                    "distribution": _choice("ggx", "beckmann"),
                    "roughness": _curve,
                    "anisotropy": _curve,
                    "bend": _curve,
                    "weight": _list(_curve, 3),
                }
            )
        ),
    }
)
_BINS = _object({key: _COUNT for key in ("valid", "below_horizon", "negative", "non_finite")})
_RECORD = _fit(
    {
        "source": _object(
            {"path": _or_null(_TEXT), "sha256": _or_null(_TEXT), "format": _TEXT, "bins": _BINS},
            {"name": _TEXT},
        ),
        "schedule": _choice(*SCHEDULES),
        "norm": _choice(*NORMS),
        "channels": _choice("shared", "separate"),
        "max_angle": _number(0, 90, "a number from 0 to 90"),
    },
    {
        "machine": _object({"system": _TEXT, "processor": _TEXT, "threads": _COUNT}),
        "models": _models,
        "closures": _list(_CLOSURES),
    },
)
