"""What several tests share: a table whose truth is known, and a record without a fit."""

from pathlib import Path

import pytest
from lobefit import Measurement, Record, fit
from records import TRUTH, plain_record


@pytest.fixture(scope="session")
def truth():
    return TRUTH


@pytest.fixture(scope="session")
def table(tmp_path_factory) -> Path:
    """A MERL file of the interpolated lobe with the parameters `truth`."""
    path = tmp_path_factory.mktemp("tables") / "truth.binary"
    Measurement.from_model(TRUTH).write(str(path))
    return path


@pytest.fixture(scope="session")
def all_models(table):
    """The record of every model fitted to `table`, and the progress that was told on the way."""
    seen = []
    record = fit(table, model="all", progress=lambda share, stage: seen.append((share, stage)))
    return record, seen


@pytest.fixture
def record() -> Record:
    return plain_record()
