"""What has to be found out before a scene is simplified, in steps that change no data-block."""

from pathlib import Path
from typing import Any

import bpy

from .records import KEY
from .scene_budget import problem_of
from .scene_view import View, look, problem_of_camera, sampled_frames

MOST_CLOSURES = 3


class Survey:
    """Looks at the current scene frame by frame, then finds closures that records lack.

    `views` are the frames looked at, `records` those of the materials that may be changed, by
    `session_uid`, and `skipped` says of other measured materials why not. `problem` is a sentence
    when the survey could not be made. It has what `operators.run` asks of work under way.
    """

    def __init__(self, context: bpy.types.Context, frames: int) -> None:
        self.frames = sampled_frames(context.scene, frames)
        self.views: list[View] = []
        self.records: dict[int, Any] = {}
        self.skipped: dict[int, str] = {}
        self.problem = problem_of_camera(context.scene)
        self._scene_uid = context.scene.session_uid
        self._missing: list[int] | None = None
        self._job: Any = None
        for material in bpy.data.materials:
            if KEY in material:
                self._read(material)

    @property
    def done(self) -> bool:
        """Whether nothing is left to find out, or nothing can be."""
        return bool(self.problem) or self._missing == []

    @property
    def progress(self) -> float:
        """The share that is done, from 0 to 1; frames are one half of the work."""
        if self.done:
            return 1.0
        if self._missing is None:
            return 0.5 * len(self.views) / len(self.frames)
        found = self._job.progress if self._job else 0.0
        return 0.5 + 0.5 * (found + self._had - len(self._missing)) / self._had

    @property
    def text(self) -> str:
        """What is being done."""
        if self.done:
            return "Done"
        if self._missing is None:
            return f"Frame {self.frames[len(self.views)]}"
        return f"Closures of {self.records[self._missing[0]].name}"

    def advance(self, seconds: float) -> bool:
        """Looks at one frame, or waits at most `seconds` for closures; says whether all is done."""
        if self.done:
            return True
        if self._missing is None:
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

    def _read(self, material: bpy.types.Material) -> None:
        import lobefit

        uid = material.session_uid
        reason = problem_of(material)
        if not reason:
            try:
                self.records[uid] = lobefit.Record.from_json(material[KEY], material.name)
                return
            except (lobefit.InputError, TypeError):
                reason = "its record cannot be read"
        self.skipped[uid] = reason

    def _look(self) -> None:
        if bpy.context.scene.session_uid != self._scene_uid:
            self.problem = "Another scene was chosen while this one was being looked at."
            return
        try:
            self.views.append(look(bpy.context, self.frames[len(self.views)]))
        except ValueError as problem:
            self.problem = str(problem)
            return
        if len(self.views) == len(self.frames):
            present = self.present()
            self._missing = [uid for uid in self.records if uid in present and self._lacks(uid)]
            self._had = len(self._missing)

    def _lacks(self, uid: int) -> list[int]:
        """Which numbers of closures the record has no entry for, if its measurement is there."""
        record = self.records[uid]
        known = {entry["count"] for entry in record.closures if entry["target"] == "measured"}
        lacking = [count for count in range(MOST_CLOSURES + 1) if count not in known]
        path = record.source["path"]
        return lacking if path and Path(path).is_file() else []

    def _find_closures(self, seconds: float) -> None:
        import lobefit

        uid = self._missing[0]
        try:
            if self._job is None:
                wanted = [lobefit.Closures("measured", count) for count in self._lacks(uid)]
                self._job = lobefit.start_fit(self.records[uid], closures=wanted)
            if not self._job.wait(seconds):
                return
            self.records[uid] = self._job.record()
        except (lobefit.InputError, MemoryError):
            # The choice is then among what the record holds.
            pass
        self._job = None
        self._missing.pop(0)
