"""How an operator does long work: polled by a timer in a window, waited for elsewhere."""

import time
from collections.abc import Generator, Sequence
from typing import TYPE_CHECKING, Any

import bpy

from .. import nodes
from ..properties import FitOptions

if TYPE_CHECKING:  # It is loaded when it is used: Blender starts as soon as before.
    from ..jobs import Batch, Outcome, Work

POLL = 0.05  # seconds between two looks at a fit
_MOST_LINES = 20  # of a pop-up that says what became of several files
# The editors that show progress, and the region of each that does.
_SHOWING = {"PROPERTIES": "WINDOW", "NODE_EDITOR": "UI"}

# What becomes of work that is done, step by step; Blender draws meanwhile. Its end is the
# operator's result, and when it is closed before that, it takes back what it did.
Conclusion = Generator[None, None, set[str]]


class Run:
    """Work of an operator under way in a window, with the timer that looks after it."""

    def __init__(self, context: bpy.types.Context, work: "Work") -> None:
        self.work = work
        self.conclusion: Conclusion | None = None
        self._began = time.monotonic()
        self._timer = context.window_manager.event_timer_add(POLL, window=context.window)

    @property
    def progress(self) -> float:
        """The share that is done, from 0 to 1."""
        return self.work.progress

    @property
    def text(self) -> str:
        """What is being done, and about how long all of the rest will take."""
        spent, done = time.monotonic() - self._began, self.progress
        # Too early nothing can be said, and what takes no time needs no word.
        if spent < 1 or not 0.05 < done < 1:
            return self.work.text
        return f"{self.work.text}, {spent * (1 - done) / done:.0f} s left"

    def end(self) -> None:
        """Ends the work, the timer and what is shown of them; half a conclusion is taken back."""
        global _current
        _current = None
        self.work.stop()
        bpy.context.window_manager.event_timer_remove(self._timer)
        if self.conclusion is not None:
            self.conclusion.close()
        redraw()


_current: Run | None = None


def current() -> Run | None:
    """The run under way, if there is one; a Blender has one at most."""
    return _current


def redraw() -> None:
    """Draws anew what shows the progress: the panels and the status bar."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if region.type == _SHOWING.get(area.type):
                    region.tag_redraw()
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

    def conclude_in_steps(self, context: bpy.types.Context, work: Any) -> Conclusion:
        """The same where it takes so long that Blender should draw in between."""
        yield from ()
        return self.conclude(context, work)

    def start(self, context: bpy.types.Context, work: "Work") -> set[str]:
        """Does the work: in the background of a window, or waiting where nobody looks on."""
        global _current
        if bpy.app.background or not self.options.is_invoke:
            while not work.advance(POLL):
                pass
            return _result_of(self.conclude_in_steps(context, work))
        _current = self._run = Run(context, work)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        run = self._run
        if run is not current():  # ended by its button, by Esc or by another's hand
            self.report({"INFO"}, "Cancelled, nothing was changed")
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            run.end()
            return {"RUNNING_MODAL"}
        if event.type == "TIMER":
            return self._go_on(context, run)
        # Nobody may undo or change what a conclusion is at.
        return {"PASS_THROUGH"} if run.conclusion is None else {"RUNNING_MODAL"}

    def _go_on(self, context: bpy.types.Context, run: Run) -> set[str]:
        try:
            if run.conclusion is not None:
                next(run.conclusion)
            elif run.work.advance(0.0):
                run.conclusion = self.conclude_in_steps(context, run.work)
        except StopIteration as stop:
            run.end()
            return stop.value
        except BaseException:
            run.end()
            raise
        redraw()
        return {"PASS_THROUGH"} if run.conclusion is None else {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Called by Blender when it drops the operator, as when another file is opened."""
        if self._run is current():
            self._run.end()

    def refuse(self, sentence: str) -> set[str]:
        """Reports why nothing was done."""
        self.report({"ERROR"}, sentence)
        return {"CANCELLED"}


def _result_of(conclusion: Conclusion) -> set[str]:
    """All steps of it at once."""
    while True:
        try:
            next(conclusion)
        except StopIteration as stop:
            return stop.value


class RunsFits(FitOptions, RunsWork):
    """What the operators that fit have in common; each says in `apply` what it does at the end."""

    def apply(
        self, context: bpy.types.Context, done: list["Outcome"]
    ) -> Generator[None, None, str]:
        """Changes the data-blocks in steps; its end is a sentence where that is not possible."""
        raise TypeError(f"{type(self).__name__} does not say what becomes of its fits")

    def fit(self, context: bpy.types.Context, paths: Sequence[str]) -> set[str]:
        """Fits the files."""
        from ..jobs import Batch

        return self.start(context, Batch(paths, self.fit_options()))

    def conclude_in_steps(self, context: bpy.types.Context, work: "Batch") -> Conclusion:
        done = [outcome for outcome in work.outcomes if outcome.record]
        failed = [outcome for outcome in work.outcomes if outcome.problem]
        problem = (yield from self.apply(context, done)) if done else ""
        if problem:
            return self.refuse(problem)
        for outcome in done:
            self.report({"INFO"}, self._success(outcome.record))
        for outcome in failed:
            self.report({"WARNING" if done else "ERROR"}, outcome.problem)
        if len(work.outcomes) > 1:
            self._sum_up(context, done, failed)
        if not done:
            return {"CANCELLED"}
        yield
        # The file browser pushes its own step before a fit that begins there, so that the flag
        # UNDO would leave two.
        bpy.ops.ed.undo_push(message=self.bl_label)
        return {"FINISHED"}

    def _success(self, record: Any) -> str:
        shown = nodes.material.choose(record, **self.material_options())
        seconds = record.seconds["total"] + sum(entry["seconds"] for entry in record.closures)
        return f"{record.name}: {shown.error(record):.1%} off, fitted in {seconds:.1f} s"

    def _sum_up(
        self, context: bpy.types.Context, done: list["Outcome"], failed: list["Outcome"]
    ) -> None:
        """Tells what became of several files, in the status bar and in a pop-up."""
        total = f"{len(done)} of {len(done) + len(failed)} files fitted"
        self.report({"WARNING" if failed else "INFO"}, total)
        if bpy.app.background or not self.options.is_invoke:
            return
        lines = [(outcome.problem, "ERROR") for outcome in failed]
        lines += [(self._success(outcome.record), "CHECKMARK") for outcome in done]

        def draw(popup: Any, _context: bpy.types.Context) -> None:
            for text, icon in lines[:_MOST_LINES]:
                popup.layout.label(text=text, icon=icon)
            if len(lines) > _MOST_LINES:
                popup.layout.label(text=f"{len(lines) - _MOST_LINES} more: see the Info editor")

        context.window_manager.popup_menu(draw, title=total)
