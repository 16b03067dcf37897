"""What JSON from files has to look like: checks that say what was expected and what was found.

A check takes a value and where it stands, and raises Mismatch.
"""

import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lobefit._native import InputError
from lobefit.atomic import reason

Check = Callable[[Any, str], None]


def bytes_of(path: str | os.PathLike[str], what: str, most: int = -1) -> bytes:
    """What the file `path` holds, up to `most` bytes and one more; `what` it should hold.

    Raises InputError where it cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            return file.read(most + 1 if most >= 0 else -1)
    except IsADirectoryError:
        raise InputError(f"{path}: expected {what}, found a folder.") from None
    except FileNotFoundError:
        raise InputError(f"{path}: expected {what}, found no such file.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read, {reason(error)}.") from error


def checked_json(text: str | bytes, name: str, what: str, check: Check) -> Any:
    """The JSON in `text`, which `check` has accepted.

    Raises InputError, one sentence with the `name` of the file and `what` it should hold.
    """
    try:
        data = json.loads(
            text,
            parse_float=_finite,
            parse_constant=_refuse_constant,
            object_pairs_hook=_unique,
        )
    except UnicodeDecodeError as error:
        raise InputError(f"{name}: expected {what} in UTF-8, found other bytes.") from error
    except RecursionError as error:
        raise InputError(f"{name}: expected {what}, found JSON nested too deeply.") from error
    except ValueError as error:
        raise InputError(f"{name}: expected {what} in JSON, found {error}.") from error
    try:
        check(data, "")
    except Mismatch as mismatch:
        where = mismatch.where or f"the {what.split()[-1]}"
        expected, found = mismatch.expected, mismatch.found
        raise InputError(f"{name}: expected {where} to be {expected}, found {found}.") from None
    return data


def _finite(text: str) -> float:
    """A number; one that no float holds could not be written again, whatever it stands for."""
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"the number {text[:40]}, which is too large")
    return value


def _refuse_constant(name: str) -> float:
    raise ValueError(f"the constant {name}, which JSON does not have")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object; of two values under one key neither is to be taken silently."""
    data = dict(pairs)
    if len(data) < len(pairs):
        twice = next(key for key in data if [name for name, _ in pairs].count(key) > 1)
        raise ValueError(f"the key {twice[:40]!r} twice in one object")
    return data


class Mismatch(Exception):
    """What stands at `where` (the whole where that is empty) is not what was expected."""

    def __init__(self, where: str, expected: str, found: Any) -> None:
        super().__init__(where, expected)
        shown = found if isinstance(found, Missing) else json.dumps(found)
        self.where, self.expected = where, expected
        self.found = f"{str(shown)[:40]}..." if len(str(shown)) > 43 else str(shown)


class Missing:
    """What is found where a key is missing."""

    def __str__(self) -> str:
        return "nothing"


def kind(expected: str, accepts: Callable[[Any], bool]) -> Check:
    """Whatever `accepts` accepts."""

    def check(value: Any, where: str) -> None:
        if not accepts(value):
            raise Mismatch(where, expected, value)

    return check


def is_number(value: Any) -> bool:
    """Whether it is a number that a float can hold."""
    # The comparison also holds for integers that are too large for a float.
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e308


def number(low: float, high: float = math.inf, note: str = "a number") -> Check:
    """A number from low to high."""
    return kind(note, lambda value: is_number(value) and low <= value <= high)


def choice(*names: str) -> Check:
    """One of these texts."""
    return kind(f"one of {', '.join(names)}", lambda value: value in names)


def or_null(check: Check) -> Check:
    """What `check` accepts, or null."""

    def checked(value: Any, where: str) -> None:
        if value is not None:
            check(value, where)

    return checked


def list_of(item: Check, length: int | None = None) -> Check:
    """A list of so many items, or of any number."""
    expected = "a list" if length is None else f"a list of {length}"

    def check(value: Any, where: str) -> None:
        if not isinstance(value, list) or length not in (None, len(value)):
            raise Mismatch(where, expected, value)
        for index, entry in enumerate(value):
            item(entry, f"{where}[{index}]")

    return check


def object_of(
    required: dict[str, Check], optional: dict[str, Check] | None = None, strict: bool = False
) -> Check:
    """An object with these keys; others, as of a later version, are no error unless `strict`."""
    known = required | (optional or {})

    def check(value: Any, where: str) -> None:
        if not isinstance(value, dict):
            raise Mismatch(where, "an object", value)
        for key in value if strict else ():
            choice(*known)(key, f"the key in {where}" if where else "the key")
        for key, item in known.items():
            if key in value or key in required:
                item(value.get(key, Missing()), f"{where}.{key}" if where else key)

    return check
