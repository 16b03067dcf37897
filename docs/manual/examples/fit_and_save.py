"""Fits a measured file, prints how far off the fit is, and saves its record.

python fit_and_save.py nickel.binary nickel.json
"""

import sys

import lobefit


def show(share: float, stage: str) -> None:
    """Tells how far the fit is, on one line."""
    print(f"\r{share:4.0%} {stage:32}", end="", file=sys.stderr)


def main(measured: str, output: str) -> None:
    record = lobefit.fit(measured, norm="cosine-l1", progress=show)
    print(file=sys.stderr)
    for name, value in record.parameters.items():
        print(f"{name:20} {value}")
    for name, figure in record.error.items():
        print(f"{name:20} {figure['pooled']:.4f}")
    for sentence in record.warnings:
        print(sentence)
    record.save(output)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python fit_and_save.py nickel.binary nickel.json")
    try:
        main(*sys.argv[1:])
    except lobefit.InputError as error:
        sys.exit(str(error))
