"""What was done to a scene's materials, as lines of text."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

_TITLES = ("material", "before", "after", "picture", "seen at", "error added", "saved", "left out")


def lines(result: Mapping[str, Any]) -> list[str]:
    """A table of a result of `blender.simplify` with a row for each material, and what sums up."""
    told = list(_table([_TITLES, *map(_cells, result["materials"])])) if result["materials"] else []
    frames = ", ".join(map(str, result["frames"]))
    told.append(
        f"{result['error_added']:.3%} of error added to the picture at most, "
        f"{result['tolerance']:.3%} allowed, on frames {frames}"
    )
    told.append(
        f"{result['error']:.3%} is then off at most against the measurements, before "
        f"{result['error_before']:.3%}"
    )
    drawn = result["closures"]
    told.append(
        f"{drawn['after']:.2f} closures in a pixel on average, before {drawn['before']:.2f}"
    )
    seconds = result["seconds"]
    if seconds["after"] is not None:
        told.append(f"rendered in {seconds['after']:.2f} s, before in {seconds['before']:.2f} s")
    told.append(f"lit by {_lights(result)}")
    return told + _skipped(result)


def restored_lines(result: Mapping[str, Any]) -> list[str]:
    """What `blender.restore` put back."""
    told = [f"{name}: restored" for name in result["restored"]] or ["nothing to restore"]
    return told + _skipped(result)


def _skipped(result: Mapping[str, Any]) -> list[str]:
    return [f"{item['material']}: left as it is, {item['reason']}" for item in result["skipped"]]


def _lights(result: Mapping[str, Any]) -> str:
    told = [f"{count} {kind}" for kind, count in result["lights"].items()]
    told += ["a world"] if result["world"] else []
    return ", ".join(told) or "no lights"


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    angles = row["angles"]
    return (
        row["material"],
        _way(row["before"]),
        _way(row["after"]),
        f"{row['share']:.2%}",
        "never" if angles is None else f"{angles[0]:.0f} to {angles[1]:.0f} deg",
        f"{row['error_added']:.3%}",
        f"{row['closures_saved']:+.2f}",
        row["left_out"],
    )


def _way(way: Mapping[str, Any]) -> str:
    return f"{way['kind']} {way['count']}" if way["kind"] in ("lobe", "measured") else way["kind"]


def _table(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=True)]
        yield "  ".join(cells).rstrip()
