"""Writing a file beside its place and renaming it, so that nobody ever sees half a file."""

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lobefit._native import InputError

_REASONS = {
    errno.EACCES: "permission was denied",
    errno.EPERM: "permission was denied",
    errno.EROFS: "the file system is read-only",
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the disk quota is used up",
    errno.ENAMETOOLONG: "the name is too long",
}


def reason(error: OSError) -> str:
    """What went wrong, as half a sentence."""
    return _REASONS.get(error.errno or 0, (error.strerror or str(error)).lower())


def place_to_write(path: str | os.PathLike[str]) -> Path:
    """Where `path` leads; InputError where no file can be, so that no long work is done for it."""
    place = Path(os.path.realpath(path))
    if place.exists() and not place.is_file():
        kind = "a folder" if place.is_dir() else "not an ordinary file"
        raise InputError(f"{path}: expected the name of a file to write, found {kind}.")
    if not place.parent.is_dir():
        kind = "is a file" if place.parent.exists() else "does not exist"
        raise InputError(f"{path}: cannot be written, its folder {kind}.")
    return place


@contextmanager
def written_aside(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yields a name beside `path` to write to, and gives that file the name `path` at the end.

    When the block is left by an exception (an interrupt too) the file beside is removed and what
    was at `path` stays as it was. The name beside keeps the suffix, and a symbolic link at `path`
    stays a link. Raises InputError where the file cannot be written.
    """
    place = place_to_write(path)
    aside = place.with_name(f".{place.stem[:100]}-{secrets.token_hex(4)}{place.suffix}")
    try:
        yield aside
        _flush(aside)
        os.replace(aside, place)
    except OSError as error:
        raise InputError(f"{path}: cannot be written, {reason(error)}.") from error
    finally:
        aside.unlink(missing_ok=True)


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Writes `data` to `path`, all of it or nothing."""
    with written_aside(path) as aside:
        aside.write_bytes(data)


def make_folder(path: str | os.PathLike[str]) -> Path:
    """The folder `path`, made where it is missing."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(f"{path}: expected a folder, found a file.") from None
    except OSError as error:
        raise InputError(f"{path}: the folder cannot be made, {reason(error)}.") from error
    return folder


def _flush(path: Path) -> None:
    """Waits until the file has reached the disk: a rename must not overtake its contents."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())
