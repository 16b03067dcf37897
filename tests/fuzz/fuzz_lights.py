"""Any bytes as a file of lights: read, or refused in one sentence, and what was read is finite.

Usage: fuzz_lights.py [FLAG OF LIBFUZZER..] CORPUS SEEDS
"""

import sys

import atheris
import numpy as np
from json_mutator import mutate

with atheris.instrument_imports(include=["lobefit.checks", "lobefit.lights"]):
    from lobefit import InputError
    from lobefit.lights import lights_from_json


def use(data: bytes) -> None:
    """Reads the lights of each picture."""
    try:
        lighting = lights_from_json(data, "damaged")
    except InputError as error:
        said = str(error)
        assert said.startswith("damaged: expected ") and said.endswith(".") and "\n" not in said
        return
    for picture in lighting:
        numbers = [
            picture.ambient,
            *(part for light in picture.entries()["lights"] for part in light),
        ]
        assert np.isfinite(numbers).all() and picture.exposure > 0


atheris.Setup(sys.argv, use, custom_mutator=mutate)
atheris.Fuzz()
