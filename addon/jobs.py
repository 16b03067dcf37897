"""Fits of files or records one after another, each a C++ job; none waits for long or needs bpy."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple


class Outcome(NamedTuple):
    """What became of a file or record: its record, or the sentence why there is none."""

    path: str  # of a record its name
    record: Any = None
    problem: str = ""


class Batch:
    """The files to fit, or records to add closures to, and what became of those already done."""

    def __init__(self, sources: Sequence[Any], options: dict[str, Any]) -> None:
        self.outcomes: list[Outcome] = []
        self._sources = list(sources)
        self._options = options
        self._job: Any = None

    @property
    def done(self) -> bool:
        """Whether every file has its outcome."""
        return len(self.outcomes) == len(self._sources)

    @property
    def progress(self) -> float:
        """The share that is done, from 0 to 1."""
        return (len(self.outcomes) + (self._job.progress if self._job else 0.0)) / len(
            self._sources
        )

    @property
    def text(self) -> str:
        """Which file is being fitted, and the stage the fit is in."""
        if self.done:
            return "Done"
        name = Path(self._name).name
        return f"{name}: {self._job.stage}" if self._job and self._job.stage else name

    def advance(self, seconds: float) -> bool:
        """Gives the fit under way at most `seconds`; says whether every file is done."""
        import lobefit

        source, path = self._sources[len(self.outcomes)], self._name
        try:
            if self._job is None:
                self._job = lobefit.start_fit(source, **self._options)
            if not self._job.wait(seconds):
                return False
            outcome = Outcome(path, record=self._job.record())
        except (lobefit.InputError, MemoryError) as problem:
            outcome = Outcome(path, problem=str(problem) or f"{path}: not enough memory to fit it.")
        self._job = None
        self.outcomes.append(outcome)
        return self.done

    def stop(self) -> None:
        """Ends the fit under way; its threads are gone when this returns."""
        if self._job is not None:
            self._job.cancel()
            self._job = None

    @property
    def _name(self) -> str:
        source = self._sources[len(self.outcomes)]
        return source if isinstance(source, str) else source.name
