"""`lobefit normals` and `lobefit.normals`: pictures in files, the result in files, and refusals."""

import json

import numpy as np
import pytest
from commands import refuse
from lobefit import Cancelled, InputError, picture
from lobefit.command_line import main
from lobefit.images import read_image, write_image
from lobefit.lights import Light, Lighting
from lobefit.normals import Job, as_displacement, as_normal_map, normals, reflectance_of, shade

SIZE = 48
PAINT = {
    "model": "classic-blinn-phong",
    "diffuse": [0.5, 0.3, 0.2],
    "specular": [0.3, 0.3, 0.3],
    "exponent": 40.0,
}
SOURCE = ("classic", PAINT)
WORDS = ["--classic", "blinn-phong", "--diffuse", "0.5", "0.3", "0.2", "--specular", *["0.3"] * 3]
WORDS += ["--exponent", "40"]


def sphere(size=SIZE, radius=0.9):
    """The normals of a sphere, the first row at the top."""
    centre = (2 * np.arange(size) + 1) / size - 1
    x, y = np.meshgrid(centre, -centre)
    z = np.sqrt(np.maximum(radius**2 - x**2 - y**2, 0))
    return np.where(z[..., None] > 0, np.stack([x, y, z], -1) / radius, 0)


def ring():
    turns = np.radians(range(0, 360, 60))
    return [
        Lighting([Light((np.cos(t), np.sin(t), 1.3), (3.0, 2.9, 2.7))], image=f"{i}.exr")
        for i, t in enumerate(turns)
    ]


def median_error(found, true):
    shown = true.any(-1)
    sines = np.linalg.norm(np.cross(found, true), axis=-1)
    angles = np.degrees(np.arctan2(sines, (found * true).sum(-1)))
    return float(np.median(angles[shown]))


def lights_file(folder, lighting, suffix=".exr"):
    path = folder / "lights.json"
    pictures = [
        {
            "image": each.image.replace(".exr", suffix),
            "lights": [vars(light) for light in each.lights],
            "exposure": each.exposure,
        }
        for each in lighting
    ]
    path.write_text(json.dumps({"schema": 1, "pictures": pictures}))
    return path


@pytest.fixture
def renders(tmp_path):
    """EXR files of a sphere under six lights, and the file of lights."""
    for each, values in zip(ring(), shade(sphere(), ring(), SOURCE), strict=True):
        write_image(tmp_path / each.image, values)
    paths = [str(tmp_path / each.image) for each in ring()]
    return paths, str(lights_file(tmp_path, ring()))


def decoded(path):
    """The normals of a map, as a Normal Map node takes them."""
    return read_image(path, linear=True).light * 2 - 1


def test_normals_of_renders_in_files(renders, tmp_path, capfd):
    paths, lights = renders
    output, height = tmp_path / "normal.png", tmp_path / "height.exr"
    # Images find their lights by name, in any order.
    words = ["normals", *reversed(paths), "--lights", lights, *WORDS]
    assert main([*words, "--height", str(height), "-o", str(output), "--json"]) == 0
    told = json.loads(capfd.readouterr().out)
    assert told["pictures"] == 6 and told["pixels"] == sphere().any(-1).sum()
    # Pixels at the silhouette, half of them dark, are some per mille of the light.
    assert told["unexplained"] < 0.01
    # 16 bits are finer than what the estimate finds, and the estimate than .1 degrees.
    assert median_error(decoded(output), sphere()) < 0.1
    assert np.allclose(decoded(output)[0, 0], [0, 0, 1], atol=1e-4)
    heights = read_image(height).light[..., 0]
    # In widths of the picture: a dome of .9 half widths, of whose rim the slopes tell little.
    assert heights.max() == pytest.approx(0.45, rel=0.25)


