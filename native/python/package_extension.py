"""Packs the add-on and its wheels into the zips that Blender installs, one for each platform.

Usage: package_extension.py WHEELS OUTPUT, both folders. Run it where `bpy` is installed: zips are
made and validated by the extension builder that comes with Blender. It also writes index.json, by
which Blender updates from the folder OUTPUT, or from a site with what is in it.
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
from platform import machine

import markdown

root = Path(__file__).resolve().parents[2]

# Blender's name of a platform by the last tag of a wheel.
_PLATFORMS = {
    r"manylinux_\w+_x86_64": "linux-x64",
    r"manylinux_\w+_aarch64": "linux-arm64",
    r"macosx_\w+_x86_64": "macos-x64",
    r"macosx_\w+_arm64": "macos-arm64",
    r"win_amd64": "windows-x64",
    r"win_arm64": "windows-arm64",
}
_OWN_PLATFORM = {"x86_64": "linux-x64", "aarch64": "linux-arm64"}[machine()]

_INDEX = "index.md"
_PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>{title}</title>
<style>
:root {{ color-scheme: light dark }}
body {{ font: 16px/1.55 system-ui, sans-serif; max-width: 46rem; margin: 2rem auto; padding: 0 2% }}
img {{ max-width: 100% }} pre {{ overflow-x: auto }} table {{ border-collapse: collapse }}
td, th {{ padding: .25rem .8rem .25rem 0; text-align: left; border-bottom: 1px solid #8884 }}
</style>
{way_back}
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


def by_platform(wheels: list[Path]) -> dict[str, list[Path]]:
    """The wheels for each platform, as Blender calls it."""
    groups = {}
    for wheel in wheels:
        tag = wheel.stem.rpartition("-")[2]
        (platform,) = (name for pattern, name in _PLATFORMS.items() if re.fullmatch(pattern, tag))
        groups.setdefault(platform, []).append(wheel)
    return groups


def repack(package: Path) -> None:
    """Writes the zip again as one that tells nothing of the files it was made from."""
    with zipfile.ZipFile(package) as archive:
        contents = {name: archive.read(name) for name in sorted(archive.namelist())}
    with zipfile.ZipFile(package, "w") as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 2, 0, 0, 0))
            entry.external_attr = 0o644 << 16
            # A wheel is packed already.
            stored = name.endswith(".whl")
            method = zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED
            archive.writestr(entry, content, method, compresslevel=9)


def write_manual(pages: Path, output: Path) -> None:
    """Writes the manual's Markdown pages as HTML, links between them included, and its pictures."""
    shutil.copytree(pages, output, ignore=shutil.ignore_patterns("*.md"))
    for page in pages.glob("*.md"):
        text = page.read_text(encoding="utf-8")
        title = text.partition("\n")[0].removeprefix("# ")
        body = markdown.markdown(text, extensions=["tables", "fenced_code", "toc"])
        way_back = (
            "" if page.name == _INDEX else f'<p><a href="{_INDEX}">Lobefit: the manual</a></p>'
        )
        html = _PAGE.format(title=title, body=body, way_back=way_back)
        html = re.sub(r'href="([\w-]+)\.md', r'href="\1.html', html)
        (output / page.name).with_suffix(".html").write_text(html, encoding="utf-8")


def package_extension(platform: str, wheels: list[Path], build_id: str, output: Path) -> Path:
    """Writes `lobefit-VERSION-PLATFORM.zip` to the folder `output`."""
    with tempfile.TemporaryDirectory() as folder:
        extension = Path(folder) / "lobefit"
        shutil.copytree(
            root / "addon", extension, ignore=shutil.ignore_patterns("__pycache__", ".*")
        )
        shutil.copy(root / "LICENSE", extension)
        shutil.copytree(root / "native" / "third_party" / "licenses", extension / "licenses")
        (extension / "blend_files").mkdir()
        shutil.copy(root / "blend_files" / "two_lights.blend", extension / "blend_files")
        write_manual(root / "docs" / "manual", extension / "manual")
        (extension / "wheels").mkdir()
        for wheel in wheels:
            shutil.copy(wheel, extension / "wheels")
        manifest = extension / "blender_manifest.toml"
        names = [f"./wheels/{wheel.name}" for wheel in wheels]
        manifest.write_text(
            f"wheels = {json.dumps(names)}\nplatforms = {json.dumps([platform])}\n"
            f"{manifest.read_text()}"
        )
        (extension / "build.json").write_text(json.dumps({"build_id": build_id}) + "\n")
        version = tomllib.loads(manifest.read_text())["version"]
        package = output / f"lobefit-{version}-{platform}.zip"
        run_extension_builder("build", f"--source-dir={extension}", f"--output-filepath={package}")
    repack(package)
    run_extension_builder("validate", str(package))
    return package


def main() -> None:
    """Empties the folder of packages and fills it again."""
    wheel_folder, output = map(Path, sys.argv[1:])
    wheels = sorted(wheel_folder.glob("*.whl"))
    python_tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    own = by_platform(wheels)[_OWN_PLATFORM]
    (own_wheel,) = (wheel for wheel in own if f"-{python_tag}-" in wheel.name)
    build_id = build_id_of(own_wheel)
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir()
    for wheel in wheels:
        shutil.copy(wheel, output)
    for platform, group in by_platform(wheels).items():
        package_extension(platform, group, build_id, output)
    run_extension_builder("server-generate", f"--repo-dir={output}")


if __name__ == "__main__":
    main()
