"""The manual speaks of what is there: its links, pictures, commands, options and labels."""

import ast
import importlib.util
import os
import re
import shlex
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import lobefit
import pytest
from lobefit import blender
from lobefit.command_line import _parser

ROOT = Path(__file__).resolve().parents[2]
PAGES = {path.stem: path.read_text() for path in (ROOT / "docs" / "manual").glob("*.md")}


def blocks(page: str, language: str) -> list[str]:
    """The fenced blocks of a page."""
    return re.findall(rf"^```{language}\n(.*?)^```", PAGES[page], re.MULTILINE | re.DOTALL)


def prose(page: str) -> str:
    """A page without its fenced blocks, each paragraph in one line."""
    return re.sub(
        r"(?<!\n)\n(?!\n)", " ", re.sub(r"^```.*?^```", "", PAGES[page], flags=re.M | re.S)
    )


class Links(HTMLParser):
    """What a page names and what it refers to."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.names: set[str] = set()
        self.targets: set[str] = set()
        self.feed(html)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        for key, value in attributes:
            if key == "id":
                self.names.add(value)
            if key in ("href", "src") and not value.startswith("https://"):
                self.targets.add(value)


@pytest.fixture(scope="module")
def packed(tmp_path_factory) -> Path:
    """The manual as the extension carries it."""
    path = ROOT / "native" / "python" / "package_extension.py"
    spec = importlib.util.spec_from_file_location("package_extension", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    output = tmp_path_factory.mktemp("packed") / "manual"
    module.write_manual(ROOT / "docs" / "manual", output)
    return output


def test_links_and_pictures_resolve(packed):
    pages = {path.name: Links(path.read_text()) for path in packed.glob("*.html")}
    assert len(pages) == len(PAGES)
    used = {"index.html"}
    for page in pages.values():
        for target in page.targets:
            name, _, place = target.partition("#")
            assert (packed / name).is_file(), target
            assert not place or place in pages[name].names, target
            used.add(name)
    # Nothing lies there that no page leads to.
    files = {str(path.relative_to(packed)) for path in packed.rglob("*") if path.is_file()}
    assert files == used


@pytest.mark.skipif(not blender.has_blender(), reason="bpy is not installed")
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "sh")])
def test_commands_do_what_they_say(page, tmp_path):
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for block in blocks(page, "sh"):
        done = subprocess.run(
            ["sh", "-e"],
            input=block,
            cwd=tmp_path,
            env=os.environ | {"PATH": path},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        for line in block.splitlines():
            words = shlex.split(line, comments=True)
            if "-o" in words:
                assert (tmp_path / words[words.index("-o") + 1]).exists(), line


def test_scripts_run(tmp_path, monkeypatch, table):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "nickel.binary").symlink_to(table)
    run = [block for block in blocks("scripting", "python") if "bpy" not in block]
    assert run
    for block in run:
        exec(compile(block, "scripting.md", "exec"), {})
    assert lobefit.Record.load(tmp_path / "nickel.json").closures


def commands() -> dict[str, set[str]]:
    """The long options of every command."""
    (found,) = (action for action in _parser()._actions if isinstance(action.choices, dict))
    return {
        name: {word for action in command._actions for word in action.option_strings}
        for name, command in found.choices.items()
    }


def test_commands_and_options_exist():
    known = commands()
    known["COMMAND"] = set.union(*known.values())
    for page in PAGES:
        for span in re.findall(r"`([^`\n]+)`", prose(page)):
            span = span.removeprefix("blender --command ")
            named = re.search(r"^lobefit ([a-z-]+|COMMAND)\b", span)
            command = named[1] if named else "COMMAND"
            assert command in known, span
            assert set(re.findall(r"--[a-z-]+", span)) <= known[command], span


def test_every_command_is_spoken_of():
    for name in commands():
        assert f"lobefit {name}" in PAGES["command-line"], name


def test_labels_are_those_of_the_extension():
    """What is bold is what the extension calls something; menus before it are Blender's."""
    texts = {
        node.value
        for path in (ROOT / "addon").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    labels = {text.partition(" (")[0] for text in texts}
    bold = {label for page in PAGES for label in re.findall(r"\*\*([^*]+)\*\*", prose(page))}
    assert len(bold) > 20
    assert [label for label in sorted(bold) if label.split(" > ")[-1] not in labels] == []


def test_names_of_the_package_exist():
    for name in re.findall(r"`lobefit\.(\w+)`", PAGES["scripting"].partition("## In Blender")[0]):
        assert name in lobefit.__all__, name