def test_lights_in_the_wrong_order_leave_light_unexplained(renders, tmp_path, capfd):
    paths, _ = renders
    first, second, *others = ring()
    # All of them turned round would explain the mirror image of the sphere.
    swapped = [
        Lighting(first.lights, image=second.image),
        Lighting(second.lights, image=first.image),
        *others,
    ]
    words = ["normals", *paths, "--lights", str(lights_file(tmp_path, swapped)), *WORDS]
    assert main([*words, "-o", str(tmp_path / "normal.png"), "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["unexplained"] > 0.1


def test_eight_bits_are_decoded_from_srgb(tmp_path):
    exposed = [Lighting(each.lights, exposure=1.6, image=each.image) for each in ring()]
    levels = np.round(255 * picture.encode(np.clip(shade(sphere(), exposed, SOURCE), 0, 1)))
    assert (levels == 255).any()  # highlights are cut
    for each, values in zip(exposed, levels, strict=True):
        picture.write_png(tmp_path / each.image.replace(".exr", ".png"), values / 255)
    lights = lights_file(tmp_path, exposed, ".png")
    paths = [str(tmp_path / f"{i}.png") for i in range(6)]
    errors = {}
    for name, extra in {"sRGB": [], "linear": ["--linear"]}.items():
        output = tmp_path / f"{name}.exr"
        words = ["normals", *paths, "--lights", str(lights), *WORDS, *extra, "-o", str(output)]
        assert main(words) == 0
        errors[name] = median_error(decoded(output), sphere())
    # A step of 8 bits is about a per cent of brightness, half a degree of a normal at 45.
    assert errors["sRGB"] < 0.5 and errors["linear"] > 3


def test_the_mask_is_taken_from_alpha_or_a_file(renders, tmp_path):
    paths, lights = renders
    half = sphere().any(-1) & (np.arange(SIZE) < SIZE / 2)
    write_image(tmp_path / "mask.png", half.astype(float))
    covered = tmp_path / "covered"
    covered.mkdir()
    for path in paths:
        light = read_image(path).light * half[..., None]
        write_image(covered / path.split("/")[-1], np.concatenate([light, half[..., None]], -1))
    masked = [*paths, "--mask", str(tmp_path / "mask.png")]
    for words in (masked, [str(covered / path.split("/")[-1]) for path in paths]):
        output = tmp_path / "normal.exr"
        assert main(["normals", *words, "--lights", lights, *WORDS, "-o", str(output)]) == 0
        tilted = np.abs(decoded(output)[..., :2]).sum(-1) > 1e-6
        assert not (tilted & ~half).any() and tilted[half].mean() > 0.99


def test_a_record_tells_what_is_shown(record):
    assert reflectance_of(record) is record.parameters
    assert reflectance_of(record, "live") == ("live", record.parameters)
    assert reflectance_of(record, "principled") == ("principled", record.principled)
    with pytest.raises(InputError, match="expected closures of measured in the record, found none"):
        reflectance_of(record, "measured")


def test_a_measured_file_is_its_own_reflectance(table, tmp_path):
    import lobefit

    lighting = ring()
    for each, values in zip(lighting, shade(sphere(), lighting, lobefit.read(table)), strict=True):
        write_image(tmp_path / each.image, values)
    paths = [str(tmp_path / each.image) for each in lighting]
    output = tmp_path / "normal.exr"
    words = ["--lights", str(lights_file(tmp_path, lighting)), "--material", str(table)]
    assert main(["normals", *paths, *words, "-o", str(output)]) == 0
    # Between the bins of a table, a degree and more apart, it is interpolated.
    assert median_error(decoded(output), sphere()) < 0.2


def test_noise_is_estimated():
    lighting, true = ring(), sphere(96)
    clean = shade(true, lighting, SOURCE)
    noisy = clean + np.random.default_rng(3).normal(0, 0.01 * clean.max(), clean.shape)
    mask = true.any(-1)
    found = normals(noisy, lighting, SOURCE, mask=mask).normals
    blind = normals(noisy, lighting, SOURCE, mask=mask, noise=0.0).normals
    assert median_error(found, true) < 2
    assert median_error(found, true) < median_error(blind, true)


def test_one_light_is_enough_for_a_sphere():
    true, lighting = sphere(64), ring()[:1]
    found = normals(shade(true, lighting, SOURCE), lighting, SOURCE, mask=true.any(-1))
    assert median_error(found.normals, true) < 3


def test_maps_are_those_of_blender():
    colors = as_normal_map(np.array([[[0, 0, 1], [1, 0, 0], [0, -1, 0], [0, 0, 0]]], np.float32))
    expected = [[0.5, 0.5, 1], [1, 0.5, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 1]]
    assert np.allclose(colors[0], expected)
    heights, scale = as_displacement(np.array([[0, 1, 2, 4]], np.float32))
    assert heights.max() == 1 and scale == 1
    heights, scale = as_displacement(np.zeros((2, 2), np.float32))
    assert heights.max() == 0 and scale == 0


def test_a_job_tells_how_far_it_is_and_ends_when_asked():
    true, lighting = sphere(256), ring()
    pictures = shade(true, lighting, SOURCE)
    job = Job(pictures, lighting, SOURCE, true.any(-1), threads=1)
    seen = set()
    while not job.wait(0.01):
        seen.add(job.stage)
        assert 0 <= job.progress <= 1
    assert "normals" in seen
    job = Job(pictures, lighting, SOURCE, true.any(-1), threads=1)
    job.cancel()
    assert job.wait(60)
    with pytest.raises(Cancelled):
        job.surface()


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        (["--exponent"], "expected the parameters of the classic model, found no --exponent."),
        (["--kind", "live"], "found --kind, which is of records."),
        (["-o", "out.jpg"], "expected a name that ends in .png or .exr."),
        (["--height", "no/such/folder.png"], "its folder does not exist."),
        (["--mask", "missing.png"], "missing.png: expected a picture, found no such file."),
        (["--noise", "-1"], "expected a value from 0.0 to 1000000.0"),
    ],
)
def test_wrong_use_is_one_sentence(renders, tmp_path, capfd, changed, sentence):
    paths, lights = renders
    words = [*WORDS, "-o", str(tmp_path / "normal.png")]
    if changed == ["--exponent"]:
        del words[words.index("--exponent") : words.index("--exponent") + 2]
        changed = []
    told = refuse(capfd, "normals", *paths, "--lights", lights, *words, *changed)
    assert sentence.replace("0.0 to 1000000.0", "0") in told
    assert not (tmp_path / "normal.png").exists()


