"""Fits through the Python interface."""

import dataclasses
import hashlib
import inspect
import subprocess
import sys
import time
import typing

import lobefit
import numpy as np
import pytest
from lobefit import fitting, preview
from lobefit.command_line import main


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


def test_a_program_may_end_while_a_job_runs(table):
    program = f"import lobefit; job = lobefit.start_fit({str(table)!r}, model='all')"
    words = [sys.executable, "-P", "-c", program]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")


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


def test_another_option_is_named(table):
    with pytest.raises(TypeError, match=r"expected options among channels, .* found 'nrm'"):
        lobefit.fit(table, nrm="l1")


def test_the_record_tells_where_the_error_stands(recovered):
    parts = recovered.error_by_angle["half_difference"]
    # Five digits of each of the 225 parts are kept.
    assert np.sum(parts["measured"]) == pytest.approx(1, rel=1e-4)
    whole = recovered.error["relative_l1"]["pooled"]
    assert np.sum(parts["misfit"]) == pytest.approx(whole, rel=1e-4)
    seen = recovered.error["relative_l1_cosine"]["pooled"]
    assert sum(recovered.error_by_angle["view"]["misfit"]) == pytest.approx(seen, rel=1e-4)


def test_uncertainty_is_found_where_it_is_asked_for(recovered, table, truth):
    assert recovered.uncertainty is None
    record = lobefit.fit(table, uncertainty=True)
    assert record.uncertainty["blocks"] >= 20
    assert record.uncertainty["undetermined"] == []
    low, high = record.intervals["exponent"]
    assert low <= record.parameters["exponent"] <= high < 1.1 * truth["exponent"]
    assert record.parameters == recovered.parameters


@pytest.fixture(scope="module")
def approximated(table):
    """The record of a table with one closure, without a file behind it."""
    return lobefit.closures(lobefit.read(table), count=1)


def test_closures_are_read_back_the_same(approximated, tmp_path):
    approximated.save(tmp_path / "truth.json")
    assert lobefit.Record.load(tmp_path / "truth.json").closures == approximated.closures


def test_an_entry_tells_what_was_asked_for(approximated):
    (entry,) = approximated.closures
    assert (entry["target"], entry["count"], entry["cap_albedo"]) == ("measured", 1, False)
    assert len(entry["specular"]) == 1
    assert 0 < entry["error"] < 0.1
    assert entry["seconds"] > 0
    views = entry["by_view"]
    assert len(views["view_angle"]) == len(views["relative_error"])
    excess = np.array(views["closures_albedo"]) / np.array(views["target_albedo"])
    assert excess.max() <= 1.02


def test_an_entry_is_what_the_error_says(approximated, truth):
    # Seen at 45 degrees by lights of the plane of incidence; the error is a mean of all others too.
    angles = np.radians(np.linspace(-80, 80, 81))
    lights = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], -1)
    viewers = np.tile([0.5**0.5, 0.0, 0.5**0.5], (len(angles), 1))
    lobe = lobefit._native.evaluate_model(truth, lights, viewers) * lights[:, 2:]
    found = lobefit._native.evaluate_closures(approximated.closures[0], lights, viewers)
    assert np.abs(found - lobe).sum() / lobe.sum() < 3 * approximated.closures[0]["error"]


def test_closures_are_added_to_a_record_and_replaced(recovered):
    record = lobefit.closures(recovered, count=0)
    record = lobefit.closures(record, target="lobe", count=0)
    record = lobefit.closures(record, count=0, cap_albedo=True)
    kept = [(entry["target"], entry["count"], entry["cap_albedo"]) for entry in record.closures]
    assert kept == [("lobe", 0, False), ("measured", 0, True)]
    assert recovered.closures == []
    assert record.parameters == recovered.parameters


def test_a_tolerance_takes_as_few_closures_as_keep_to_it(recovered):
    (entry,) = lobefit.closures(recovered, target="lobe", tolerance=0.99).closures
    assert entry["count"] == 0


