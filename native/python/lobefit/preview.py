"""Figure 1 of Nielsen et al. for any material: measurement and fits under two lights."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lobefit import _native, lettering, picture
from lobefit._native import Measurement
from lobefit.classic import as_classic
from lobefit.origin import read_unchanged
from lobefit.picture import FAINT, INK, PAPER, Image
from lobefit.record import Record
from lobefit.shown import Shown

AMPLIFIED = 4
SPHERE = 180  # pixels a sphere, if nothing else is asked for
THUMBNAIL = 256  # pixels of an asset's picture, as Blender shows it
FINER = 3  # spheres of a sheet are drawn this many times finer and then shrunk
FINER_AT_ONCE = 2  # those for which somebody waits
TITLES = {
    "measured": "measured",
    "modified-phong": "modified Phong",
    "modified-blinn-phong": "modified Blinn-Phong",
    "interpolated": "interpolated",
    "classic-phong": "classic Phong",
    "classic-blinn-phong": "classic Blinn-Phong",
    "cycles": "as Cycles will show it",
    "rendered": "rendered by Cycles",
    "difference": f"difference x{AMPLIFIED}",
}
FIGURES = {"relative_l1": "relative L1", "relative_l1_cosine": "cosine-weighted L1"}

# The radiance of the world of a thumbnail: three tenths of what a white diffuse surface that faces
# one of the lights has.
WORLD = 0.3 / np.pi
_MARGIN, _GAP, _CAPTION, _HEADER = 28, 18, 30, 56
_TEXT, _SMALL = 17.0, 15.0


@dataclass(frozen=True)
class Panel:
    """A sphere as an sRGB image, and the line to letter under it."""

    image: Image
    caption: str


@dataclass(frozen=True)
class Row:
    """The panels of one material by their column, a key of `TITLES`."""

    name: str
    panels: dict[str, Panel]


def measurement_of(record: Record) -> Measurement | None:
    """The measurement a record was fitted to, or None where its file is gone or another one."""
    return read_unchanged(record.source)


def row(
    record: Record,
    measurement: Measurement | None,
    size: int = SPHERE,
    rendered: NDArray[np.float32] | None = None,
    shown: Shown | None = None,
    classic: bool = False,
) -> Row:
    """The spheres of a record, all at the exposure that suits the first of them.

    `shown` is what Cycles is to show, as `_native.preview` takes it: if None, the measured closures
    in the record that are nearest, or else the live group. `rendered` is the radiance that Cycles
    itself gave, FINER * size pixels wide. With `classic` there are also the classic materials that
    come of the fit, as old renderers and games would show them.
    """
    linear = {"measured": _native.preview(measurement, size * FINER)} if measurement else {}
    for model, fit in record.fits.items():
        linear[model] = _native.preview(fit.parameters, size * FINER)
    materials = as_classic(record.parameters) if classic else {}
    for model, material in materials.items():
        linear[model] = _native.preview(("classic", material), size * FINER)
    shown = shown or _nearest(record)
    linear["cycles"] = _native.preview(shown, size * FINER)
    figure = record.leading_figure
    captions = {
        model: f"{FIGURES[figure]} {fit.error[figure]['pooled']:.3f}"
        for model, fit in record.fits.items()
    }
    for model, material in materials.items():
        powers = " ".join(f"{power:.4g}" for power in np.ravel(material["exponent"]))
        captions[model] = f"exponent {powers}"
    captions["cycles"] = _caption(shown, record)
    if rendered is not None:
        linear["rendered"] = rendered
        captions["rendered"] = f"{_apart(rendered, linear['cycles']):.4f} from the former"
    if measurement:
        linear["difference"] = AMPLIFIED * np.abs(linear["cycles"] - linear["measured"])
        apart = _apart(linear["cycles"], linear["measured"])
        captions["difference"] = f"{apart:.1%} of the light is off"
    white = picture.white_point(next(iter(linear.values())))
    return Row(
        record.name,
        {
            column: Panel(_sphere(image, white), captions.get(column, ""))
            for column, image in linear.items()
        },
    )


def compared(
    measurement: Measurement | None,
    shown: Shown,
    size: int = SPHERE,
    rendered: NDArray[np.float32] | None = None,
) -> dict[str, Image]:
    """The spheres `measured`, `cycles` and `difference` as sRGB images, exposed alike.

    `rendered` is what Cycles itself gave, FINER_AT_ONCE * size pixels wide; without it `shown` is
    drawn. Without a measurement there is the one sphere.
    """
    pixels = size * FINER_AT_ONCE
    linear = {"measured": _native.preview(measurement, pixels)} if measurement else {}
    linear["cycles"] = _native.preview(shown, pixels) if rendered is None else rendered
    if measurement:
        linear["difference"] = AMPLIFIED * np.abs(linear["cycles"] - linear["measured"])
    white = picture.white_point(next(iter(linear.values())))
    return {name: _sphere(image, white, FINER_AT_ONCE) for name, image in linear.items()}


def thumbnail(shown: Shown, size: int = THUMBNAIL) -> NDArray[np.float32]:
    """The sphere of an asset, sRGB with the share of the pixel it covers: (size, size, 4).

    `shown` is what Cycles shows, as `_native.preview` takes it. A faint white world around the two
    lights makes polished and dark materials seen. The exposure goes with the root of the mean light
    of a sphere: what is darker looks darker, but nothing looks black.
    """
    finer = 2  # is enough for one sphere; the next step would double the time
    linear = _native.preview(shown, size * finer, world=WORLD)
    place = (np.arange(size * finer) + 0.5) * 2 / (size * finer) - 1
    inside = (np.hypot(place, place[:, None]) < 1).astype(np.float32)[..., None]
    cover, light = (picture.shrink(image, finer) for image in (inside, exposed(linear)))
    return np.concatenate([picture.encode(light / cover.clip(1e-6)), cover], axis=2)


def exposed(linear: Image) -> Image:
    """The light of a thumbnail's sphere, (size, size, 3) and black around it, between 0 and 1."""
    white = 1 / np.pi + WORLD  # of a white diffuse surface that faces a light
    sphere = np.pi / 4 * linear.size
    mean = float(np.minimum(np.nan_to_num(linear), white).sum() / sphere)
    return picture.expose(linear, (white * mean) ** 0.5)


