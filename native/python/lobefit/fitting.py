"""Fits in the background: a job to ask for its progress, and calls that wait for one."""

import dataclasses
import math
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lobefit import _native, memory
from lobefit._native import Cancelled, InputError, Measurement
from lobefit.origin import Origin, OriginSearch, read_unchanged, stamp_of
from lobefit.record import MODELS, Fit, Record, figure_of, without_nan

Source = str | os.PathLike[str] | Measurement

TARGETS = ("measured", "lobe")
MOST_CLOSURES = 3
# Up to which part of the light that is off the kind `auto` takes a material, if not told.
TOLERANCE = 0.05

# What a job takes beside the model.
_OPTIONS = frozenset(
    ("fresnel", "schedule", "norm", "max_angle", "channels", "uncertainty", "threads")
)
_MEMORY = 1 << 28  # bytes that a job has room in
_POLL = 0.05  # seconds between two looks at a job that is waited for
_SLICE = 0.01  # seconds to spend on the origin where there is no time to wait
_FIT_KEYS = tuple(Fit.__dataclass_fields__)
_RECORD_KEYS = ("schedule", "norm", "channels", "max_angle")


def read(path: str | os.PathLike[str]) -> Measurement:
    """The measurement in the file `path`, values in 1/sr, NaN in invalid bins.

    The file is a MERL table (`.binary`) or an RGL measurement (`.bsdf`), told apart by what is in
    it. Raises InputError with one sentence for anything that is not such a file.
    """
    return Measurement.read(os.fspath(path))


@dataclass(frozen=True)
class Closures:
    """A request for an approximation by a diffuse closure and `count` specular ones (0 to 3).

    `target` is "measured", the measurement itself, or "lobe", the fitted model. With a `tolerance`
    (a part of the light of a picture of a sphere) as few closures are taken as keep to it, and
    `count` counts for nothing. `cap_albedo` keeps the albedo at 1 or less where the target, as
    measurements do, exceeds it; it never exceeds the target's by more than 2 %.
    """

    target: str = "measured"
    count: int = 2
    tolerance: float | None = None
    cap_albedo: bool = False

    def __post_init__(self) -> None:
        if self.target not in TARGETS:
            raise InputError(f"target: expected measured or lobe, found {self.target!r}.")
        if not 0 <= self.count <= MOST_CLOSURES:
            raise InputError(f"closures: expected 0 to {MOST_CLOSURES}, found {self.count}.")

    def is_in(self, record: Record) -> bool:
        """Whether the record already holds what is asked for.

        Never with a tolerance: what the record holds need not be the fewest.
        """
        asked = (self.target, self.count, self.cap_albedo)
        return self.tolerance is None and any(
            (entry["target"], entry["count"], entry["cap_albedo"]) == asked
            for entry in record.closures
        )


def closures_for(
    kind: str, count: int = 2, tolerance: float = TOLERANCE, cap_albedo: bool = False
) -> list[Closures]:
    """The closures that a material of this kind shows, to be asked of a fit; see build_material."""
    if kind == "auto":
        return [Closures("measured", tolerance=tolerance, cap_albedo=cap_albedo)]
    return [Closures(kind, count, cap_albedo=cap_albedo)] if kind in TARGETS else []


