"""How an operator does long work: polled by a timer in a window, waited for elsewhere."""

from collections.abc import Sequence
from typing import Any, Protocol

import bpy

from .. import native
from ..jobs import Batch, Outcome
from ..nodes.material import choose
from ..properties import FitOptions

_POLL = 0.1  # seconds between two looks at a fit


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


class Run:
    """Work under way in a window, with the timer that looks after it."""

    def __init__(self, context: bpy.types.Context, batch: Work) -> None:
        self.batch = batch
        self._timer = context.window_manager.event_timer_add(_POLL, window=context.window)

    def end(self) -> None:
        """Ends the work, the timer and what is shown of them."""
        global _current
        self.batch.stop()
        bpy.context.window_manager.event_timer_remove(self._timer)
        _current = None
        redraw()


_current: Run | None = None


def current() -> Run | None:
    """The run under way, if there is one; a Blender has one at most."""
    return _current


def redraw() -> None:
    """Draws anew what shows the progress: the panel and the status bar."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()
    # The status bar is no area of the screen; it follows its text.
    if bpy.context.workspace:
        bpy.context.workspace.status_text_set(None)


class RunsWork:
    """What the operators that work for long have in common; each concludes in its own way."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if current():
            cls.poll_message_set("Lobefit is at work: wait for it or cancel it")
        return current() is None

    def conclude(self, context: bpy.types.Context, work: Any) -> set[str]:
        """Called once when all is done; only here are data-blocks changed."""
        raise TypeError(f"{type(self).__name__} does not say what becomes of its work")

    def start(self, context: bpy.types.Context, work: Work) -> set[str]:
        """Does the work: in the background of a window, or waiting where nobody looks on."""
        global _current
        if bpy.app.background or not self.options.is_invoke:
            while not work.advance(_POLL):
                pass
            return self.conclude(context, work)
        _current = Run(context, work)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        run = current()
        if run is None:  # cancelled by its button
            self.report({"INFO"}, "Cancelled, nothing was changed")
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            run.end()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            done = run.batch.advance(0.0)
        except BaseException:
            run.end()
            raise
        if not done:
            redraw()
            return {"PASS_THROUGH"}
        run.end()
        return self.conclude(context, run.batch)

    def cancel(self, context: bpy.types.Context) -> None:
        """Called by Blender when it drops the operator, as when another file is opened."""
        if current():
            current().end()

    def refuse(self, sentence: str) -> set[str]:
        """Reports why nothing was done."""
        self.report({"ERROR"}, sentence)
        return {"CANCELLED"}


class RunsFits(FitOptions, RunsWork):
    """What the operators that fit have in common; each says in `apply` what it does at the end."""

    def apply(self, context: bpy.types.Context, done: list[Outcome]) -> str:
        """Changes the data-blocks; returns a sentence instead when they are no longer there."""
        raise TypeError(f"{type(self).__name__} does not say what becomes of its fits")

    def fit(self, context: bpy.types.Context, paths: Sequence[str]) -> set[str]:
        """Fits the files."""
        problem = native.problem()
        if problem:
            return self.refuse(problem)
        return self.start(context, Batch(paths, self.fit_options()))

    def conclude(self, context: bpy.types.Context, work: Batch) -> set[str]:
        outcomes = work.outcomes
        done = [outcome for outcome in outcomes if outcome.record]
        for outcome in outcomes:
            if outcome.problem:
                self.report({"WARNING" if done else "ERROR"}, outcome.problem)
        if not done:
            return {"CANCELLED"}
        problem = self.apply(context, done)
        if problem:
            return self.refuse(problem)
        for outcome in done:
            record = outcome.record
            shown = choose(record, **self.material_options())
            seconds = record.seconds["total"] + sum(entry["seconds"] for entry in record.closures)
            message = f"{record.name}: {shown.error(record):.1%} off, fitted in {seconds:.1f} s"
            self.report({"INFO"}, message)
        # The file browser pushes its own step before a fit that begins there, so that the flag
        # UNDO would leave two.
        bpy.ops.ed.undo_push(message=self.bl_label)
        return {"FINISHED"}