def test_closures_of_a_record_without_its_measurement(recovered, tmp_path):
    gone = tmp_path / "gone.binary"
    record = dataclasses.replace(recovered, source={**recovered.source, "path": str(gone)})
    with pytest.raises(lobefit.InputError, match=r"found no such file\.$") as caught:
        lobefit.closures(record, count=0)
    assert str(caught.value).startswith(f"{gone}: expected ")
    assert lobefit.closures(record, target="lobe", count=0).closures[0]["target"] == "lobe"


def test_closures_of_a_record_whose_measurement_was_replaced(recovered, tmp_path):
    other = tmp_path / "other.binary"
    lobefit._native.sample("nickel").write(str(other))
    source = {**recovered.source, "path": str(other), "sha256": "0" * 64}
    record = dataclasses.replace(recovered, source=source)
    with pytest.raises(lobefit.InputError, match=r"found another file\.$") as caught:
        lobefit.closures(record, count=0)
    assert str(caught.value).startswith(f"{other}: expected ")
    assert preview.measurement_of(record) is None
    assert lobefit.closures(record, target="lobe", count=0).closures[0]["target"] == "lobe"


def test_a_record_that_never_had_a_file_has_no_measurement(approximated):
    with pytest.raises(lobefit.InputError, match=r"^measurement: expected .*no such file\.$"):
        lobefit.closures(approximated, count=0)


@pytest.mark.parametrize(
    ("option", "value", "sentence"),
    [
        ("target", "albedo", "target: expected measured or lobe, found 'albedo'."),
        ("count", 4, "closures: expected 0 to 3, found 4."),
        ("count", -1, "closures: expected 0 to 3, found -1."),
    ],
)
def test_wrong_requests_for_closures_are_named(recovered, option, value, sentence):
    with pytest.raises(lobefit.InputError) as caught:
        lobefit.closures(recovered, **{option: value})
    assert str(caught.value) == sentence


def test_a_cancelled_search_for_closures_has_no_record(recovered):
    job = lobefit.start_fit(recovered, closures=[lobefit.Closures(count=3)])
    job.cancel()
    with pytest.raises(lobefit.Cancelled):
        job.record()


def test_the_interface_is_typed():
    for name in lobefit.__all__:
        assert hasattr(lobefit, name)
    functions = (lobefit.read, lobefit.fit, lobefit.start_fit, lobefit.closures, fitting.Job.wait)
    for function in functions:
        hints = typing.get_type_hints(function)
        parameters = [name for name in inspect.signature(function).parameters if name != "self"]
        assert {"return", *parameters} == hints.keys()
    assert issubclass(lobefit.InputError, ValueError)


def extreme(change, truth, tmp_path):
    """A file of the nastiest kind, made of the table of a lobe."""
    values = np.array(lobefit.Measurement.from_model(truth).values)
    path = tmp_path / "extreme.binary"
    lobefit._native.Measurement.from_values(change(values)).write(str(path))
    return path


def one_valid_bin(values):
    kept = np.full_like(values, -1.0)
    kept[:, 5, 40, 50] = values[:, 5, 40, 50]
    return kept


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda values: 0 * values, id="all zero"),
        pytest.param(one_valid_bin, id="one valid bin"),
        pytest.param(lambda values: 1e30 * values, id="times 1e30"),
        pytest.param(lambda values: 1e-30 * values, id="times 1e-30"),
        pytest.param(lambda values: 1e-310 * values, id="denormals"),
    ],
)
def test_extreme_tables_make_a_record_or_a_sentence(change, truth, tmp_path, capfd):
    path, record = extreme(change, truth, tmp_path), tmp_path / "extreme.json"
    assert main(["fit", str(path), "-o", str(record)]) == 0
    fitted = lobefit.Record.load(record)
    assert fitted.converged
    capfd.readouterr()
    status = main(["closures", str(record), "--closures", "1", "-o", str(record)])
    message = capfd.readouterr().err
    if status == 0:
        assert len(lobefit.Record.load(record).closures) == 1
    else:
        assert status == 2 and message.count("\n") == 1 and message.startswith("lobefit: ")
        assert lobefit.Record.load(record) == fitted


def test_a_table_without_a_valid_bin_is_named():
    black = lobefit._native.Measurement.from_values(np.full((3, 90, 90, 180), -1.0))
    with pytest.raises(lobefit.InputError, match=r"^measurement: expected .* no valid bin\.$"):
        lobefit.fit(black)
