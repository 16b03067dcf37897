"""Packs the add-on and its wheels into the zip that Blender installs.

Usage: package_extension.py WHEELS OUTPUT, both folders. Run it where `bpy` is installed: the zip is
made and validated by the extension builder that comes with Blender.
"""

import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

import markdown

root = Path(__file__).resolve().parents[2]

_PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>{title}</title>
<style>
:root {{ color-scheme: light dark }}
body {{ font: 16px/1.55 system-ui, sans-serif; max-width: 46rem; margin: 2rem auto; padding: 0 2% }}
img {{ max-width: 100% }} table {{ border-collapse: collapse }}
td, th {{ padding: .25rem .8rem .25rem 0; text-align: left; border-bottom: 1px solid #8884 }}
</style>
{body}
</html>
"""


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


def write_manual(pages: Path, output: Path) -> None:
    """Writes the manual's Markdown pages as HTML, links between them included, and its pictures."""
    shutil.copytree(pages, output, ignore=shutil.ignore_patterns("*.md"))
    for page in pages.glob("*.md"):
        text = page.read_text(encoding="utf-8")
        title = text.partition("\n")[0].removeprefix("# ")
        body = markdown.markdown(text, extensions=["tables", "fenced_code", "toc"])
        body = re.sub(r'href="([\w-]+)\.md', r'href="\1.html', body)
        html = _PAGE.format(title=title, body=body)
        (output / page.name).with_suffix(".html").write_text(html, encoding="utf-8")


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
        (extension / "blend_files").mkdir()
        shutil.copy(root / "blend_files" / "two_lights.blend", extension / "blend_files")
        write_manual(root / "docs" / "manual", extension / "manual")
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
