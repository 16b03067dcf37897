"""What has to be found out before a scene is simplified, in steps that change no data-block."""

from typing import Any

import bpy

from .locks import problem_of
from .records import KEY
from .scene_view import View, evenly, look, problem_of_camera


class Survey:
    """Looks at the current scene frame by frame, then finds closures that records lack.

    `views` are the frames looked at, `records` those of the materials that may be changed, by
    `session_uid`, and `skipped` says of other measured materials why not. Materials that carry the
    same text share a record. `problem` is a sentence when the survey could not be made. It has what
    `operators.run` asks of work under way.
    """

    def __init__(self, context: bpy.types.Context, frames: int) -> None:
        scene = context.scene
        self.frames = evenly(scene.frame_start, scene.frame_end, frames)
        self.views: list[View] = []
        self.records: dict[int, Any] = {}
        self.skipped: dict[int, str] = {}
        self.problem = problem_of_camera(scene)
        self._scene_uid = scene.session_uid
        # Records and the closures they lack; not known before all frames were looked at.
        self._lacking: list[tuple[Any, list[Any]]] | None = None
        self._lacked = 0
        self._job: Any = None
        self._read()

    @property
    def done(self) -> bool:
        """Whether nothing is left to find out, or nothing can be."""
        return bool(self.problem) or self._lacking == []

    @property
    def progress(self) -> float:
        """The share that is done, from 0 to 1; frames are one half of the work."""
        if self.done:
            return 1.0
        if self._lacking is None:
            return 0.5 * len(self.views) / len(self.frames)
        found = self._job.progress if self._job else 0.0
        return 0.5 + 0.5 * (found + self._lacked - len(self._lacking)) / self._lacked

    @property
    def text(self) -> str:
        """What is being done."""
        if self.done:
            return "Done"
        if self._lacking is None:
            return f"Frame {self.frames[len(self.views)]}"
        return f"Closures of {self._lacking[0][0].name}"

    def advance(self, seconds: float) -> bool:
        """Looks at one frame, or waits at most `seconds` for closures; says whether all is done."""
        if bpy.context.scene.session_uid != self._scene_uid:
            self.problem = "Another scene was chosen while this one was being looked at."
        if self.done:
            return True
        if self._lacking is None:
            self._look()
        else:
            self._find_closures(seconds)
        return self.done

    def stop(self) -> None:
        """Ends what runs in threads of its own; they are gone when this returns."""
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def present(self) -> set[int]:
        """The materials of all objects in the frames looked at."""
        return set().union(*(view.present for view in self.views))

    def _read(self) -> None:
        import lobefit

        known: dict[str, Any] = {}
        for material in bpy.data.materials:
            if KEY not in material:
                continue
            uid, text, reason = material.session_uid, material[KEY], problem_of(material)
            try:
                if not reason and text not in known:
                    known[text] = lobefit.Record.from_json(text, material.name)
            except (lobefit.InputError, TypeError):
                reason = "its record cannot be read"
            if reason:
                self.skipped[uid] = reason
            else:
                self.records[uid] = known[text]

    def _look(self) -> None:
        try:
            self.views.append(look(bpy.context, self.frames[len(self.views)]))
        except ValueError as problem:
            self.problem = str(problem)
            return
        if len(self.views) == len(self.frames):
            present = self.present()
            records = {id(record): record for uid, record in self.records.items() if uid in present}
            lacking = [(record, _lacks(record)) for record in records.values()]
            self._lacking = [(record, closures) for record, closures in lacking if closures]
            self._lacked = len(self._lacking)

    def _find_closures(self, seconds: float) -> None:
        import lobefit

        before, closures = self._lacking[0]
        after = before
        try:
            if self._job is None:
                self._job = lobefit.start_fit(before, closures=closures)
            if not self._job.wait(seconds):
                return
            after = self._job.record()
        except (lobefit.InputError, MemoryError):
            # The choice is then among what the record holds.
            pass
        self._job = None
        self._lacking.pop(0)
        for uid, record in self.records.items():
            if record is before:
                self.records[uid] = after


def _lacks(record: Any) -> list[Any]:
    """The closures that the record has no entry for, if its measurement is there."""
    from lobefit.fitting import MOST_CLOSURES, Closures
    from lobefit.origin import is_unchanged

    measured = [entry for entry in record.closures if entry["target"] == "measured"]
    known = {entry["count"] for entry in measured}
    capped = any(entry["cap_albedo"] for entry in measured)
    lacking = [
        Closures("measured", count, cap_albedo=capped)
        for count in range(MOST_CLOSURES + 1)
        if count not in known
    ]
    return lacking if lacking and is_unchanged(record.source) else []
