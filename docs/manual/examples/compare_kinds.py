"""Prints how far off a material is with 0 to 3 closures, and as a Principled BSDF.

python compare_kinds.py nickel.binary
"""

import sys

import lobefit


def grazing(table: dict[str, list[float]]) -> float:
    """The mean error over the view angles of more than 70 degrees."""
    rows = zip(table["view_angle"], table["relative_error"], strict=True)
    errors = [error for angle, error in rows if angle > 70]
    return sum(errors) / len(errors)


def main(measured: str) -> None:
    requests = [lobefit.Closures("measured", count) for count in range(4)]
    record = lobefit.fit(measured, closures=requests)
    print("kind        closures    error  grazing  seconds")
    for entry in record.closures:
        error, near = entry["error"], grazing(entry["by_view"])
        print(f"measured    {entry['count']:8} {error:8.4f} {near:8.4f} {entry['seconds']:8.2f}")
    print(f"principled  {'':8} {record.principled['error']:8.4f}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python compare_kinds.py nickel.binary")
    try:
        main(sys.argv[1])
    except lobefit.InputError as error:
        sys.exit(str(error))
