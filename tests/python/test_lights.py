"""The file of lights: read as written, and one sentence for anything that is not one."""

import copy
import json
import math
import os
from collections.abc import Iterator

import pytest
from lobefit import InputError
from lobefit.lights import MOST_LIGHTS, MOST_PICTURES, in_order, lights_from_json, read_lights

FILE = {
    "schema": 1,
    "pictures": [
        {
            "image": "left.png",
            "lights": [{"direction": [-1, 0.5, 1.2], "irradiance": [3.1, 3, 2.8]}],
            "ambient": 0.02,
            "exposure": 0.5,
        },
        {
            "image": "right.png",
            "lights": [
                {"direction": [1e-3, 0, 0], "irradiance": 2},
                {"direction": [0, 0, -5], "irradiance": [0, 0, 1]},
            ],
        },
    ],
}


def refusal(data) -> str:
    """The sentence with which data, or a text, is refused."""
    text = data if isinstance(data, (str, bytes)) else json.dumps(data)
    with pytest.raises(InputError) as caught:
        lights_from_json(text, "lights.json")
    sentence = str(caught.value)
    assert sentence.startswith("lights.json: expected ")
    assert sentence.endswith(".") and "\n" not in sentence and ", found " in sentence
    assert len(sentence) < 200
    return sentence


def test_a_file_is_read_as_written(tmp_path):
    path = tmp_path / "lights.json"
    path.write_text(json.dumps(FILE))
    left, right = read_lights(path)
    assert left.lights[0].direction == (-1, 0.5, 1.2)
    assert left.lights[0].irradiance == (3.1, 3, 2.8)
    assert (left.ambient, left.exposure, left.image) == ((0.02,) * 3, 0.5, "left.png")
    assert right.lights[0].irradiance == (2, 2, 2)
    assert right.lights[1].direction == (0, 0, -5)
    assert (right.ambient, right.exposure) == ((0, 0, 0), 1)


def test_images_find_their_lights():
    lighting = lights_from_json(json.dumps(FILE))
    found = in_order(lighting, ["right.png", "left.png"], "lights.json")
    assert [each.image for each in found] == ["right.png", "left.png"]
    unnamed = copy.deepcopy(FILE)
    for picture in unnamed["pictures"]:
        del picture["image"]
    lighting_in_order = lights_from_json(json.dumps(unnamed))
    assert in_order(lighting_in_order, ["b.png", "a.png"], "x")[0].lights == lighting[0].lights
    for names, wrong in (
        (["left.png"], "as many pictures as images, 1, found 2"),
        (["left.png", "middle.png"], "the lights of middle.png, found no such picture"),
        (["left.png", "left.png"], "images of different names"),
    ):
        with pytest.raises(InputError, match=wrong):
            in_order(lighting, names, "lights.json")


def places(data, path=()) -> Iterator[tuple]:
    """Where each value of the file stands."""
    if path:
        yield path
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in items if isinstance(data, (dict, list)) else ():
        if isinstance(value, (dict, list)):
            yield from places(value, (*path, key))
        else:
            yield (*path, key)


PLACES = list(places(FILE))


def changed(path, value):
    """The file with one value replaced, or removed where that is `...`."""
    data = copy.deepcopy(FILE)
    inside = data
    for key in path[:-1]:
        inside = inside[key]
    if value is ...:
        del inside[path[-1]]
    else:
        inside[path[-1]] = value
    return data


@pytest.mark.parametrize("path", PLACES, ids=lambda path: ".".join(map(str, path)))
def test_damage_anywhere_is_refused_in_one_sentence(path):
    key = path[-1]
    # One of two pictures or lights less is a file of another scene, not a damaged one.
    only_light = path == ("pictures", 0, "lights", 0)
    if key not in ("ambient", "exposure") and (key not in (0, 1) or only_light):
        refusal(changed(path, ...))
    for wrong in (None, True, {}, [], "", [[]], -1e300, 10**400, [1, 2], [1, 2, 3, 4]):
        refusal(changed(path, wrong))
    if isinstance(key, int) or key in ("ambient", "exposure"):
        for absurd in (1e7, -1e7):
            refusal(changed(path, absurd))
    if key in ("ambient", "exposure", "irradiance") or "irradiance" in path:
        refusal(changed(path, -0.001))


