"""Fits in the background: a job to ask for its progress, and a call that waits for one."""

import os
from collections.abc import Callable
from typing import Any

from lobefit import _native
from lobefit._native import Cancelled, Measurement
from lobefit.origin import Origin, origin_of
from lobefit.record import MODELS, Fit, Record, figure_of, without_nan

Source = str | os.PathLike[str] | Measurement

_POLL = 0.05  # seconds between two looks at a job that is waited for
_FIT_KEYS = tuple(Fit.__dataclass_fields__)
_RECORD_KEYS = ("schedule", "norm", "channels", "max_angle")


def read(path: str | os.PathLike[str]) -> Measurement:
    """The measurement in the file `path` (MERL `.binary`), values in 1/sr, NaN in invalid bins.

    Raises InputError with one sentence for anything that is not such a file.
    """
    return Measurement.read(os.fspath(path))


class Job:
    """A fit under way in threads of its own; it starts at once and never holds Python up.

    `model` is one of `record.MODELS`, or "all" for one after the other. `fresnel` False fits the
    models without the Fresnel term. `schedule` is "stages" (the three of Nielsen et al.) or
    "polish" (a joint fit after them). `norm` is "l1" (the paper's), "cosine-l1", "l2" or "log-l2".
    `max_angle` in degrees (up to 90) leaves out light and view directions beyond it. `channels` is
    "shared" (one exponent) or "separate". `threads` 0 takes every processor.
    """

    def __init__(self, source: Source, model: str = "interpolated", **options: Any) -> None:
        self._source = source if isinstance(source, Measurement) else os.fspath(source)
        self._options = options
        self._models = list(MODELS) if model == "all" else [model]
        self._results: list[dict[str, Any]] = []
        self._cancelled = False
        self._running: _native.FitJob | None = self._start()

    @property
    def progress(self) -> float:
        """The share that is done, from 0 to 1."""
        now = 0.0 if self._running is None else self._running.progress
        return (len(self._results) + now) / len(self._models)

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
        if self._running is None:
            return True
        if not self._running.wait(seconds):
            return False
        if self._cancelled or len(self._results) + 1 == len(self._models):
            return True
        self._results.append(self._running.result())
        self._running = self._start()
        return False

    def record(self) -> Record:
        """Waits for the end and tells what was found.

        Raises InputError for a source that cannot be fitted and Cancelled after `cancel`.
        """
        while not self.wait(_POLL):
            pass
        if self._cancelled:
            raise Cancelled("the fit was cancelled")
        if self._running is not None:
            self._results.append(self._running.result())
            self._running = None
        return _record(self._results, self._origin())

    def _start(self) -> _native.FitJob:
        return _native.FitJob(self._source, model=self._models[len(self._results)], **self._options)

    def _origin(self) -> Origin:
        return origin_of(self._source) if isinstance(self._source, str) else Origin()


def start_fit(source: Source, **options: Any) -> Job:
    """Starts the fit of a file or a measurement; options are those of `Job`."""
    return Job(source, **options)


def fit(
    source: Source, *, progress: Callable[[float, str], None] | None = None, **options: Any
) -> Record:
    """The record of a fit of a file or a measurement, waited for; options are those of `Job`.

    `progress` is called with the share done (0 to 1) and the stage some twenty times a second. An
    exception out of it, or Ctrl-C, ends the fit.
    """
    job = start_fit(source, **options)
    try:
        while not job.wait(_POLL):
            if progress:
                progress(job.progress, job.stage)
        return job.record()
    except BaseException:
        job.cancel()
        raise


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
