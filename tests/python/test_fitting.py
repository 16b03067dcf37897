"""Fits through the Python interface."""

import hashlib
import inspect
import time
import typing

import lobefit
import numpy as np
import pytest
from lobefit import fitting


@pytest.fixture(scope="module")
def recovered(table):
    return lobefit.fit(table)


def test_a_known_truth_is_found(recovered, truth):
    found = recovered.parameters
    assert recovered.converged
    assert recovered.error["relative_l1"]["pooled"] < 1e-3
    for name in ("diffuse", "specular", "exponent", "interpolation", "ior"):
        np.testing.assert_allclose(found[name], truth[name], rtol=0.02)


def test_the_record_tells_its_source(recovered, table):
    assert recovered.source["path"] == str(table)
    assert recovered.source["sha256"] == hashlib.sha256(table.read_bytes()).hexdigest()
    assert recovered.source["format"] == "MERL"
    bins = recovered.source["bins"]
    assert bins["valid"] + bins["below_horizon"] == 90 * 90 * 180
    assert recovered.machine["version"] == lobefit.__version__


def test_the_record_is_read_back_the_same(recovered, tmp_path):
    recovered.save(tmp_path / "truth.json")
    assert lobefit.Record.load(tmp_path / "truth.json") == recovered


def test_a_measurement_without_a_file_can_be_fitted(table):
    record = lobefit.fit(lobefit.read(table), model="modified-phong", fresnel=False)
    assert record.source["path"] is None
    assert record.parameters["ior"] is None
    assert record.name == "measurement"


def test_all_models_are_fitted_and_the_best_speaks(all_models):
    record, _ = all_models
    assert list(record.fits) == ["modified-phong", "modified-blinn-phong", "interpolated"]
    least = min(fit.error["relative_l1"]["pooled"] for fit in record.fits.values())
    assert record.error["relative_l1"]["pooled"] == least
    assert record.model == "interpolated"


def test_progress_rises_to_the_end(all_models):
    _, seen = all_models
    shares = [share for share, _ in seen]
    assert shares == sorted(shares)
    assert all(0 <= share <= 1 for share in shares)
    assert any(stage for _, stage in seen)


def test_a_cancelled_job_has_no_record(table):
    job = lobefit.start_fit(table, model="all")
    job.cancel()
    with pytest.raises(lobefit.Cancelled):
        job.record()
    assert job.done


def test_a_job_answers_while_it_works(table):
    start = time.perf_counter()
    job = lobefit.start_fit(table)
    assert time.perf_counter() - start < 0.5
    assert 0 <= job.progress <= 1
    assert job.wait(0.0) in (True, False)
    assert job.record().model == "interpolated"
    assert job.done and job.progress == 1
    assert job.record() == job.record()


def test_an_exception_in_the_callback_ends_the_fit(table):
    def stop(share, stage):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lobefit.fit(table, model="all", progress=stop)


@pytest.mark.parametrize(
    ("option", "value"),
    [("model", "ward"), ("norm", "l3"), ("schedule", "all"), ("channels", "four")],
)
def test_unknown_options_are_named(table, option, value):
    with pytest.raises(lobefit.InputError, match=f"expected .* found '{value}'"):
        lobefit.fit(table, **{option: value})


def test_the_interface_is_typed():
    for name in lobefit.__all__:
        assert hasattr(lobefit, name)
    for function in (lobefit.read, lobefit.fit, lobefit.start_fit, fitting.Job.wait):
        hints = typing.get_type_hints(function)
        parameters = [name for name in inspect.signature(function).parameters if name != "self"]
        assert {"return", *parameters} == hints.keys()
    assert issubclass(lobefit.InputError, ValueError)
