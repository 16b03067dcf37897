"""What stands on a command line for materials: measurements, records, and folders of either."""

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from lobefit._native import InputError
from lobefit.atomic import reason
from lobefit.fitting import Closures, fit
from lobefit.record import Record

MEASUREMENT_SUFFIXES = (".binary",)
RECORD_SUFFIX = ".json"

Progress = Callable[[float, str], None]


def files_in(folder: str | os.PathLike[str], suffixes: Iterable[str]) -> list[Path]:
    """The files of a folder with one of these suffixes, by name. Raises InputError for none."""
    wanted = tuple(suffixes)
    try:
        paths = sorted(path for path in Path(folder).iterdir() if path.suffix.lower() in wanted)
    except OSError as error:
        raise InputError(f"{folder}: cannot be read, {reason(error)}.") from error
    if not paths:
        raise InputError(f"{folder}: expected files named *{' or *'.join(wanted)}, found none.")
    return paths


def spread(names: Iterable[str], suffixes: Iterable[str]) -> list[Path]:
    """The files meant by a command line: folders stand for what they hold."""
    paths: list[Path] = []
    for name in names:
        paths += files_in(name, suffixes) if Path(name).is_dir() else [Path(name)]
    return paths


def record_of(
    path: Path,
    progress: Progress | None = None,
    closures: Sequence[Closures] = (),
    **options: Any,
) -> Record:
    """The record in a file *.json; of any other file the fit with these options.

    Closures that the record does not hold yet are added.
    """
    if path.suffix.lower() != RECORD_SUFFIX:
        return fit(path, progress=progress, closures=closures, **options)
    record = Record.load(path)
    missing = [request for request in closures if not request.is_in(record)]
    if not missing:
        return record
    threads = options.get("threads", 0)
    return fit(record, progress=progress, closures=missing, threads=threads)
