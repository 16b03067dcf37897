"""What a library of materials is made from: its files, and what is told of each beside its picture.

A list `materials.csv` beside the files, or in a folder above them up to the one that was named, may
tell of a file its `name`, `catalogue` (a path like Metal/Polished), `tags` (separated by
semicolons), `author`, `licence` and `source`. The first column, `file`, names a measured file or
its record by the path from the list; the suffix counts for nothing.
"""

import csv
import io
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path, PurePath

from lobefit._native import InputError
from lobefit.atomic import reason
from lobefit.inputs import MEASUREMENT_SUFFIXES, RECORD_SUFFIX

LIST = "materials.csv"
UNSORTED, UNKNOWN = "Unsorted", "Unknown"
# What the name of a folder with a library's own records ends with; it is no input of another.
RECORDS_SUFFIX = ".records"

SUFFIXES = (*MEASUREMENT_SUFFIXES, RECORD_SUFFIX)

# What a list tells, by the path of the file it is about, without its suffix.
Rows = dict[str, dict[str, str]]

_COLUMNS = ("file", "name", "catalogue", "tags", "author", "licence", "source")
_OTHER_SPELLINGS = {"catalog": "catalogue", "license": "licence"}


@dataclass(frozen=True)
class Asset:
    """What an asset browser tells of a material; an empty name stands for that of the record."""

    name: str = ""
    catalogue: str = UNSORTED
    tags: tuple[str, ...] = ()
    author: str = ""
    licence: str = UNKNOWN
    source: str = ""


@dataclass(frozen=True)
class Item:
    """A file of a library, and the place of its record."""

    file: Path
    place: Path
    asset: Asset


def records_folder(library: str | os.PathLike[str]) -> Path:
    """The folder beside a library that keeps its records, so that it goes on where it stopped."""
    return Path(library).with_suffix(RECORDS_SUFFIX)


def items_of(names: Sequence[str], records: Path) -> list[Item]:
    """The files of a library: those named, and all in and below the folders named.

    Their records stand in the folder `records` as the files stand in what was named. Raises
    InputError for a folder that holds none and for a list with a fault.
    """
    list_in = cache(_list_in)
    items = []
    for name in names:
        path = Path(name)
        root = path if path.is_dir() else path.parent
        for file in _files_below(path) if path.is_dir() else [path]:
            below = file.relative_to(root)
            asset = _asset(below.parent, _told_of(file, root, list_in))
            items.append(Item(file, records / below.with_suffix(RECORD_SUFFIX), asset))
    return items


def _files_below(root: Path) -> list[Path]:
    """The measurements and records in and below a folder, by their path."""

    def refuse(error: OSError) -> None:
        raise InputError(f"{error.filename}: cannot be read, {reason(error)}.") from error

    found = []
    for folder, below, names in os.walk(root, onerror=refuse):
        below[:] = [name for name in below if not name.startswith(".")]
        below[:] = [name for name in below if not name.endswith(RECORDS_SUFFIX)]
        paths = [Path(folder) / name for name in names if not name.startswith(".")]
        found += [path for path in paths if path.suffix.lower() in SUFFIXES]
    if not found:
        raise InputError(f"{root}: expected files named *{' or *'.join(SUFFIXES)}, found none.")
    return sorted(found)


def _told_of(file: Path, root: Path, list_in: Callable[[Path], Rows]) -> dict[str, str]:
    """The row of the nearest list, from the file's folder up to `root`, that names a file."""
    for folder in file.parents:
        row = list_in(folder).get(_key(file.relative_to(folder)))
        if row is not None:
            return row
        if folder == root:
            break
    return {}


def _asset(folder: PurePath, told: dict[str, str]) -> Asset:
    """What is told of a file; where nothing is, its sub-folder is its catalogue."""
    return Asset(
        name=told.get("name", ""),
        catalogue=_catalogue(told.get("catalogue") or folder.as_posix()) or UNSORTED,
        tags=tuple(filter(None, map(str.strip, told.get("tags", "").split(";")))),
        author=told.get("author", ""),
        licence=told.get("licence") or UNKNOWN,
        source=told.get("source", ""),
    )


def _catalogue(path: str) -> str:
    """A catalogue's path as Blender writes it; a colon would end it in the file of catalogues."""
    parts = (" ".join(part.replace(":", "-").split()) for part in path.split("/"))
    return "/".join(part for part in parts if part not in ("", "."))


def _key(path: PurePath) -> str:
    known = path.suffix.lower() in SUFFIXES
    return (path.with_suffix("") if known else path).as_posix()


def _list_in(folder: Path) -> Rows:
    """The rows of the list in a folder by the file they are about; empty where there is none."""
    path = folder / LIST
    if not path.is_file():
        return {}
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected text in UTF-8, found other bytes.") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read, {reason(error)}.") from error
    rows: Rows = {}
    lines = _lines(path, text)
    columns = _columns(path, next(lines, (1, []))[1])
    for number, fields in lines:
        if len(fields) != len(columns):
            raise InputError(
                f"{path}, line {number}: expected {len(columns)} fields, found {len(fields)}."
            )
        row = dict(zip(columns, fields, strict=True))
        key = _key(PurePath(row["file"]))
        if not any((folder / f"{key}{suffix}").is_file() for suffix in SUFFIXES):
            raise InputError(
                f"{path}, line {number}: expected a file below this folder, found no "
                f"'{row['file']}'."
            )
        if key in rows:
            raise InputError(
                f"{path}, line {number}: expected one line a file, found '{row['file']}' again."
            )
        rows[key] = row
    return rows


def _lines(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """The lines of a list that are not empty, with their numbers, in fields without blanks."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        for fields in reader:
            if any(map(str.strip, fields)):
                yield reader.line_num, [field.strip() for field in fields]
    except csv.Error as error:
        raise InputError(
            f"{path}, line {reader.line_num}: expected comma-separated values, found {error}."
        ) from error


def _columns(path: Path, titles: Sequence[str]) -> list[str]:
    columns = [_OTHER_SPELLINGS.get(title.lower(), title.lower()) for title in titles]
    for column in columns:
        if column not in _COLUMNS or columns.count(column) > 1:
            again = " twice" if column in _COLUMNS else ""
            raise InputError(
                f"{path}: expected columns of {', '.join(_COLUMNS)}, found '{column}'{again}."
            )
    if "file" not in columns:
        raise InputError(f"{path}: expected a column 'file', found none.")
    return columns
