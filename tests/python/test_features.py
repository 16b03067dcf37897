"""Every test, picture and file that the table of features names is there."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "features.md").read_text()
ROWS = [line for line in PAGE.splitlines() if line.startswith("| ") and "| shown by |" not in line]


def test_what_is_named_exists():
    named = re.findall(r"`(tests/[\w/.]+)::(\w+)`", PAGE)
    assert len(named) > 60
    for name, function in named:
        source = (ROOT / name).read_text()
        pattern = (
            rf"^TEST\w*\(\w+, {function}\)" if name.endswith(".cpp") else rf"^def {function}\("
        )
        assert re.search(pattern, source, re.MULTILINE), f"{name}::{function}"


def test_pictures_and_links_resolve():
    for target in re.findall(r"\]\(([^)]+)\)", PAGE):
        assert (ROOT / "docs" / target).is_file(), target


def test_every_row_is_shown_or_said_not_to_be_here():
    assert len(ROWS) > 50
    for row in ROWS:
        last = row.strip("| ").split(" | ")[-1]
        assert "`tests/" in last or "*not here*" in last, row
