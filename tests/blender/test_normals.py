"""Normals from shading in the Image editor: on what Cycles rendered, and on images of bytes."""

import json

import bpy
import lobefit
import numpy as np
import pytest
from lobefit import picture
from lobefit.lights import Light, Lighting
from lobefit.normals import shade
from mathutils import Vector

SIZE = 48
PAINT = {"diffuse": (0.5, 0.3, 0.2), "specular": (0.3, 0.3, 0.3), "exponent": 40.0}
SOURCE = ("classic", {"model": "classic-phong", **{k: v for k, v in PAINT.items()}})


def sphere():
    """The normals of a sphere that fills the picture, the first row at the top."""
    centre = (2 * np.arange(SIZE) + 1) / SIZE - 1
    x, y = np.meshgrid(centre, -centre)
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    return np.where(z[..., None] > 0, np.stack([x, y, z], -1), 0)


def ring():
    return [
        Lighting([Light((np.cos(t), np.sin(t), 1.3), (3.0,) * 3)], image=f"{i}.exr")
        for i, t in enumerate(np.radians(range(0, 360, 60)))
    ]


@pytest.fixture
def lights(tmp_path):
    """Writes a file of lights and returns its path."""

    def written(lighting, named=True):
        pictures = [{"lights": [vars(light) for light in each.lights]} for each in lighting]
        for entry, each in zip(pictures, lighting, strict=True):
            entry |= {"image": each.image} if named else {}
        path = tmp_path / "lights.json"
        path.write_text(json.dumps({"schema": 1, "pictures": pictures}))
        return str(path)

    return written


def load(name, values, is_float=True):
    """An image of values (SIZE, SIZE, 3) with the sphere's alpha."""
    image = bpy.data.images.new(name, SIZE, SIZE, alpha=True, float_buffer=is_float)
    pixels = np.concatenate([values, sphere().any(-1)[..., None]], -1)[::-1]
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    return image


def normals_in(image):
    pixels = np.empty(SIZE * SIZE * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(SIZE, SIZE, 4)[::-1, :, :3] * 2 - 1


def median_error(image):
    found, true = normals_in(image), sphere()
    sines = np.linalg.norm(np.cross(found, true), axis=-1)
    return np.median(np.degrees(np.arctan2(sines, (found * true).sum(-1)))[true.any(-1)])


def test_a_material_that_cycles_rendered(addon, two_lights, material, lights):
    lighting = ring()
    scene = two_lights.two_lights_scene(material, SIZE)
    scene.cycles.samples = 1
    suns = [item for item in scene.objects if item.type == "LIGHT"]
    suns[0].data.energy = 3.0
    bpy.data.objects.remove(suns[1])
    for each in lighting:
        toward = Vector(each.lights[0].direction)
        suns[0].rotation_euler = toward.to_track_quat("Z", "Y").to_euler()
        load(each.image, two_lights.radiance(scene))
    path = lights(lighting)
    assert bpy.ops.lobefit.find_normals(filepath=path, material=material.name) == {"FINISHED"}
    image = bpy.data.images["0.exr Normals"]
    assert image.is_float and image.colorspace_settings.is_data and image.packed_file
    # The formula of the closures is within 1e-4 of what Cycles renders.
    assert median_error(image) < 0.3
    heights = bpy.data.images["0.exr Heights"]
    pixels = np.array(heights.pixels).reshape(SIZE, SIZE, 4)[..., 0]
    assert pixels.max() == pytest.approx(1)
    # A half sphere is half as high as the picture is wide; its rim tells little of that.
    assert heights["lobefit_scale"] == pytest.approx(0.5, rel=0.25)


def test_one_image_of_bytes_by_the_classic_model(addon, lights):
    lighting = ring()[:1]
    values = picture.encode(np.clip(shade(sphere(), lighting, SOURCE)[0], 0, 1))
    load("photograph", values, is_float=False)
    path = lights(lighting, named=False)
    arguments = {"surface": "classic-phong", "image": "photograph", "heights": False, **PAINT}
    assert bpy.ops.lobefit.find_normals(filepath=path, **arguments) == {"FINISHED"}
    assert median_error(bpy.data.images["photograph Normals"]) < 5
    assert "photograph Heights" not in bpy.data.images


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"material": "none such"}, "Material: expected one made of a measurement"),
        ({"surface": "classic-phong", "image": "gone"}, "Image: expected one named 'gone'"),
        ({"filepath": ""}, "File Path: expected a file of lights, found none"),
        ({"filepath": "/no/such.json"}, "expected a file of lights, found no such file"),
    ],
)
def test_what_it_cannot_start_with_is_refused(addon, lights, change, sentence):
    load("photograph", sphere())
    before = len(bpy.data.images)
    arguments = {"filepath": lights(ring()[:1], named=False), "image": "photograph", **change}
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.lobefit.find_normals(**arguments)
    assert len(bpy.data.images) == before


def test_work_tells_how_far_it_is_and_stops(addon):
    from bl_ext.user_default.lobefit.jobs import Estimate

    true, lighting = np.repeat(np.repeat(sphere(), 8, 0), 8, 1), ring()
    job = lobefit.normals.Job(shade(true, lighting, SOURCE), lighting, SOURCE, true.any(-1))
    work = Estimate(job)
    assert not work.advance(0.0) and 0 <= work.progress <= 1
    assert "Normals from shading" in work.text
    work.stop()
    with pytest.raises(lobefit.Cancelled):
        while not work.advance(0.1):
            pass