def sheet(rows: list[Row], size: int = SPHERE) -> Image:
    """The rows under each other, with titles over the columns and names at the left."""
    columns = [title for title in TITLES if any(title in row.panels for row in rows)]
    names = [_lines(row.name) for row in rows]
    beside = max(lettering.width(line, _TEXT) for lines in names for line in lines)
    left = int(_MARGIN + beside + _GAP)
    captions = [panel.caption for row in rows for panel in row.panels.values()]
    lettered = [lettering.width(TITLES[title], _TEXT) for title in columns]
    lettered += [lettering.width(caption, _SMALL) for caption in captions]
    wide = max(size, int(max(lettered)))
    step = wide + _GAP
    image = picture.page(
        _HEADER + len(rows) * (size + _CAPTION + _GAP) + _MARGIN - _GAP,
        left + len(columns) * step - _GAP + _MARGIN,
        PAPER,
    )
    for index, title in enumerate(columns):
        middle = left + index * step + wide / 2
        lettering.draw(image, TITLES[title], middle, _HEADER - 18, _TEXT, INK, "center")
    for index, (material, lines) in enumerate(zip(rows, names, strict=True)):
        top = _HEADER + index * (size + _CAPTION + _GAP)
        _letter_name(image, lines, left - _GAP, top + size / 2)
        for title, panel in material.panels.items():
            corner = left + columns.index(title) * step + (wide - size) // 2
            picture.paste(image, panel.image, top, corner, picture.disc(size))
            middle = corner + size / 2
            lettering.draw(image, panel.caption, middle, top + size + 21, _SMALL, FAINT, "center")
    return image


def _sphere(linear: NDArray[np.float32], white: float, finer: int = FINER) -> Image:
    return picture.encode(picture.shrink(picture.expose(linear, white), finer))


def _nearest(record: Record) -> Shown:
    measured = [entry for entry in record.closures if entry["target"] == "measured"]
    if measured:
        return "closures", min(measured, key=lambda entry: entry["error"])
    return "live", record.parameters


def _caption(shown: Shown, record: Record) -> str:
    kind, what = shown
    if kind == "closures":
        many = len(what["specular"])
        return f"{what['target']}, {many} specular closure{'' if many == 1 else 's'}"
    return f"from {TITLES[record.model]}" if kind == "live" else "best Principled BSDF"


def _apart(image: NDArray[np.float32], reference: NDArray[np.float32]) -> float:
    """The sum of all differences against the light of the reference, where both are known."""
    return float(np.nansum(np.abs(image - reference)) / np.nansum(reference).clip(1e-30))


def _lines(name: str) -> list[str]:
    """A name in two lines where it says in brackets what the material was made from."""
    head, bracket, tail = name.partition(" (")
    return [head, bracket.strip() + tail] if bracket else [head]


def _letter_name(image: Image, lines: list[str], right: float, middle: float) -> None:
    for index, (line, color) in enumerate(zip(lines, (INK, FAINT), strict=False)):
        baseline = middle + 6 + (index - (len(lines) - 1) / 2) * 24
        size = _TEXT if index == 0 else _SMALL
        lettering.draw(image, line, right, baseline, size, color, "right")
