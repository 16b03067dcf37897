"""Runs every Blender test inside the packaged extension, installed in a fresh profile.

`./dev test` runs these tests in an environment where the wheel is not installed, so `lobefit` can
only be the copy that Blender unpacked from the zip.
"""

import importlib
import json
import os
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

EXTENSION = "bl_ext.user_default.lobefit"
EXIT_STATUS = pytest.StashKey[int]()
root = Path(__file__).resolve().parents[2]
profile = Path(tempfile.mkdtemp(prefix="lobefit-profile-"))
os.environ["BLENDER_USER_RESOURCES"] = str(profile)

import bpy  # noqa: E402 (Blender looks for its profile while it is imported)
import facets  # noqa: E402
import numpy as np  # noqa: E402


def newest_package() -> Path:
    """The zip that `./dev package` wrote last."""
    packages = sorted((root / "dist").glob("lobefit-*.zip"), key=lambda path: path.stat().st_mtime)
    if not packages:
        raise pytest.UsageError(
            "expected a zip of the extension in dist/, found none: ./dev package"
        )
    return packages[-1]


def pytest_sessionstart() -> None:
    """Installs the zip and makes sure that the installed module is the packaged one."""
    package = newest_package()
    try:
        bpy.ops.extensions.package_install_files(
            filepath=str(package), repo="user_default", enable_on_install=True
        )
    except RuntimeError as error:
        pytest.exit(f"Blender did not install {package}: {error}", returncode=3)
    if EXTENSION not in bpy.context.preferences.addons:
        pytest.exit(f"Blender installed {package}, but did not enable it", returncode=3)

    import lobefit._native

    assert Path(lobefit._native.__file__).is_relative_to(profile)
    build = json.loads(zipfile.ZipFile(package).read("build.json"))
    assert lobefit._native.build_id == build["build_id"]


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Disables the extension, as Blender does when it quits, and removes the profile."""
    bpy.ops.preferences.addon_disable(module=EXTENSION)
    shutil.rmtree(profile, ignore_errors=True)
    if bpy.app.version < (4, 3):
        # The bpy 4.2 wheel crashes when Python ends after its own glTF exporter has run, on the
        # default cube without any extension too, and the tests' verdict would be lost.
        sys.stdout.flush()
        os._exit(config.stash[EXIT_STATUS])


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Keeps the verdict for the end."""
    session.config.stash[EXIT_STATUS] = int(exitstatus)


@pytest.fixture(autouse=True)
def empty_file() -> None:
    """Starts every test from a file without data, and with the extension enabled."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


@pytest.fixture
def addon() -> ModuleType:
    """The installed extension as a package."""
    return importlib.import_module(EXTENSION)


@pytest.fixture
def two_lights(addon: ModuleType) -> ModuleType:
    """The extension's module that makes and renders the scene with two lights."""
    return importlib.import_module(f"{EXTENSION}.scene")


@pytest.fixture(scope="session")
def measured_file(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The path of a measurement made from a published fit."""
    from lobefit import _native

    path = tmp_path_factory.mktemp("measured") / "nickel.binary"
    _native.sample("nickel").write(str(path))
    return str(path)


@pytest.fixture
def material(addon: ModuleType, measured_file: str) -> bpy.types.Material:
    """The imported measurement as a material; there is no other in the file."""
    bpy.ops.lobefit.import_measured(filepath=measured_file)
    return bpy.data.materials[0]


@pytest.fixture
def render(tmp_path: Path) -> Callable[..., np.ndarray]:
    """Renders f cos of (N, 3) normals under one sun, exactly: (N, 3), by rows from below."""

    def rendered(material, light, normals=None, turn=None, flip=False):
        mesh = facets.facet_mesh(facets.sphere_normals() if normals is None else normals)
        mesh.materials.append(material)
        if flip:
            mesh.flip_normals()
        return facets.render_facets(tmp_path, mesh, light, turn)

    return rendered
