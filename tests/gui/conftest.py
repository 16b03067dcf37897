"""What the tests with a window have in common.

They need a Blender with a window and are skipped, with the reason, where there is none; see
`window.missing`. Their pictures go to build/gui.
"""

from collections.abc import Iterator

import pytest
from window import ROOT, Window, missing


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skips all of them where there is no window."""
    reason = missing()
    if reason:
        for item in items:
            item.add_marker(pytest.mark.skip(reason=reason))


def start() -> Window:
    """A Blender whose folder `downloads` holds the zip of the extension and measured files."""
    from lobefit import _native

    window = Window()
    window.downloads.mkdir()
    packages = sorted((ROOT / "dist").glob("lobefit-*.zip"), key=lambda path: path.stat().st_mtime)
    (window.downloads / packages[-1].name).write_bytes(packages[-1].read_bytes())
    for name in ("nickel", "violet-rubber"):
        _native.sample(name).write(str(window.downloads / f"{name}.binary"))
    return window


def start_installed() -> Window:
    """The same with the extension, nothing over the scene, and Cycles.

    The pictures that EEVEE makes of materials take minutes where no graphics card draws them.
    """
    window = start()
    (package,) = window.downloads.glob("*.zip")
    inside = str(window.inside / "downloads" / package.name)
    window.ask(
        "bpy.context.scene.render.engine = 'CYCLES'\n"
        f"bpy.ops.extensions.package_install_files(filepath={inside!r}, repo='user_default', "
        "enable_on_install=True)"
    )
    window.key("Escape")
    return window


@pytest.fixture
def window() -> Iterator[Window]:
    """A Blender as a new user finds it."""
    started = start()
    yield started
    started.close()


@pytest.fixture(scope="module")
def shared() -> Iterator[Window]:
    """A Blender with the extension for all tests of a module."""
    started = start_installed()
    yield started
    started.close()
