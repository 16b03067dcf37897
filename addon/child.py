"""Lobefit's command line in a process of its own, looked after without waiting for it."""

import json
import os
import select
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

_READ = 1 << 16  # bytes at once
_PATIENCE = 5  # seconds a process has to end by itself

# SIGTERM ends it as Ctrl-C would, so that nothing half-written stays behind. What Blender runs from
# its command line names a file, "<blender string>", that processes of Python would look for.
_PROGRAM = """
import signal, sys
signal.signal(signal.SIGTERM, signal.default_int_handler)
globals().pop("__file__", None)
sys.path.insert(0, {folder!r})
from lobefit.command_line import main
sys.exit(main(sys.argv[sys.argv.index("--") + 1:]))
"""


class Child:
    """A command that tells how far it is in lines of JSON: what `operators.run` asks of work.

    `results` are the other lines of JSON, `problems` the sentences that it complained in. `text`
    says what is being done and `progress` the share that is done, from 0 to 1.
    """

    def __init__(self, arguments: Sequence[str]) -> None:
        self.progress, self.text = 0.0, "Starting Blender"
        self.results: list[dict[str, Any]] = []
        self.problems: list[str] = []
        self._line = b""
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 (closed by _end)
        self._process = subprocess.Popen(
            [*_blender(), "--", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self._errors,
        )

    @property
    def done(self) -> bool:
        """Whether the process has ended and all that it told is known."""
        return self._process.stdout.closed

    def advance(self, seconds: float) -> bool:
        """Listens for at most `seconds`; says whether the process has ended."""
        pipe = self._process.stdout
        if not self.done and select.select([pipe], [], [], seconds)[0]:
            told = os.read(pipe.fileno(), _READ)
            *lines, self._line = (self._line + told).split(b"\n")
            for line in lines:
                self._take(line)
            if not told:
                self._end()
        return self.done

    def stop(self) -> None:
        """Ends the process, and those that it started; they are gone when this returns."""
        if self.done:
            return
        self._process.terminate()
        try:
            self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._end()

    def _take(self, line: bytes) -> None:
        try:
            told = json.loads(line)
        except ValueError:  # Blender's own
            return
        if "progress" in told:
            self.progress, self.text = told["progress"], told["text"]
        else:
            self.results.append(told)

    def _end(self) -> None:
        self._process.stdout.close()
        code = self._process.wait()
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").splitlines()
        self._errors.close()
        ours = "lobefit: "
        self.problems = [line.removeprefix(ours) for line in lines if line.startswith(ours)]
        if code and not self.problems:
            self.problems = [f"The Blender that was at work ended early (exit code {code})."]


def _blender() -> list[str]:
    """The start of a command line that runs Lobefit's, in a Blender with factory settings."""
    import lobefit

    program = _PROGRAM.format(folder=str(Path(lobefit.__file__).parents[1]))
    if bpy.app.binary_path:
        options = ["--background", "--factory-startup", "--python-exit-code", "1"]
        return [bpy.app.binary_path, *options, "--python-expr", program]
    return [sys.executable, "-P", "-c", program]