class Job:
    """A fit under way in threads of its own; it starts at once and never holds Python up.

    `source` is a file, a measurement, or a record, whose fit is then kept. `model` is one of
    `record.MODELS`, or "all" for one after the other. `closures` are approximations to find after
    the fit. `fresnel` False fits the models without the Fresnel term. `schedule` is "polish" (all
    parameters jointly, from many starts on a subsample, and the best on all bins), "subsample" (the
    same without its end on all bins), "joint" (on all bins from the best start) or "stages" (there,
    the three of Nielsen et al.). `norm` is "l1" (the paper's),
    "cosine-l1", "l2" or "log-l2". `max_angle` in degrees (up to 90) leaves out light and view
    directions beyond it. `channels` is "shared" (one exponent) or "separate". `uncertainty` True
    also finds how well the data determine the parameters, which takes up to three times as long as
    the fit itself (metals). `threads` 0 takes every processor. Raises MemoryError where there is
    too little to begin.
    """

    def __init__(
        self,
        source: Source | Record,
        model: str = "interpolated",
        closures: Sequence[Closures] = (),
        **options: Any,
    ) -> None:
        if unknown := sorted(options.keys() - _OPTIONS):
            expected = ", ".join(sorted(_OPTIONS))
            raise TypeError(f"expected options among {expected}, found '{unknown[0]}'")
        memory.need(_MEMORY)
        self._options = options
        self._closures = list(closures)
        self._fitted: list[dict[str, Any]] = []
        self._found: list[dict[str, Any]] = []
        self._record: Record | None = None
        self._measurement: Measurement | None = None
        self._source: Source = ""
        self._models: list[str] = []
        if isinstance(source, Record):
            self._record = source
        else:
            self._source = source if isinstance(source, Measurement) else os.fspath(source)
            self._models = list(MODELS) if model == "all" else [model]
        from_file = isinstance(self._source, str) and bool(self._models)
        self._origin = OriginSearch(self._source) if from_file else None
        self._stamp = stamp_of(self._source) if from_file else None
        self._failure: InputError | None = None
        self._cancelled = False
        self._running: _native.FitJob | _native.ClosureJob | None = None
        self._begin_next()

    @property
    def progress(self) -> float:
        """The share that is done, from 0 to 1."""
        now = 0.0 if self._running is None else self._running.progress
        done = len(self._fitted) + len(self._found)
        return (done + now) / max(1, len(self._models) + len(self._closures))

    @property
    def stage(self) -> str:
        """What is being done, in a word or two."""
        return "" if self._running is None else self._running.stage

    @property
    def done(self) -> bool:
        """Whether `record` would answer at once, with a record or an error."""
        return self.wait(0.0)

    def cancel(self) -> None:
        """Asks the job to end soon without a record."""
        self._cancelled = True
        if self._running is not None:
            self._running.cancel()

    def wait(self, seconds: float) -> bool:
        """Waits at most `seconds` for the end; says whether it is reached."""
        end = time.perf_counter() + seconds
        known = self._knows_origin(max(seconds, _SLICE))
        if self._running is not None:
            if not self._running.wait(max(0.0, end - time.perf_counter())):
                return False
            try:
                result = self._running.result()
            except Exception:  # which `record` raises
                return True
            if self._cancelled:
                return True
            self._take(without_nan(result))
            try:
                self._begin_next()
            except InputError as error:
                self._failure = error
                return True
        return known and self._running is None

    def record(self) -> Record:
        """Waits for the end and tells what was found.

        Raises InputError for a source that cannot be fitted and Cancelled after `cancel`.
        """
        while not self.wait(_POLL):
            pass
        if self._cancelled:
            raise Cancelled("the fit was cancelled")
        if self._failure is not None:
            raise self._failure
        if self._running is not None:
            self._running.result()  # raises what ended it
        record = self._base_record()
        fresh = {(entry["target"], entry["count"]) for entry in self._found}
        kept = [e for e in record.closures if (e["target"], e["count"]) not in fresh]
        found = sorted(kept + self._found, key=lambda e: (e["target"], e["count"]))
        return dataclasses.replace(record, closures=found)

    def _base_record(self) -> Record:
        if self._record is None:
            origin = self._origin.advance(math.inf) if self._origin else None
            self._check_source()
            self._record = _record(self._fitted, origin or Origin())
        return self._record

    def _knows_origin(self, seconds: float) -> bool:
        """Learns for so long where the measurement comes from, while the threads are busy."""
        try:
            return self._origin is None or self._origin.advance(seconds) is not None
        except InputError:  # the reader's to tell of, in the threads, or else that of `record`
            return True

    def _check_source(self) -> None:
        """Raises InputError where what was read and what the record will name may differ."""
        if self._origin and stamp_of(self._source) != self._stamp:
            raise InputError(
                f"{self._source}: expected a file that stays as it is while it is fitted, found "
                "that it changed."
            )

    def _begin_next(self) -> None:
        self._running = None
        if len(self._fitted) < len(self._models):
            model = self._models[len(self._fitted)]
            self._running = _native.FitJob(self._source, model=model, **self._options)
        elif len(self._found) < len(self._closures):
            request = self._closures[len(self._found)]
            self._began = time.perf_counter()
            self._running = _native.ClosureJob(
                self._target(request),
                count=request.count if request.tolerance is None else -1,
                tolerance=request.tolerance or 0.0,
                cap_albedo=request.cap_albedo,
                threads=self._options.get("threads", 0),
            )

    def _take(self, result: dict[str, Any]) -> None:
        """Keeps what the job under way has found."""
        if isinstance(self._running, _native.FitJob):
            result["error_by_angle"] = _rounded(result["error_by_angle"])
            self._fitted.append(result)
            self._measurement = self._running.measurement
            return
        request = self._closures[len(self._found)]
        count = request.count if request.tolerance is None else len(result["specular"])
        asked = {"target": request.target, "count": count, "cap_albedo": request.cap_albedo}
        seconds = time.perf_counter() - self._began
        self._found.append(asked | result | {"seconds": seconds})

    def _target(self, request: Closures) -> Measurement | dict[str, Any]:
        if request.target == "lobe":
            return self._base_record().parameters
        if self._measurement is None:
            record = self._base_record()
            self._measurement = read_unchanged(record.source)
            if self._measurement is None:
                path = record.source["path"]
                found = "another file" if path and Path(path).is_file() else "no such file"
                raise InputError(
                    f"{path or record.name}: expected the measurement of the record, found {found}."
                )
        return self._measurement