def test_a_wrong_source_is_one_sentence():
    true, lighting = sphere(4), ring()[:1]
    for source, found in [(5, "int"), (("classic",), "tuple"), ("nickel.binary", "str")]:
        with pytest.raises(
            InputError, match=rf"^source: expected a Measurement.* found {found}\.$"
        ):
            shade(true, lighting, source)
        with pytest.raises(InputError, match=rf"^source: .* found {found}\.$"):
            Job(np.ones((1, 4, 4, 3)), lighting, source, true.any(-1))
    with pytest.raises(InputError, match=r"^source: expected 'live'.* found 'matte'"):
        shade(true, lighting, ("matte", {}))


def test_no_picture_is_written_over(renders, tmp_path, capfd):
    paths, lights = renders
    before = (tmp_path / "0.exr").read_bytes()
    words = ["normals", *paths, "--lights", lights, *WORDS]
    told = refuse(capfd, *words, "-o", paths[0])
    assert f"found {paths[0]}, which is read." in told
    assert (tmp_path / "0.exr").read_bytes() == before
    same = str(tmp_path / "same.png")
    assert "which is written too" in refuse(capfd, *words, "-o", same, "--height", same)


def test_pictures_that_do_not_fit_are_refused(renders, tmp_path, capfd, table):
    paths, lights = renders
    output = ["-o", str(tmp_path / "normal.png")]
    told = refuse(capfd, "normals", *paths[:5], "--lights", lights, *WORDS, *output)
    assert "as many pictures as images, 5, found 6" in told
    for content, found in ((b"no picture", "another kind of file"), (b"", "another kind of file")):
        (tmp_path / "0.exr").write_bytes(content)
        told = refuse(capfd, "normals", *paths, "--lights", lights, *WORDS, *output)
        assert f"0.exr: expected a picture, found {found}." in told
    write_image(tmp_path / "0.exr", np.zeros((10, 20, 3)))
    told = refuse(capfd, "normals", *paths, "--lights", lights, *WORDS, *output)
    assert f"expected a picture of 20 x 10 pixels, found {SIZE} x {SIZE}." in told
    for path in paths:
        write_image(path, np.zeros((SIZE, SIZE, 3)))
    told = refuse(capfd, "normals", *paths, "--lights", lights, *WORDS, *output)
    assert "expected pixels that show the surface, found none" in told
    words = ["--material", str(table), "--kind", "live", *output]
    assert "expected a record for --kind" in refuse(
        capfd, "normals", *paths, "--lights", lights, *words
    )
    assert not (tmp_path / "normal.png").exists()


def test_a_cut_picture_is_refused(renders, tmp_path, capfd):
    paths, lights = renders
    whole = (tmp_path / "3.exr").read_bytes()
    for end in range(0, len(whole), max(len(whole) // 40, 1)):
        (tmp_path / "3.exr").write_bytes(whole[:end])
        words = [*WORDS, "-o", str(tmp_path / "normal.png")]
        assert "3.exr" in refuse(capfd, "normals", *paths, "--lights", lights, *words)
