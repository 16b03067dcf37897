"""Cheaper alterations of Phong's term: what the texts say of them, and the report's section."""

import csv
import io
from itertools import product

import numpy as np
import pytest
from lobefit import InputError, _native, alterations, report
from lobefit.alterations import EXPONENTS, GAMMAS, SQUARED, TITLES

VIEWER, LIGHT = np.array([0.0, 0.6, 0.8]), np.array([0.36, 0.48, -0.8])


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=0)


@pytest.fixture(scope="module")
def normals():
    # A number that no lanes divide.
    return unit(np.random.default_rng(4).normal(0, 1, (3, 10_007))).astype(np.float32)


def formula(term, exponent, gamma, normals):
    """The definitions, in double precision."""
    n = normals.astype(float)
    mirrored = 2 * (LIGHT @ n) * n - LIGHT[:, None]
    cosine, lit = VIEWER @ mirrored, LIGHT @ n > 0
    if term == "half-vector":
        return np.where(lit, np.maximum(unit(LIGHT + VIEWER) @ n, 0) ** (4 * exponent), 0)
    if term == "exact":
        return np.where(lit, np.maximum(cosine, 0) ** exponent, 0)
    if term == "dot":
        difference = 1 - cosine
    elif term == "difference":
        difference = ((mirrored - VIEWER[:, None]) ** 2).sum(0) / 2
    else:
        difference = (np.cross(mirrored.T, VIEWER) ** 2).sum(1) / 2
        lit &= cosine > 0
    return np.where(lit, np.maximum(1 - exponent / gamma * difference, 0) ** gamma, 0)


@pytest.mark.parametrize("term", TITLES)
def test_terms_are_their_formulas(term, normals):
    for exponent, gamma, lanes in product((0.7, 12.0, 200.0), GAMMAS, (False, True)):
        found = _native.phong_terms(term, exponent, gamma, LIGHT, VIEWER, normals, lanes)
        # Single precision: a rounding of lambda counts exponent times, that of a half vector's
        # cosine four times as often.
        expected = formula(term, exponent, gamma, normals)
        assert np.abs(found - expected).max() < 2e-6 + 1e-6 * exponent


def test_gamma_of_the_exponent_is_exact(normals):
    exact = formula("exact", 16.0, 0, normals)
    for term in ("dot", "difference"):
        found = _native.phong_terms(term, 16.0, 16, LIGHT, VIEWER, normals, True)
        assert np.abs(found - exact).max() < 1e-5


def test_the_error_falls_with_gamma(normals):
    exact = formula("exact", 400.0, 0, normals)
    for term in SQUARED:
        worst = [
            np.abs(_native.phong_terms(term, 400.0, gamma, LIGHT, VIEWER, normals, True) - exact)
            for gamma in GAMMAS
        ]
        # (1 - x/gamma)^gamma is off e^-x by 2 / (e^2 gamma) at most, to first order.
        expected = 2 / np.e**2 / np.array(GAMMAS)
        assert [each.max() for each in worst] == pytest.approx(expected, rel=0.2)


@pytest.mark.parametrize(
    ("changes", "found"),
    [({"term": "phong"}, "'phong'"), ({"gamma": 6}, "6"), ({"normals": np.zeros((2, 5))}, "")],
)
def test_what_is_no_term_is_refused(changes, found):
    arguments = {
        "term": "dot",
        "exponent": 9.0,
        "gamma": 8,
        "light": LIGHT,
        "viewer": VIEWER,
        "normals": np.ones((3, 5)),
        "lanes": True,
    }
    with pytest.raises(InputError, match=f"expected .*{found}"):
        _native.phong_terms(**arguments | changes)


def test_all_is_measured_and_told(record):
    measured = alterations.measure()
    assert len(measured) == len(EXPONENTS) * (2 + len(SQUARED) * len(GAMMAS))
    for each in measured:
        assert each.one_by_one > 0 and each.in_lanes > 0
        # Single precision alone; the worst is that of an exponent of 1000.
        assert (each.worst < 2e-4) == (each.term == "exact")
    lines = list(csv.DictReader(io.StringIO(alterations.table(measured))))
    assert len(lines) == len(measured)
    page = report.page([record], {}, (), {}, {}, measured)
    assert "Cheaper alterations" in page and "|R x V|^2 / 2" in page
    assert "Cheaper alterations" not in report.page([record], {}, (), {}, {})
