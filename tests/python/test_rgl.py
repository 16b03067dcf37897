"""RGL files: against known truths, another reader, and tables made of the same files by others."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from lobefit import InputError, _native, fit, read
from lobefit.command_line import main
from rgl_file import (
    directions,
    glossy_fields,
    random_fields,
    spectral_fields,
    write_tensor_file,
)

SHARED = Path(__file__).parents[3] / "shared" / "measured"
MEASURED = [
    "aurora_white",
    "cc_green_malachite",
    "chm_mint",
    "ilm_solo_m_68",
    "irid_flake_paint1",
    "vch_silk_blue",
]
HALF_TURN = tuple(np.linspace(-np.pi, 0, 5))
MERL_SCALE = np.array([1.0, 1.15, 1.66]) / 1500


@pytest.fixture(scope="module")
def glossy(tmp_path_factory) -> Path:
    return write_tensor_file(tmp_path_factory.mktemp("rgl") / "glossy.bsdf", glossy_fields())


@pytest.fixture
def brushed(tmp_path) -> Path:
    """An anisotropic file."""
    return write_tensor_file(tmp_path / "brushed.bsdf", random_fields(HALF_TURN))


def measured_file(name: str) -> Path:
    path = SHARED / "rgl" / f"{name}_rgb.bsdf"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    return path


def bins() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The indices (N,) of all bins above the horizon in a plane, and their light and viewer."""
    h, d, p = np.meshgrid(np.arange(90), np.arange(90), np.arange(180), indexing="ij")
    half = directions(((h + 0.5) / 90) ** 2 * np.pi / 2, np.zeros(h.shape))
    theta, phi = np.radians(d + 0.5)[..., None], np.radians(p + 0.5)[..., None]
    tangent = np.stack([half[..., 2], np.zeros(h.shape), -half[..., 0]], -1)
    across = np.sin(theta) * (np.cos(phi) * tangent + np.sin(phi) * np.array([0.0, 1.0, 0.0]))
    wi, wo = (np.cos(theta) * half + sign * across for sign in (1, -1))
    (above,) = np.nonzero((np.minimum(wi[..., 2], wo[..., 2]) > 0).ravel())
    return above, wi.reshape(-1, 3)[above], wo.reshape(-1, 3)[above]


