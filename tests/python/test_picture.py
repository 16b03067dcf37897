"""Pictures: PNG files, lettering, and the sheet of spheres."""

import struct
import zlib

import numpy as np
import pytest
from commands import refuse
from lobefit import lettering, picture, preview
from lobefit.command_line import main


def read_png(data: bytes) -> np.ndarray:
    """The pixels of an 8-bit RGB PNG without filters, after a check of every chunk."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, {}
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] == zlib.crc32(
            kind + body
        )
        chunks[kind] = body
        at += 12 + length
    columns, rows = struct.unpack(">II", chunks[b"IHDR"][:8])
    lines = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(rows, -1)
    assert not lines[:, 0].any()
    return lines[:, 1:].reshape(rows, columns, 3)


def test_a_png_holds_the_pixels():
    image = np.arange(5 * 7 * 3).reshape(5, 7, 3) / 255
    np.testing.assert_array_equal(read_png(picture.png(image)).ravel(), np.arange(105))


def test_the_curve_is_that_of_srgb():
    light = [0.0, 0.002, 0.0031308, 0.2140, 1.0]
    np.testing.assert_allclose(
        picture.encode(light), [0, 0.02584, 0.04045, 0.5, 1], atol=1e-4, rtol=0
    )


def test_exposure_cuts_off_and_blackens_the_unknown():
    np.testing.assert_array_equal(
        picture.expose([0.0, 1.0, 2.0, 9.0, np.nan, np.inf], 2.0), [0, 0.5, 1, 1, 0, 1]
    )


def test_every_printable_character_has_a_glyph_of_its_own():
    seen = set()
    for code in range(33, 127):
        image = picture.page(40, 40, 0)
        lettering.draw(image, chr(code), 5, 28, 24)
        assert image.max() > 0.9, chr(code)
        seen.add(image.tobytes())
    assert len(seen) == 94


def test_text_stays_inside_its_width_and_may_leave_the_image():
    image = picture.page(40, 300, 0)
    lettering.draw(image, "Sphinx of quartz", 20, 25, 18)
    columns = np.flatnonzero(image.any((0, 2)))
    assert columns[0] >= 18
    assert columns[-1] <= 22 + lettering.width("Sphinx of quartz", 18)
    for x, y in ((-50, 20), (290, 20), (100, -30), (100, 80)):
        lettering.draw(image, "outside", x, y, 18)


def test_letters_without_a_glyph_lose_their_accent():
    plain, accented = picture.page(30, 60, 0), picture.page(30, 60, 0)
    lettering.draw(plain, "e?", 5, 20, 18)
    lettering.draw(accented, "\u00e9\u03b1", 5, 20, 18)
    np.testing.assert_array_equal(plain, accented)


@pytest.mark.parametrize("size", [16, 61])
def test_a_sheet_has_a_row_a_material_and_a_column_a_picture(record, size):
    rows = [preview.row(record, None, size)] * 3
    assert list(rows[0].panels) == ["interpolated", "cycles"]
    one, three = preview.sheet(rows[:1], size), preview.sheet(rows, size)
    assert one.shape[1:] == three.shape[1:]
    assert size < one.shape[0] < 3 * size + 120
    assert (three.shape[0] - one.shape[0]) % 2 == 0
    assert three.shape[0] - one.shape[0] > 2 * size


def test_the_preview_of_a_record_shows_every_model(all_models, tmp_path):
    record, _ = all_models
    row = preview.row(record, preview.measurement_of(record), 48)
    titles = ["measured", "modified-phong", "modified-blinn-phong", "interpolated", "cycles"]
    assert list(row.panels) == [*titles, "difference"]
    record.save(tmp_path / "truth.json")
    output = tmp_path / "truth.png"
    assert main(["preview", str(tmp_path / "truth.json"), "--size", "48", "-o", str(output)]) == 0
    image = read_png(output.read_bytes())
    assert image.shape[1] > 6 * 48
    assert image.max() > 200


def test_the_preview_of_a_file_fits_it(table, tmp_path):
    output = tmp_path / "truth.png"
    options = ["--model", "modified-phong", "--schedule", "stages"]
    assert main(["preview", str(table), *options, "--size", "48", "-o", str(output)]) == 0
    assert read_png(output.read_bytes()).shape[1] > 4 * 48


def test_a_preview_is_a_png(record, tmp_path, capfd):
    record.save(tmp_path / "gold.json")
    told = refuse(capfd, "preview", tmp_path / "gold.json", "-o", tmp_path / "gold.jpg")
    assert "gold.jpg: expected a name that ends in .png." in told
    assert sorted(path.name for path in tmp_path.iterdir()) == ["gold.json"]


def test_the_preview_of_a_record_without_its_file(record, tmp_path):
    record.save(tmp_path / "gold.json")
    output = tmp_path / "gold.png"
    assert main(["preview", str(tmp_path / "gold.json"), "-o", str(output)]) == 0
    assert read_png(output.read_bytes()).max() > 200
