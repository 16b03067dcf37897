"""Changes JSON as JSON: a mutator for readers that turn most changed bytes away at once."""

import json
import random
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

_ODD = (None, True, False, 0, -0.0, -1, 1, 2, 0.5, 1e-308, 1e308, 10**400, 90, "", "l1", [], {})


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Each container and key, or index, under which something stands."""
    keys = value if isinstance(value, dict) else range(len(value))
    if not isinstance(value, (dict, list)):
        return
    for key in keys:
        yield value, key
        yield from _places(value[key])


def _change(data: Any, choose: random.Random) -> None:
    places = list(_places(data))
    holder, key = choose.choice(places)
    other, other_key = choose.choice(places)
    what = choose.randrange(5)
    if what == 0:
        holder[key] = choose.choice(_ODD)
    elif what == 1:  # by its text, so that no container holds itself
        holder[key] = json.loads(json.dumps(other[other_key]))
    elif what == 2:
        del holder[key]
    elif what == 3 and isinstance(holder, list):
        holder.insert(key, json.loads(json.dumps(other[other_key])))
    elif isinstance(holder[key], (int, float)):
        holder[key] = choose.choice((-holder[key], holder[key] / 7, choose.uniform(0, 2)))


def _changed_bytes(data: bytes, choose: random.Random) -> bytes:
    start, end = sorted(choose.randrange(len(data) + 1) for _ in range(2))
    word = choose.choice((b"", b"{", b"[", b'"', b",", b"-", b"1e999", b"NaN", b"\\ud800", b"\xff"))
    return data[:start] + word + data[choose.choice((start, start + 1, end)) :]


def mutate(data: bytes, most: int, seed: int) -> bytes:
    """Changes what is JSON as such nine times in ten, else some bytes; a custom mutator."""
    choose = random.Random(seed)
    changed = b""
    if choose.randrange(10):
        # What is no JSON, or nothing but a number, is changed as bytes.
        with suppress(ValueError, TypeError, IndexError, RecursionError, OverflowError):
            value = json.loads(data)
            for _ in range(choose.randint(1, 3)):
                _change(value, choose)
            changed = json.dumps(value).encode()
    return (changed or _changed_bytes(data, choose))[:most]
