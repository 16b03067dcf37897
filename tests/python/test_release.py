"""What `./dev release-check` sees of a working tree that is to be released."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "native" / "python" / "check_release.py"
PACKAGE = "dist/lobefit-1.2.3-linux-x64.zip"
CHANGES = "# Changelog\n\n## [Unreleased]\n\n## [1.2.3] - 2026-01-31\n\n- Faster.\n"
FILES = {
    ".gitignore": "/dist/\n",
    "pyproject.toml": '[project]\nversion = "1.2.3"\n',
    "addon/blender_manifest.toml": 'version = "1.2.3"\n',
    "README.md": f"`./dev package` writes `{PACKAGE}`.\n",
    "CHANGELOG.md": CHANGES,
}


def git(root: Path, *arguments: str) -> None:
    who = ["-c", "user.name=nobody", "-c", "user.email=nobody@localhost"]
    subprocess.run(["git", "-C", str(root), *who, *arguments], check=True, capture_output=True)


def write_package(root: Path, *pythons: str) -> None:
    (root / "dist").mkdir(exist_ok=True)
    with zipfile.ZipFile(root / PACKAGE, "w") as package:
        for python in pythons:
            package.writestr(f"wheels/lobefit-1.2.3-{python}-{python}-linux_x86_64.whl", b"")


@pytest.fixture
def tree(tmp_path):
    """A working tree in which nothing is missing."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    write_package(tmp_path, "cp311", "cp313")
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
            'version = "1.2.2"\n',
            "expected version 1.2.3, found 1.2.2",
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
    write_package(tree, "cp311")
    assert check(tree)[1] == [
        f"{Path(PACKAGE).name}: expected a wheel of 1.2.3 for cp313, found none."
    ]
    (tree / PACKAGE).unlink()
    assert "./dev package makes it" in check(tree)[1][0]


def test_a_version_is_released_once_and_committed(tree):
    (tree / "README.md").write_text(FILES["README.md"] + "\n")
    git(tree, "tag", "v1.2.3")
    told = check(tree)[1]
    assert told[0] == "git: expected everything committed, found changes."
    assert told[1].startswith("git: expected no tag v1.2.3 yet, found one")
