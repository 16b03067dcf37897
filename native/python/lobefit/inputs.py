"""What stands on a command line for materials: measurements, records, and folders of either."""

import dataclasses
import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from lobefit._native import InputError, build_id
from lobefit.atomic import reason
from lobefit.fitting import Closures, fit
from lobefit.origin import origin_of
from lobefit.record import MODELS, Record

MEASUREMENT_SUFFIXES = (".binary", ".bsdf")
RECORD_SUFFIX = ".json"
_KEPT_OPTIONS = ("schedule", "norm", "channels", "max_angle")

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


def kept_record(
    place: Path, path: Path, closures: Sequence[Closures] = (), **options: Any
) -> Record | None:
    """The record at `place` if the same build made it of the same file with the same options.

    `options` are those of `Job`. Where `path` is a record itself, the one at `place` is it with
    closures added. None for what has to be computed.
    """
    if not place.is_file():
        return None
    try:
        record = Record.load(place)
        if path.suffix.lower() == RECORD_SUFFIX:
            same = _is_extended(record, Record.load(path))
        else:
            same = _has_options(record, options) and (
                origin_of(path).sha256 == record.source["sha256"]
            )
        return record if same and all(request.is_in(record) for request in closures) else None
    except InputError:
        return None


def _is_extended(record: Record, base: Record) -> bool:
    """Whether a record is `base`, but for closures that it has beside those of `base`."""
    same = dataclasses.replace(record, closures=base.closures) == base
    return same and all(entry in record.closures for entry in base.closures)


def _has_options(record: Record, options: dict[str, Any]) -> bool:
    """Whether this build made the record with these options of a fit."""
    models = list(MODELS) if options["model"] == "all" else [options["model"]]
    return (
        record.machine.get("build") == build_id
        and list(record.fits) == models
        and (record.parameters["ior"] is not None) == options["fresnel"]
        and all(getattr(record, name) == options[name] for name in _KEPT_OPTIONS)
        and (record.uncertainty is not None or not options.get("uncertainty"))
    )
