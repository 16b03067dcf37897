"""Packs the add-on and its wheels into the zip that Blender installs.

Usage: package_extension.py WHEELS OUTPUT, both folders. Run it where `bpy` is installed: the zip is
made and validated by the extension builder that comes with Blender.
"""

import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

root = Path(__file__).resolve().parents[2]


def run_extension_builder(*arguments: str) -> None:
    """Runs Blender's own `blender_ext.py`; raises CalledProcessError when it fails."""
    blender = Path(importlib.util.find_spec("bpy").origin).parent
    (builder,) = blender.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    subprocess.run([sys.executable, builder, *arguments], check=True)


def build_id_of(wheel: Path) -> str:
    """The build id that the compiled module of a wheel for this Python tells of itself."""
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(wheel).extractall(folder)
        question = "import lobefit._native; print(lobefit._native.build_id)"
        answer = subprocess.run(
            [sys.executable, "-c", question],
            check=True,
            cwd=folder,
            stdout=subprocess.PIPE,
            text=True,
        )
    return answer.stdout.strip()


def package_extension(wheels: list[Path], output: Path) -> Path:
    """Writes `lobefit-VERSION-linux-x64.zip` and copies of the wheels to the folder `output`."""
    python_tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    (own_wheel,) = (wheel for wheel in wheels if f"-{python_tag}-" in wheel.name)
    with tempfile.TemporaryDirectory() as folder:
        extension = Path(folder) / "lobefit"
        shutil.copytree(
            root / "addon", extension, ignore=shutil.ignore_patterns("__pycache__", ".*")
        )
        shutil.copy(root / "LICENSE", extension)
        (extension / "wheels").mkdir()
        output.mkdir(exist_ok=True)
        for wheel in wheels:
            shutil.copy(wheel, extension / "wheels")
            shutil.copy(wheel, output)
        manifest = extension / "blender_manifest.toml"
        names = [f"./wheels/{wheel.name}" for wheel in wheels]
        manifest.write_text(f"wheels = {json.dumps(names)}\n{manifest.read_text()}")
        build = {"build_id": build_id_of(own_wheel)}
        (extension / "build.json").write_text(json.dumps(build) + "\n")
        version = tomllib.loads(manifest.read_text())["version"]
        package = output / f"lobefit-{version}-linux-x64.zip"
        run_extension_builder("build", f"--source-dir={extension}", f"--output-filepath={package}")
    run_extension_builder("validate", str(package))
    return package


if __name__ == "__main__":
    wheel_folder, output_folder = map(Path, sys.argv[1:])
    package_extension(sorted(wheel_folder.glob("*.whl")), output_folder)
