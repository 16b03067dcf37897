"""The zip, as it was installed."""

import tomllib
from pathlib import Path

import lobefit
import lobefit._native

root = Path(__file__).resolve().parents[2]


def read_toml(path: str) -> dict:
    return tomllib.loads((root / path).read_text())


def test_versions_agree():
    version = read_toml("pyproject.toml")["project"]["version"]
    assert read_toml("addon/blender_manifest.toml")["version"] == version
    assert lobefit._native.version == version
    assert lobefit.__version__ == version
    assert f"## [{version}]" in (root / "CHANGELOG.md").read_text()
