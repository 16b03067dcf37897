"""The catalogues of an asset library, in the file that Blender keeps them in."""

import os
import uuid
from pathlib import Path

from lobefit._native import InputError
from lobefit.atomic import alone_in, reason, write_bytes

FILE = "blender_assets.cats.txt"

_VERSION = "VERSION 1"
_HEAD = (
    "# This is an Asset Catalog Definition file for Blender.\n"
    "#\n"
    '# Other lines than those of "UUID:catalog/path:simple name" are ignored.\n'
    f"\n{_VERSION}\n\n"
)


class Catalogues:
    """The catalogues of a folder; new ones are added, every line of its file is kept.

    Raises InputError for a file that cannot be read, or of another version.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.path = Path(folder) / FILE
        self._fresh: list[str] = []
        self._ids: dict[str, str] = {}
        for line in _read(self.path).splitlines():
            identifier, _, rest = line.partition(":")
            if rest and not line.startswith("#"):
                self._ids.setdefault(rest.partition(":")[0], identifier)

    def identifier(self, path: str) -> str:
        """The UUID of the catalogue `path`, which is added where it is missing.

        It is the same on every machine, unless the file gives the catalogue another one. One that
        was renamed keeps its UUID, and so its materials.
        """
        if path not in self._ids:
            name = uuid.uuid5(uuid.NAMESPACE_URL, f"lobefit:{path}")
            if str(name) not in self._ids.values():
                self._fresh.append(f"{name}:{path}:{path.replace('/', '-')}\n")
            self._ids[path] = str(name)
        return self._ids[path]

    def save(self) -> None:
        """Writes the file, all of it or nothing, if a catalogue was added.

        What other processes have added meanwhile is kept too.
        """
        if not self._fresh:
            return
        with alone_in(self.path.parent):
            text = _read(self.path)
            missing = [line for line in self._fresh if line.partition(":")[0] not in text]
            if missing:
                gap = "" if text.endswith("\n") else "\n"
                write_bytes(self.path, (text + gap + "".join(missing)).encode())


def _read(path: Path) -> str:
    """What the file says; what a new one says where there is none."""
    try:
        text = path.read_bytes().decode()
    except FileNotFoundError:
        return _HEAD
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected text in UTF-8, found other bytes.") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read, {reason(error)}.") from error
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if lines and lines[0].strip() != _VERSION:
        raise InputError(f"{path}: expected '{_VERSION}', found '{lines[0][:40]}'.")
    return text