def some_bins(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Within 87 degrees; beyond, half vectors in Mitsuba's single precision are off by .1 %."""
    indices, wi, wo = bins()
    (high,) = np.nonzero(np.minimum(wi[:, 2], wo[:, 2]) > 0.05)
    drawn = np.random.default_rng(5).choice(high, count, replace=False)
    return indices[drawn], wi[drawn], wo[drawn]


def some_angles(count: int) -> np.ndarray:
    """Elevations of light and viewer, and the azimuth between them, in radians."""
    rng = np.random.default_rng(2)
    low, high = np.radians([[[5.0], [5.0], [0.0]], [[75.0], [75.0], [360.0]]])
    return rng.uniform(low, high, (3, count))


def at_bins(planes: np.ndarray, indices: np.ndarray) -> np.ndarray:
    return planes.reshape(3, -1).T[indices]


def mitsuba_reader(path: Path):
    """f cos(theta_o) by Mitsuba's `measured` plugin, as a function of light and viewer (N, 3)."""
    mitsuba = pytest.importorskip("mitsuba", reason="mitsuba is absent")
    mitsuba.set_variant("scalar_rgb")
    bsdf = mitsuba.load_dict({"type": "measured", "filename": str(path)})
    context, interaction = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()

    def evaluate(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        values = []
        for light, viewer in zip(wi, wo, strict=True):
            interaction.wi = mitsuba.Vector3f(*light)
            values.append(np.array(bsdf.eval(context, interaction, mitsuba.Vector3f(*viewer))))
        return np.array(values)

    return evaluate


def reciprocal(evaluate, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """The reflectance that a table holds of what a file tells of f cos(theta_o)."""
    total = evaluate(wi, wo) + evaluate(wo, wi)
    return (total / (wi[:, 2:] + wo[:, 2:])).clip(0)


def assert_same(found: np.ndarray, expected: np.ndarray, part: float) -> None:
    """Within a part of each colour's largest channel; the others may be differences near zero."""
    assert (np.abs(found - expected) <= part * expected.max(axis=1, keepdims=True)).all()


def test_a_known_surface_is_fitted_and_its_record_says_where_it_is_from(glossy):
    record = fit(glossy, model="modified-blinn-phong", fresnel=False)
    assert record.source["format"] == "RGL"
    assert record.source["bins"]["negative"] == record.source["bins"]["non_finite"] == 0
    # 32 x 32 directions of the file, between which it is linear.
    assert record.parameters["diffuse"] == pytest.approx([0.5, 0.3, 0.1], rel=0.02)
    assert record.parameters["exponent"] == pytest.approx(40, rel=0.05)
    assert not any("anisotropic" in warning for warning in record.warnings)


def test_content_counts_and_not_the_suffix(glossy, tmp_path):
    other = tmp_path / "glossy.binary"
    other.write_bytes(glossy.read_bytes())
    assert read(other).format == "RGL"
    assert np.array_equal(read(other).values, read(glossy).values, equal_nan=True)


def test_an_anisotropic_file_is_warned_of(brushed, capfd):
    assert main(["info", "--json", str(brushed)]) == 0
    facts = json.loads(capfd.readouterr().out)
    assert facts["format"] == "RGL"
    assert "anisotropic" in facts["warnings"][0]
    assert "anisotropic" in fit(brushed, schedule="subsample").warnings[0]
    assert not _native.Rgl(brushed).isotropic


def test_a_folder_gives_all_that_can_be_read(glossy, table, tmp_path, capfd):
    (tmp_path / "glossy.bsdf").symlink_to(glossy)
    (tmp_path / "lobe.binary").symlink_to(table)
    (tmp_path / "zemax.bsdf").write_text("Source  Measured\nSymmetry  PlaneSymmetrical\n")
    out = tmp_path / "records"
    assert main(["fit", str(tmp_path), "--schedule", "subsample", "-o", str(out)]) == 1
    assert sorted(path.name for path in out.iterdir()) == ["glossy.json", "lobe.json"]
    assert "Zemax, LightTools" in capfd.readouterr().err


@pytest.mark.parametrize("phi_i", [(0.0,), HALF_TURN], ids=["isotropic", "anisotropic"])
def test_random_tables_agree_with_mitsuba(tmp_path, phi_i):
    path = write_tensor_file(tmp_path / "random.bsdf", random_fields(phi_i))
    evaluate = mitsuba_reader(path)
    theta_i, theta_o, turn = some_angles(500)
    weights = np.ones(len(phi_i))
    weights[[0, -1]] = 1.0 if len(phi_i) == 1 else 0.5
    # Mitsuba takes light from an end of the half turn that was measured for light from the other.
    inside = np.clip(phi_i, -np.pi + 1e-4, -1e-4) if len(phi_i) > 1 else phi_i
    expected = sum(
        weight * evaluate(directions(theta_i, phi + 0 * turn), directions(theta_o, phi + turn))
        for phi, weight in zip(inside, weights / weights.sum(), strict=True)
    )
    wi, wo = directions(theta_i, 0 * turn), directions(theta_o, turn)
    assert_same(_native.Rgl(path).evaluate(wi, wo), expected, 1e-3)


WAVELENGTHS = np.arange(360.0, 1001.0, 4.0)
SPECTRA = {
    "white": np.ones_like(WAVELENGTHS),
    "red": 1 / (1 + np.exp((600 - WAVELENGTHS) / 15)),
    "green": np.exp(-(((WAVELENGTHS - 540) / 40) ** 2)),
    "blue": 1 / (1 + np.exp((WAVELENGTHS - 490) / 12)),
    "ramp": 0.2 + 0.4 * (WAVELENGTHS - 400) / 600,
}


@pytest.mark.parametrize("name", SPECTRA)
def test_spectra_have_the_colours_of_the_tables_of_the_cie(tmp_path, name):
    mitsuba = pytest.importorskip("mitsuba", reason="mitsuba is absent")
    mitsuba.set_variant("scalar_spectral")
    daylight, interaction = mitsuba.load_dict({"type": "d65"}), mitsuba.SurfaceInteraction3f()
    observed = []
    for wavelength in map(float, WAVELENGTHS):
        interaction.wavelengths = wavelength
        power = np.array(daylight.eval(interaction)).ravel()[0]
        observed.append(power * np.array(mitsuba.cie1931_xyz(wavelength)).ravel()[:3])
    xyz_to_rgb = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    observed = np.array(observed)
    expected = xyz_to_rgb @ (SPECTRA[name] @ observed) / observed[:, 1].sum()

    wi, wo = directions(np.radians([20.0]), np.zeros(1)), directions(np.radians([30.0]), np.ones(1))
    values = [
        _native.Rgl(
            write_tensor_file(tmp_path / "s.bsdf", spectral_fields(WAVELENGTHS, spectrum))
        ).evaluate(wi, wo)[0]
        for spectrum in (SPECTRA[name], SPECTRA["white"])
    ]
    # The colour matching functions are fits, off by up to 2 % of their largest value.
    assert values[0] / values[1] == pytest.approx(expected, abs=0.007)


@pytest.mark.parametrize("name", MEASURED)
def test_tables_agree_with_mitsuba(name):
    path = measured_file(name)
    indices, wi, wo = some_bins(2000)
    expected = reciprocal(mitsuba_reader(path), wi, wo)
    found = at_bins(read(path).values, indices)
    assert_same(found, expected, 1e-3)


@pytest.mark.parametrize("name", MEASURED)
def test_the_file_agrees_with_tables_resampled_by_others(name):
    path = measured_file(name)
    spec = importlib.util.spec_from_file_location("expand", SHARED / "expand.py")
    expand = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(expand)
    stored = expand.decode((SHARED / "rgl" / f"{name}.xz").read_bytes())
    indices, wi, wo = bins()
    stored = at_bins(stored, indices)
    kept = (stored >= 0).all(axis=1)
    assert (~kept).sum() < 100  # at the horizon
    # The tables hold what the file tells of light and viewer, which is f cos(theta_o), clipped.
    found = _native.Rgl(path).evaluate(wi[kept], wo[kept]).clip(0) / MERL_SCALE
    error = np.abs(found - stored[kept])
    assert error.sum() < 5e-4 * stored[kept].sum()
    # Their values are 2^(n/400) - 2^-6 for whole n: half a step is .09 %. A channel that passes
    # through zero between brighter ones is off by more in float32.
    assert np.mean(error > 1e-3 * (stored[kept] + 2**-6)) < 1e-3


def test_files_hold_the_reflectance_times_the_cosine_of_the_viewer():
    rgl = _native.Rgl(measured_file("aurora_white"))
    theta_i, theta_o, turn = some_angles(20000)
    wi, wo = directions(theta_i, 0 * turn), directions(theta_o, turn)
    there, back = rgl.evaluate(wi, wo)[:, 1], rgl.evaluate(wo, wi)[:, 1]

    def asymmetry(first, second):
        return np.median(np.abs(first - second) / (first + second))

    assert asymmetry(there / wo[:, 2], back / wi[:, 2]) < 0.03 < 0.1 < asymmetry(there, back)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"gone.bsdf: expected .* found no such file"):
        _native.Rgl(tmp_path / "gone.bsdf")