def start_fit(source: Source | Record, **options: Any) -> Job:
    """Starts the fit of a file or a measurement; options are those of `Job`."""
    return Job(source, **options)


def fit(
    source: Source | Record, *, progress: Callable[[float, str], None] | None = None, **options: Any
) -> Record:
    """The record of a fit of a file or a measurement, waited for; options are those of `Job`.

    `progress` is called with the share done (0 to 1) and the stage some twenty times a second. An
    exception out of it, or Ctrl-C, ends the fit.
    """
    return wait_for(start_fit(source, **options), progress).record()


def closures(
    source: Source | Record,
    *,
    target: str = "measured",
    count: int = 2,
    tolerance: float | None = None,
    cap_albedo: bool = False,
    progress: Callable[[float, str], None] | None = None,
    **options: Any,
) -> Record:
    """The record of a file, a measurement or a record with an approximation by closures added.

    `target`, `count`, `tolerance` and `cap_albedo` are those of `Closures`; `options` are those of
    `Job`, for the fit of what is not a record yet. Raises InputError where the measurement of a
    record is no longer there.
    """
    request = Closures(target, count, tolerance, cap_albedo)
    return wait_for(Job(source, closures=[request], **options), progress).record()


def wait_for(job: Any, progress: Callable[[float, str], None] | None = None) -> Any:
    """Waits for the end of a job and returns it; an exception on the way cancels the job.

    `progress` is called with the share done (0 to 1) and the stage some twenty times a second.
    """
    try:
        while not job.wait(_POLL):
            if progress:
                progress(job.progress, job.stage)
    except BaseException:
        job.cancel()
        raise
    return job


def _rounded(value: Any) -> Any:
    """Five digits of every number, which keeps the hundreds of a map from filling the record."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list) else float(f"{value:.5g}")


def _record(results: list[dict[str, Any]], origin: Origin) -> Record:
    """One record of the fits of one measurement; the one with the least error speaks for it."""
    results = [without_nan(result) for result in results]
    figure = figure_of(results[0]["norm"])
    best = min(results, key=lambda result: result["error"][figure]["pooled"])
    fits = {result["model"]: Fit(**{key: result[key] for key in _FIT_KEYS}) for result in results}
    return Record(
        **{key: best[key] for key in _FIT_KEYS + _RECORD_KEYS},
        source={**origin.entries(), "format": best["format"], "bins": best["bins"]},
        models=fits if len(fits) > 1 else {},
    )