@pytest.mark.parametrize("constant", ["NaN", "Infinity", "-Infinity"])
def test_constants_that_json_does_not_have_are_refused(constant):
    for value in ("-1,", "3.1", "0.02", "0.5}"):
        text = json.dumps(FILE).replace(value, value.replace(value.strip(",}"), constant), 1)
        assert constant in refusal(text)


def test_sentences_say_what_is_wrong():
    light = ("pictures", 0, "lights", 0)
    for data, sentence in {
        "": "a file of lights in JSON, found Expecting value",
        b"\xff\xfe{": "a file of lights in UTF-8, found other bytes",
        "[" * 100_000: "a file of lights, found JSON nested too deeply",
        "[]": "the lights to be an object, found []",
        '{"schema": 1, "schema": 1}': "found the key 'schema' twice in one object",
        " " * (1 << 20) + "{}": "of up to 1 MiB, found a larger one",
    }.items():
        assert sentence in refusal(data)
    for path, value, sentence in (
        (("schema",), 2, "schema to be 1, found 2"),
        (("pictures",), [], f"pictures to be a list of 1 to {MOST_PICTURES}, found one of 0"),
        ((*light, "direction"), [0, 0, 0], "lights[0].direction to be a direction"),
        ((*light, "direction"), [0, 1], "direction to be a list of 3, found [0, 1]"),
        ((*light, "direction"), ..., "direction to be a list of 3, found nothing"),
        ((*light, "irradiance"), 0, "irradiance to be above 0 in one channel at least, found 0"),
        ((*light, "irradiance"), [1, 2, -3], "irradiance to be one number or three, from 0 to 1e6"),
        ((*light, "irradience"), 1, "the key in pictures[0].lights[0] to be one of direction, "),
        (("pictures", 0, "exposure"), 0, "pictures[0].exposure to be a number from 1e-6 to 1e6"),
        (("pictures", 0, "image"), "right.png", "pictures to be of different images"),
        (("pictures", 1, "image"), ..., "the key image to be in every picture or in none"),
    ):
        assert sentence in refusal(changed(path, value))


def test_too_many_are_refused():
    picture = {"lights": FILE["pictures"][1]["lights"][:1]}
    refusal({"schema": 1, "pictures": [picture] * (MOST_PICTURES + 1)})
    lights = picture["lights"] * (MOST_LIGHTS + 1)
    assert f"1 to {MOST_LIGHTS}" in refusal({"schema": 1, "pictures": [{"lights": lights}]})
    lights_from_json(json.dumps({"schema": 1, "pictures": [picture] * MOST_PICTURES}))


def test_every_cut_is_refused():
    text = json.dumps(FILE)
    for end in range(len(text)):
        refusal(text[:end])


def test_damaged_bytes_are_refused_or_read():
    """Every byte damaged in three ways: an odd one is noticed, or makes another valid file."""
    text = json.dumps(FILE).encode()
    for place in range(len(text)):
        for damage in (0x00, 0x2D, 0xFF):
            try:
                for each in lights_from_json(text[:place] + bytes([damage]) + text[place + 1 :]):
                    numbers = [*each.ambient, each.exposure]
                    numbers += [x for light in each.lights for x in light.direction]
                    assert all(map(math.isfinite, numbers))
            except InputError as error:
                assert "\n" not in str(error)


def test_files_that_cannot_be_read_are_named(tmp_path):
    for path, found in ((tmp_path, "a folder"), (tmp_path / "none.json", "no such file")):
        with pytest.raises(InputError, match=f"expected a file of lights, found {found}"):
            read_lights(path)
    locked = tmp_path / "locked.json"
    locked.write_text("{}")
    locked.chmod(0)
    if os.geteuid() != 0:
        with pytest.raises(InputError, match="permission was denied"):
            read_lights(locked)
