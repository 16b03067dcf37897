"""Many files: the record of each, computed here, in several processes, or on a Dask cluster.

A `Task` is one file and what to make of it. A `Way` computes tasks and yields each, with its record
or with what is wrong, as it ends. Records are written by `Batch` alone, in the process of the user:
whatever ends a worker, there is no half file and no record that two have written.
"""

import asyncio
import contextlib
import dataclasses
import logging
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import connection
from pathlib import Path
from typing import Any

from lobefit import blender
from lobefit._native import InputError, build_id
from lobefit.atomic import make_folder, place_to_write
from lobefit.fitting import Closures
from lobefit.inputs import RECORD_SUFFIX, Progress, kept_record, record_of
from lobefit.origin import is_unchanged
from lobefit.record import Record

_PATIENCE = 10  # seconds to wait for a scheduler, and for the first of its workers
_RETRIES = 2  # of a task that fails on a cluster for a reason that is not its file

Outcome = Record | InputError


@dataclass(frozen=True)
class Task:
    """One file, where its record goes, and what to compute: closures and the options of `Job`."""

    source: Path
    place: Path
    closures: Sequence[Closures]
    options: dict[str, Any]

    def kept(self) -> Record | None:
        """The record that an earlier run has left for this task."""
        return kept_record(self.place, self.source, self.closures, **self.options)

    def attempt(self, progress: Progress | None = None) -> Outcome:
        """Computes the record; what is wrong with the file is returned, not raised."""
        try:
            return record_of(self.source, progress, self.closures, **self.options)
        except InputError as error:
            return error
        except MemoryError:
            return InputError(f"{self.source}: expected enough memory, found too little.")

    def with_threads(self, count: int) -> "Task":
        """This task, by `count` threads where its options leave the number open."""
        threads = self.options["threads"] or count
        return dataclasses.replace(self, options=self.options | {"threads": threads})


def tasks_in(
    folder: Path, sources: Iterable[Path], closures: Sequence[Closures], options: dict[str, Any]
) -> list[Task]:
    """A task for every source, whose record takes the source's name in `folder`."""
    places = ((source, folder / f"{source.stem}{RECORD_SUFFIX}") for source in sources)
    return tasks_at(places, closures, options)


def tasks_at(
    places: Iterable[tuple[Path, Path]], closures: Sequence[Closures], options: dict[str, Any]
) -> list[Task]:
    """A task for every source and the place of its record.

    A record at a place that another source's will take is no source. Raises InputError where two
    sources have one place.
    """
    tasks: dict[Path, Task] = {}
    for source, place in places:
        if place not in tasks:
            tasks[place] = Task(source, place, closures, options)
        elif os.path.realpath(source) != os.path.realpath(place):
            found = f"{tasks[place].source} and {source}"
            raise InputError(f"{place}: expected one file to make it of, found {found}.")
    return list(tasks.values())


Ended = tuple[Task, Outcome]
# Is told the share of a task that is done, from 0 to 1, and the stage.
Watch = Callable[[Task, float, str], None]
Way = Callable[[Sequence[Task], Watch], Generator[Ended, None, None]]


class Batch:
    """Tasks on their way to their records; `kept` counts those that an earlier run has left."""

    def __init__(
        self,
        tasks: Sequence[Task],
        way: Way,
        keep: bool,
        bar: Callable[[str], AbstractContextManager[Progress | None]],
    ) -> None:
        self.tasks, self.kept = tasks, 0
        self._way, self._keep, self._bar = way, keep, bar
        self._show: Progress | None = None
        self._under_way: dict[Path, float] = {}
        self._ended = self._computed = 0
        self._start = time.monotonic()

    def run(self) -> Generator[Ended, None, None]:
        """Yields each task as it ends: its record, which is then written, or what is wrong."""
        with closing(self._each()) as each:
            while True:
                # The bar leaves the screen while the caller prints.
                with self._bar(self._title()) as self._show:
                    self._draw("")
                    ended = next(each, None)
                if ended is None:
                    return
                self._ended += 1
                self._under_way.pop(ended[0].place, None)
                yield ended

    def _each(self) -> Generator[Ended, None, None]:
        missing: list[Task] = []
        for task in self.tasks:
            self._draw(task.source.name)
            found = self._without_work(task)
            if found is None:
                missing.append(task)
            else:
                yield task, found
        self._start = time.monotonic()
        if missing:
            with closing(self._way(missing, self._watch)) as computed:
                for task, outcome in computed:
                    self._computed += 1
                    yield task, _saved(task, outcome)

    def _without_work(self, task: Task) -> Outcome | None:
        """What is known of a task before anything is computed."""
        try:
            place_to_write(task.place)
            record = task.kept() if self._keep else None
        except InputError as error:
            return error
        self.kept += record is not None
        return record

    def _watch(self, task: Task, share: float, stage: str) -> None:
        self._under_way[task.place] = share
        self._draw(stage if len(self.tasks) == 1 else f"{task.source.name}: {stage}")

    def _draw(self, text: str) -> None:
        if self._show:
            done = self._ended + sum(self._under_way.values())
            self._show(done / len(self.tasks), text)

    def _title(self) -> str:
        """What stands before the bar: the number of files done, and the time left for the rest."""
        if len(self.tasks) == 1:
            return self.tasks[0].source.name
        left = ""
        if self._computed:
            under_way = sum(self._under_way.values())
            each = (time.monotonic() - self._start) / (self._computed + under_way)
            left = f", {each * (len(self.tasks) - self._ended - under_way):.0f} s left"
        return f"{self._ended} of {len(self.tasks)} done{left}"


