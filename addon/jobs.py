"""Work that an operator waits for: C++ jobs of their own threads. Nothing here needs bpy."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol


class Work(Protocol):
    """What is done bit by bit: fits, or looking at a scene."""

    @property
    def progress(self) -> float:
        """The share that is done, from 0 to 1."""

    @property
    def text(self) -> str:
        """What is being done."""

    def advance(self, seconds: float) -> bool:
        """Goes on for about `seconds` or one indivisible bit; says whether all is done."""

    def stop(self) -> None:
        """Ends what runs in threads of its own."""


class Outcome(NamedTuple):
    """What became of a file or record: its record, or the sentence why there is none."""

    path: str  # of a record its name
    record: Any = None
    problem: str = ""


class Batch:
    """Files to fit, or records to add closures to, one after another, and what became of them."""

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


class Estimate:
    """Normals from shading under way; `problem` says why there are none."""

    def __init__(self, job: Any) -> None:
        self.surface: Any = None
        self.problem = ""
        self._job = job

    @property
    def progress(self) -> float:
        """The share that is done, from 0 to 1."""
        return self._job.progress

    @property
    def text(self) -> str:
        """What is being done."""
        return f"Normals from shading: {self._job.stage}"

    def advance(self, seconds: float) -> bool:
        """Waits at most `seconds` for the end; says whether it is reached."""
        if not self._job.wait(seconds):
            return False
        try:
            self.surface = self._job.surface()
        except MemoryError:
            self.problem = "Expected enough memory, found too little."
        return True

    def stop(self) -> None:
        """Ends the job; its threads are gone when it is."""
        self._job.cancel()
