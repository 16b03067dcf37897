"""Says what still keeps the sources from being released: check_release.py [ROOT].

What a program can see of the checklist in docs/release.md: one version everywhere, a dated entry in
the changelog, packages that Blender can install and extensions.blender.org would take, and nothing
uncommitted.
"""

import hashlib
import json
import re
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path

_PYTHONS = ("cp311", "cp313")  # of Blender 4.2 to 5.0, and of 5.2
_MOST_BYTES = 10_000_000
_MOST_CHARACTERS = 64  # of what extensions.blender.org shows in a line
_PERMISSIONS = {"files", "clipboard"}


def problems(root: Path) -> Iterator[str]:
    """A sentence for each thing that is missing in the working tree `root`."""
    version = _toml(root / "pyproject.toml")["project"]["version"]
    yield from _other_versions(root, version)
    yield from _changelog(root, version)
    yield from _manifest(_toml(root / "addon" / "blender_manifest.toml"))
    yield from _distribution(root / "dist", version)
    yield from _repository(root, f"v{version}")


def _told(names: Iterable[str]) -> str:
    return ", ".join(sorted(names))


def _toml(path: Path) -> dict:
    return tomllib.loads(path.read_text(encoding="utf-8"))


def _other_versions(root: Path, version: str) -> Iterator[str]:
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        yield f"pyproject.toml: expected a version X.Y.Z, found {version}."
    found = _toml(root / "addon" / "blender_manifest.toml")["version"]
    if found != version:
        yield f"addon/blender_manifest.toml: expected version {version}, found {found}."
    named = set(re.findall(r"lobefit-(\d+\.\d+\.\d+)-", (root / "README.md").read_text()))
    if named != {version}:
        yield f"README.md: expected packages of version {version}, found {_told(named) or 'none'}."


def _changelog(root: Path, version: str) -> Iterator[str]:
    sections = re.split(r"^## ", (root / "CHANGELOG.md").read_text(), flags=re.MULTILINE)[1:]
    entries = {
        section.split("\n", 1)[0]: section.partition("\n")[2].strip() for section in sections
    }
    if entries.get("[Unreleased]"):
        yield f"CHANGELOG.md: expected all that changed under [{version}], found some Unreleased."
    title = next((title for title in entries if title.startswith(f"[{version}]")), "no such entry")
    if not re.fullmatch(r"\[[\d.]+\] - \d{4}-\d{2}-\d{2}", title):
        yield f"CHANGELOG.md: expected '[{version}] - YYYY-MM-DD', found '{title}'."
    elif not entries[title]:
        yield f"CHANGELOG.md: expected what changed in [{version}], found nothing."


def _manifest(manifest: dict) -> Iterator[str]:
    permissions = manifest.get("permissions", {})
    if permissions.keys() - _PERMISSIONS:
        yield f"addon/blender_manifest.toml: expected no permissions but {_told(_PERMISSIONS)}."
    lines = {"tagline": manifest["tagline"]} | permissions
    for name, line in lines.items():
        if len(line) > _MOST_CHARACTERS or not line[-1:].isalnum():
            yield (
                f"addon/blender_manifest.toml: expected {name} to have up to {_MOST_CHARACTERS} "
                f"characters and no full stop, found '{line}'."
            )


def _distribution(folder: Path, version: str) -> Iterator[str]:
    packages = sorted(folder.glob(f"lobefit-{version}-*.zip"))
    if not packages:
        yield f"dist: expected lobefit-{version}-linux-x64.zip, found none; ./dev package makes it."
        return
    for package in packages:
        yield from _package(package, version)
    if not (folder / f"lobefit-{version}.tar.gz").is_file():
        yield f"dist: expected the sources, lobefit-{version}.tar.gz, found none."
    index = folder / "index.json"
    listed = json.loads(index.read_text())["data"] if index.is_file() else []
    hashes = {entry["archive_hash"] for entry in listed}
    if hashes != {f"sha256:{hashlib.sha256(zip.read_bytes()).hexdigest()}" for zip in packages}:
        yield "dist: expected an index.json of these very packages, found another or none."


def _package(package: Path, version: str) -> Iterator[str]:
    if package.stat().st_size > _MOST_BYTES:
        yield f"{package.name}: expected under {_MOST_BYTES:,} bytes, found more."
    with zipfile.ZipFile(package) as archive:
        wheels = [name for name in archive.namelist() if name.startswith("wheels/")]
        for python in _PYTHONS:
            if not any(name.startswith(f"wheels/lobefit-{version}-{python}-") for name in wheels):
                yield f"{package.name}: expected a wheel of {version} for {python}, found none."
        for name in wheels:
            published = package.parent / Path(name).name
            if "-linux_" in name:
                yield f"{package.name}: expected a wheel for any Linux, found {published.name}."
            if not published.is_file() or published.read_bytes() != archive.read(name):
                yield f"{package.name}: expected {published.name} as it is in dist, found another."
        if not any(name.startswith("licenses/") for name in archive.namelist()):
            yield f"{package.name}: expected the licences of all inside, found none."


def _repository(root: Path, tag: str) -> Iterator[str]:
    def git(*arguments: str) -> str:
        words = ["git", "-C", str(root), *arguments]
        return subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()

    if git("status", "--porcelain"):
        yield "git: expected everything committed, found changes."
    if git("tag", "--list", tag):
        yield f"git: expected no tag {tag} yet, found one; is the version still the last one's?"


def main() -> int:
    """Prints every problem; 0 when there is none, else 1."""
    root = Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).resolve().parents[2]
    found = list(problems(root))
    print("\n".join(found or ["ready to be released"]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