def _saved(task: Task, outcome: Outcome) -> Outcome:
    if isinstance(outcome, Record):
        try:
            # A library of another process that was refused may have taken the empty folder with it.
            make_folder(task.place.parent)
            outcome.save(task.place)
        except InputError as error:
            return error
    return outcome


def here(tasks: Sequence[Task], watch: Watch) -> Generator[Ended, None, None]:
    """One task after the other, in this process."""
    for task in tasks:
        yield task, task.attempt(partial(watch, task))


def in_processes(jobs: int) -> Way:
    """So many tasks at once, each in a process with its share of the processors.

    A process that is ended from outside costs its task alone. All are ended when the way is left.
    Raises InputError in a program that has no Python to start.
    """
    if jobs > 1 and not Path(sys.executable or "").name.lower().startswith("python"):
        raise InputError(
            f"--jobs: expected a Python to start processes with, found {sys.executable or 'none'}; "
            "use one job."
        )
    return partial(_in_processes, jobs)


def _in_processes(jobs: int, tasks: Sequence[Task], watch: Watch) -> Generator[Ended, None, None]:
    jobs = min(jobs, len(tasks))
    if jobs == 1:
        yield from here(tasks, watch)
        return
    threads = max(1, (os.cpu_count() or 1) // jobs)
    waiting = [task.with_threads(threads) for task in reversed(tasks)]
    workers: list[_Worker] = []
    try:
        while waiting or workers:
            while waiting and len(workers) < jobs:
                workers.append(_Worker(waiting.pop()))
            for worker in _Worker.that_tell(workers):
                told = worker.hear()
                if isinstance(told, tuple):
                    watch(worker.task, *told)
                    continue
                ended = worker.task, told
                if waiting and worker.is_alive:
                    worker.begin(waiting.pop())
                else:
                    workers.remove(worker)
                    worker.end()
                yield ended
    finally:
        for worker in workers:
            worker.end()


class _Worker:
    """A process of ours that computes one task after the other and tells how far it is."""

    def __init__(self, task: Task) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        with _ignoring_ctrl_c():
            self._process.start()
        theirs.close()
        self.begin(task)

    @staticmethod
    def that_tell(workers: Sequence["_Worker"]) -> list["_Worker"]:
        """Waits for the first of the workers with something to tell."""
        by_pipe: dict[Any, _Worker] = {worker._pipe: worker for worker in workers}
        return [by_pipe[pipe] for pipe in connection.wait(list(by_pipe))]

    @property
    def is_alive(self) -> bool:
        return self._process.is_alive()

    def begin(self, task: Task) -> None:
        self.task = task
        # Whether a process is still there is learned when it is heard.
        with contextlib.suppress(OSError):
            self._pipe.send(task)

    def hear(self) -> Outcome | tuple[float, str]:
        """The share done and the stage, or the outcome of the task."""
        try:
            told: Outcome | tuple[float, str] = self._pipe.recv()
            return told
        except (EOFError, OSError):
            self._process.join()
            return InputError(
                f"{self.task.source}: expected a record, found that its process ended early "
                f"({_exit_reason(self._process.exitcode or 0)}); the same command tries it again."
            )

    def end(self) -> None:
        self._process.kill()
        self._process.join()
        self._pipe.close()


def _serve(pipe: connection.Connection) -> None:
    """The life of a worker: it ends when nobody is left at the other end of its pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # as in `_ignoring_ctrl_c`, also under Blender
    with contextlib.suppress(EOFError, ConnectionError):
        while True:
            task: Task = pipe.recv()
            pipe.send(task.attempt(lambda share, stage: pipe.send((share, stage))))


def _exit_reason(code: int) -> str:
    return signal.Signals(-code).name if code < 0 else f"exit code {code}"


@contextmanager
def _ignoring_ctrl_c() -> Iterator[None]:
    """What is started meanwhile ignores Ctrl-C, which reaches every process of a terminal.

    Workers are ended by the process that started them.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is None:  # Blender has a handler of its own, which Python could not put back.
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def on_cluster(address: str) -> Way:
    """On the workers of the Dask scheduler at `address`, which read the same paths as this process.

    Each task has one thread unless told otherwise, as Dask gives a worker a task for every
    processor. What a lost worker had is done again by another. Raises InputError inside Blender and
    where `distributed` is missing.
    """
    if blender.is_this_program():
        raise InputError(
            "--scheduler: expected a Python of its own, found Blender; install Lobefit outside of "
            "it with: pip install 'lobefit[cluster]'."
        )
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InputError(
            "--scheduler: expected the Python module distributed, found none; install it with: "
            "pip install 'lobefit[cluster]'."
        ) from None
    return partial(_on_cluster, address)


def _on_cluster(address: str, tasks: Sequence[Task], watch: Watch) -> Generator[Ended, None, None]:
    from distributed import as_completed

    with _silent_logs(), _connected(address) as client:
        _check_workers(client, address)
        sent = {}
        for task in tasks:
            source = Path(os.path.abspath(task.source))
            absolute = dataclasses.replace(task.with_threads(1), source=source)
            options = {"pure": False, "retries": _RETRIES}
            sent[client.submit(_attempt_as, build_id, absolute, **options)] = task
        for future in as_completed(sent, loop=client.loop):
            yield sent[future], _outcome(sent[future], future)


def _attempt_as(build: str, task: Task) -> Outcome:
    """What a worker of a cluster does; it may have joined after the others were asked."""
    if build != build_id:
        return InputError(f"{task.source}: {_other_build('a worker', build, build_id)}")
    return task.attempt()


def _outcome(task: Task, future: Any) -> Outcome:
    if future.status != "finished":
        found = "the connection to its scheduler lost"
        if future.status == "error":
            error = future.exception()
            found = f"{type(error).__name__}: {_first_sentence(error)}"
        return InputError(f"{task.source}: expected a record from the cluster, found {found}.")
    outcome: Outcome = future.result()
    made_of_file = isinstance(outcome, Record) and task.source.suffix.lower() != RECORD_SUFFIX
    if made_of_file and not is_unchanged(outcome.source):
        return InputError(
            f"{task.source}: expected the workers to read this file, found that they have another "
            "at the same path."
        )
    return outcome


@contextmanager
def _connected(address: str) -> Iterator[Any]:
    from distributed import Client

    try:
        asyncio.run(_knock(address))
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
    except OSError as error:
        raise InputError(
            f"{address}: expected a Dask scheduler, found none within {_PATIENCE} s."
        ) from error
    except Exception as error:  # Dask takes what any other server answers for its own.
        raise InputError(
            f"{address}: expected a Dask scheduler at an address like tcp://HOST:8786, found "
            "something else."
        ) from error
    with client:
        yield client


@contextmanager
def _silent_logs() -> Iterator[None]:
    """Keeps Dask's log off the screen: what goes wrong is told in our own words."""
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)


