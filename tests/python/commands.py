"""Lobefit's commands, in this process and in others, and what they leave behind."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from lobefit import Record
from lobefit.command_line import main

PATIENCE = 60  # seconds after which what should have happened never will


def refuse(capfd, *arguments) -> str:
    """Runs a command that has to end with 2, and returns its only line on stderr."""
    assert main([str(argument) for argument in arguments]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1, err
    assert err.startswith("lobefit: ")
    assert "Traceback" not in err
    return err


def await_that(holds: Callable[[], object], process: subprocess.Popen | None = None) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        assert process is None or process.poll() is None, "it ended too early"
        time.sleep(0.02)


def start(*arguments, before: Callable[[], None] = lambda: None) -> subprocess.Popen:
    """Lobefit in a session of its own, in which Ctrl-C is not ignored, after `before`."""

    def prepare() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        before()

    return subprocess.Popen(
        [sys.executable, "-P", "-m", "lobefit", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=prepare,
    )


def finished(folder: Path) -> dict[str, int]:
    """When each record of a folder was written; no other file, and no half one, is in it."""
    times = {}
    if folder.is_dir():
        for path in folder.glob("[!.]*"):
            Record.load(path)
            times[path.name] = path.stat().st_mtime_ns
    return times
