"""Any bytes as a record: read, or refused in one sentence, and what was read can be used.

Usage: fuzz_record.py [FLAG OF LIBFUZZER..] CORPUS SEEDS
"""

import sys
from pathlib import Path

import atheris
from json_mutator import mutate

sys.path.append(str(Path(__file__).resolve().parents[1] / "python"))
with atheris.instrument_imports(include=["lobefit.record", "lobefit.command_line"]):
    from records import complaint

atheris.Setup(sys.argv, complaint, custom_mutator=mutate)
atheris.Fuzz()