async def _knock(address: str) -> None:
    """Raises what keeps us from the scheduler; a client that cannot start is slow to give up."""
    from distributed.comm import connect
    from distributed.security import Security

    keys = Security().get_connection_args("client")
    # The time out of `connect` does not count a server that never answers.
    async with asyncio.timeout(_PATIENCE):
        comm = await connect(address, timeout=_PATIENCE, **keys)
    await comm.close()


def _check_workers(client: Any, address: str) -> None:
    """Raises InputError unless there are workers and all have this build of Lobefit."""

    # A local function travels as code, so that a worker without Lobefit can answer too.
    def build_of_worker() -> str:
        try:
            from lobefit import _native
        except ImportError:
            return ""
        return _native.build_id

    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
    except TimeoutError:
        raise InputError(f"{address}: expected workers of the scheduler, found none.") from None
    for worker, build in client.run(build_of_worker).items():
        if build != build_id:
            raise InputError(f"{address}: {_other_build(worker, build_id, build)}")


def _first_sentence(error: BaseException) -> str:
    return " ".join(str(error).split()).partition(". ")[0].rstrip(".")


def _other_build(worker: str, wanted: str, found: str) -> str:
    shown = f"build {found[:12]}" if found else "none"
    return f"expected Lobefit of build {wanted[:12]} at {worker}, found {shown}."
