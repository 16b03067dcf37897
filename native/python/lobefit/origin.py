"""Where a measurement comes from: its file, and for a sample what it was made from."""

import csv
import hashlib
import io
import math
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lobefit import _native
from lobefit._native import InputError, Measurement
from lobefit.atomic import alone_in, make_folder, reason, write_bytes, written_aside

_AT_ONCE = 1 << 20  # bytes to hash before looking at the time
_LIST = "samples.csv"
_COLUMNS = ("sha256", "file", "name", "source")
_PAPER = (
    "ABC fit published by Low, Kronander, Ynnerman and Unger, BRDF Models for Accurate and "
    "Efficient Rendering of Glossy Surfaces, TOG 2012"
)


@dataclass(frozen=True)
class Origin:
    """A file by its path and the hash of its bytes, with the honest name of a sample."""

    path: str | None = None
    sha256: str | None = None
    name: str | None = None

    def entries(self) -> dict[str, Any]:
        """The part of a record's `source` that tells the origin."""
        named = {"name": self.name} if self.name else {}
        return {"path": self.path, "sha256": self.sha256} | named


def origin_of(path: str | os.PathLike[str]) -> Origin:
    """The origin of the file `path`; it has a name if a list of samples beside it has its hash."""
    search = OriginSearch(path)
    while search.advance(math.inf) is None:
        pass
    return search.origin


class OriginSearch:
    """Finds the origin of a file a little at a time, as long as Blender's window waits for it."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.origin: Origin | None = None
        self._path = path
        self._hash = hashlib.sha256()
        self._read = 0  # bytes of it that were hashed

    def advance(self, seconds: float) -> Origin | None:
        """Goes on for about so long; the origin when it is known."""
        if self.origin is None:
            try:
                self._hash_more(time.perf_counter() + seconds)
            except OSError as error:
                raise InputError(f"{self._path}: cannot be read, {reason(error)}.") from error
        return self.origin

    def _hash_more(self, end: float) -> None:
        place = Path(os.path.abspath(self._path))
        with place.open("rb") as file:
            file.seek(self._read)
            while data := file.read(_AT_ONCE):
                self._hash.update(data)
                self._read += len(data)
                if time.perf_counter() > end:
                    return
        digest = self._hash.hexdigest()
        self.origin = Origin(str(place), digest, _listed(place.parent).get(digest, {}).get("name"))


def stamp_of(path: str | os.PathLike[str]) -> tuple[int, ...] | None:
    """What changes when a file is written to or replaced by another; None where there is none."""
    try:
        told = os.stat(path)
    except OSError:
        return None
    return told.st_dev, told.st_ino, told.st_size, told.st_mtime_ns


def read_unchanged(source: Mapping[str, Any]) -> Measurement | None:
    """The measurement of a record's `source`; None where its file is gone or another one."""
    path = source["path"]
    if not path or not Path(path).is_file():
        return None
    try:
        measurement = Measurement.read(path)
    except InputError:
        return None
    # Asked afterwards, so that a file that changes while it is read is another one.
    return measurement if is_unchanged(source) else None


def is_unchanged(source: Mapping[str, Any]) -> bool:
    """Whether the file of a record's `source` is there, and is still the one that was fitted."""
    path, digest = source["path"], source["sha256"]
    if not path or not Path(path).is_file():
        return False
    return digest is None or origin_of(path).sha256 == digest


def write_samples(folder: str | os.PathLike[str], names: list[str]) -> list[Path]:
    """Writes samples in MERL layout and the list that says what they are; returns their paths.

    Raises InputError where another file than a sample has the name of one.
    """
    place = make_folder(folder)
    paths = {name: place / f"{name}.binary" for name in names}
    for name, path in paths.items():
        if path.exists() and origin_of(path).name != sample_title(name):
            raise InputError(f"{path}: expected a free name for a sample, found another file.")
    for name, path in paths.items():
        with written_aside(path) as aside:
            _native.sample(name).write(str(aside))
            # Before it has its name, so that a run that was killed can be made again.
            _add_to_list(place, name, origin_of(aside).sha256 or "")
    return list(paths.values())


def sample_title(name: str) -> str:
    """What to call the sample `name`: it is no measurement, and must not pass for one."""
    return f"{name} (from Low et al.'s ABC fit)"


def _add_to_list(folder: Path, name: str, digest: str) -> None:
    """Adds a sample to the folder's list; those written earlier stay in it."""
    with alone_in(folder):
        values = (digest, f"{name}.binary", sample_title(name), _PAPER)
        rows = _listed(folder) | {digest: dict(zip(_COLUMNS, values, strict=True))}
        text = io.StringIO()
        writer = csv.DictWriter(text, _COLUMNS, lineterminator="\n", extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows.values())
        write_bytes(folder / _LIST, text.getvalue().encode())


def _listed(folder: Path) -> dict[str, dict[str, str]]:
    """The folder's list of samples by their hash; where there is none, or a damaged one, empty."""
    try:
        rows = list(csv.DictReader(io.StringIO((folder / _LIST).read_text())))
        return {row["sha256"]: row for row in rows if row["name"]}
    except (OSError, ValueError, KeyError, csv.Error):
        return {}
