"""What `./dev release-check` sees of a working tree that is to be released."""

import hashlib
import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "native" / "python" / "check_release.py"
PACKAGE = "dist/lobefit-1.2.3-linux-x64.zip"
CHANGES = "# Changelog\n\n## [Unreleased]\n\n## [1.2.3] - 2026-01-31\n\n- Faster.\n"
MANIFEST = 'version = "1.2.3"\ntagline = "Materials"\n[permissions]\nfiles = "Read tables"\n'
FILES = {
    ".gitignore": "/dist/\n",
    "pyproject.toml": '[project]\nversion = "1.2.3"\n',
    "addon/blender_manifest.toml": MANIFEST,
    "README.md": f"`./dev package` writes `{PACKAGE}`.\n",
    "CHANGELOG.md": CHANGES,
}


def git(root: Path, *arguments: str) -> None:
    who = ["-c", "user.name=nobody", "-c", "user.email=nobody@localhost"]
    subprocess.run(["git", "-C", str(root), *who, *arguments], check=True, capture_output=True)


def wheel_of(python: str, platform: str = "manylinux_2_28_x86_64") -> str:
    return f"lobefit-1.2.3-{python}-{python}-{platform}.whl"


def write_distribution(root: Path, *wheels: str, licences: bool = True) -> None:
    folder = root / "dist"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    with zipfile.ZipFile(root / PACKAGE, "w") as package:
        for wheel in wheels:
            (folder / wheel).write_bytes(wheel.encode())
            package.write(folder / wheel, f"wheels/{wheel}")
        if licences:
            package.writestr("licenses/eigen.txt", b"")
    (folder / "lobefit-1.2.3.tar.gz").touch()
    write_index(root)


def write_index(root: Path) -> None:
    digest = hashlib.sha256((root / PACKAGE).read_bytes()).hexdigest()
    entry = {"id": "lobefit", "archive_hash": f"sha256:{digest}"}
    (root / "dist" / "index.json").write_text(json.dumps({"data": [entry]}))


@pytest.fixture
def tree(tmp_path):
    """A working tree in which nothing is missing."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    write_distribution(tmp_path, wheel_of("cp311"), wheel_of("cp313"))
    git(tmp_path, "init")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-m", "All of it")
    return tmp_path


def check(root: Path) -> tuple[int, list[str]]:
    words = [sys.executable, str(SCRIPT), str(root)]
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True)
    return done.returncode, done.stdout.splitlines()


def test_a_tree_that_is_ready(tree):
    assert check(tree) == (0, ["ready to be released"])


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        (
            "addon/blender_manifest.toml",
            MANIFEST.replace("1.2.3", "1.2.2"),
            "expected version 1.2.3, found 1.2.2",
        ),
        (
            "addon/blender_manifest.toml",
            MANIFEST + 'network = "Ask"\n',
            "expected no permissions but clipboard, files.",
        ),
        (
            "addon/blender_manifest.toml",
            MANIFEST.replace("tables", "tables."),
            "expected files to have up to 64 characters and no full stop, found 'Read tables.'",
        ),
        (
            "addon/blender_manifest.toml",
            MANIFEST.replace("Materials", "Materials" * 8),
            "expected tagline to have up to 64 characters",
        ),
        ("README.md", "lobefit-1.2.2-linux-x64.zip", "of version 1.2.3, found 1.2.2."),
        ("README.md", "no package", "of version 1.2.3, found none."),
        (
            "CHANGELOG.md",
            CHANGES.replace("2026-01-31", "unreleased"),
            "found '[1.2.3] - unreleased'",
        ),
        ("CHANGELOG.md", CHANGES.replace("1.2.3", "1.2.2"), "found 'no such entry'"),
        (
            "CHANGELOG.md",
            CHANGES.replace("- Faster.", ""),
            "what changed in [1.2.3], found nothing",
        ),
        ("CHANGELOG.md", CHANGES.replace("ed]\n", "ed]\n\n- Later.\n", 1), "found some Unreleased"),
    ],
)
def test_what_is_missing_is_named(tree, name, text, sentence):
    (tree / name).write_text(text)
    git(tree, "commit", "--all", "-m", "Less of it")
    code, (told,) = check(tree)
    assert code == 1
    assert told.startswith(f"{name}: expected") and sentence in told


def test_a_package_for_every_python_is_asked_for(tree):
    write_distribution(tree, wheel_of("cp311"))
    assert check(tree)[1] == [
        f"{Path(PACKAGE).name}: expected a wheel of 1.2.3 for cp313, found none."
    ]
    (tree / PACKAGE).unlink()
    assert "./dev package makes it" in check(tree)[1][0]


def test_wheels_of_one_system_and_missing_licences_are_seen(tree):
    write_distribution(tree, wheel_of("cp311", "linux_x86_64"), wheel_of("cp313"), licences=False)
    told = check(tree)[1]
    assert [line.partition(": expected ")[2] for line in told] == [
        f"a wheel for any Linux, found {wheel_of('cp311', 'linux_x86_64')}.",
        "the licences of all inside, found none.",
    ]


def test_what_is_published_belongs_together(tree):
    (tree / "dist" / wheel_of("cp311")).write_bytes(b"another")
    (tree / "dist" / "lobefit-1.2.3.tar.gz").unlink()
    (tree / "dist" / "index.json").write_text('{"data": []}')
    told = check(tree)[1]
    assert [line.partition(": expected ")[2] for line in told] == [
        f"{wheel_of('cp311')} as it is in dist, found another.",
        "the sources, lobefit-1.2.3.tar.gz, found none.",
        "an index.json of these very packages, found another or none.",
    ]


def test_a_version_is_released_once_and_committed(tree):
    (tree / "README.md").write_text(FILES["README.md"] + "\n")
    git(tree, "tag", "v1.2.3")
    told = check(tree)[1]
    assert told[0] == "git: expected everything committed, found changes."
    assert told[1].startswith("git: expected no tag v1.2.3 yet, found one")
