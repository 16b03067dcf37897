"""Writing a file beside its place and renaming it, so that nobody ever sees half a file."""

import contextlib
import errno
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lobefit._native import InputError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

_LONGEST_STEM = 200  # bytes; file systems allow names of 255, and suffixes come behind
# What Blender and the writer of MERL tables put behind the name of a file while they write it.
_LATER = r"(@|\.part)?"
_ABANDONED = 3600  # seconds since a file beside was last written, after which nobody goes on

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
    try:
        if place.exists() and not place.is_file():
            kind = "a folder" if place.is_dir() else "not an ordinary file"
            raise InputError(f"{path}: expected the name of a file to write, found {kind}.")
        if not place.parent.is_dir():
            kind = "is a file" if place.parent.exists() else "does not exist"
            raise InputError(f"{path}: cannot be written, its folder {kind}.")
    except OSError as error:
        raise InputError(f"{path}: cannot be written, {reason(error)}.") from error
    return place


@contextmanager
def written_aside(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yields a name beside `path` to write to, and gives that file the name `path` at the end.

    When the block is left by an exception (an interrupt too) the file beside is removed and what
    was at `path` stays as it was. The name beside is hidden and keeps the suffix, and a symbolic
    link at `path` stays a link. What a process that was killed left beside goes with the next file
    that is written an hour later. Raises InputError where the file cannot be written.
    """
    place = place_to_write(path)
    stem = os.fsencode(place.stem)[:_LONGEST_STEM].decode(errors="ignore")
    aside = place.with_name(f".{stem}-{secrets.token_hex(4)}{place.suffix}")
    try:
        yield aside
        _flush(aside)
        _remove_abandoned(aside, stem)
        os.replace(aside, place)
    except InputError as error:
        # What writes the file beside may name it; who reads of it knows the place alone.
        told = str(error).replace(str(aside), str(path)).replace(aside.name, place.name)
        raise InputError(told) from error
    except OSError as error:
        raise InputError(f"{path}: cannot be written, {reason(error)}.") from error
    finally:
        with contextlib.suppress(OSError):
            aside.unlink(missing_ok=True)


@contextmanager
def alone_in(folder: str | os.PathLike[str]) -> Iterator[None]:
    """Waits until no other process is in such a block for the folder, which nothing is left in.

    For what is read, changed and written again. A process that is killed holds nobody up. On
    Windows, and on file systems without locks, nobody is waited for.
    """
    with contextlib.ExitStack() as left:
        if fcntl is not None:
            with contextlib.suppress(OSError):
                held = os.open(folder, os.O_RDONLY)
                left.callback(os.close, held)
                fcntl.flock(held, fcntl.LOCK_EX)
        yield


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


def remove_empty(folder: str | os.PathLike[str]) -> None:
    """Removes the folders below `folder` that hold nothing, and itself if nothing is left in it."""
    for place, _, _ in os.walk(folder, topdown=False):
        # The system refuses it for those that hold something, and they stay.
        with contextlib.suppress(OSError):
            os.rmdir(place)


def _remove_abandoned(aside: Path, stem: str) -> None:
    """Removes the files beside of the same place that nobody has written to for long."""
    ours = re.compile(rf"\.{re.escape(stem)}-[0-9a-f]{{8}}{re.escape(aside.suffix)}{_LATER}")
    # By the clock of the file system, which need not be that of this machine.
    now = aside.stat().st_mtime
    with os.scandir(aside.parent) as entries:
        old = [entry for entry in entries if ours.fullmatch(entry.name)]
        for entry in old:
            with contextlib.suppress(OSError):
                if entry.stat().st_mtime < now - _ABANDONED:
                    os.unlink(entry.path)


def _flush(path: Path) -> None:
    """Waits until the file has reached the disk: a rename must not overtake its contents."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())
