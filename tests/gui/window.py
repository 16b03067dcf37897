"""A Blender with a window, on a virtual display: used by mouse and keys, looked at by pictures."""

import json
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
DISPLAY = os.environ.get("LOBEFIT_DISPLAY", ":77")
HEIGHT = 1000  # pixels of the display; Blender counts them from below
PATIENCE = 120  # seconds after which what should have happened never will

# Hands files of the downloads to the viewport, as the system does when they are dropped there;
# Blender's own File Browser drags one file at a time.
_DROP = """
window = bpy.context.window_manager.windows[0]
area = next(a for a in window.screen.areas if a.type == 'VIEW_3D')
region = next(r for r in area.regions if r.type == 'WINDOW')
with bpy.context.temp_override(window=window, area=area, region=region):
    result = list(bpy.ops.lobefit.import_measured(
        'INVOKE_DEFAULT', directory={directory!r}, files={files!r}
    ))
"""

Place = tuple[float, float]


def missing() -> str:
    """What such a Blender lacks on this machine, and how to name it; empty where it is there."""
    for name, what in (
        ("LOBEFIT_GUI_BLENDER", "the program gui-blender"),
        ("LOBEFIT_GUI_FOLDER", "the folder that `gui-blender setup` made"),
    ):
        if not Path(os.environ.get(name, "")).exists() or not os.environ.get(name):
            return f"no Blender with a window: ${name} does not name {what}"
    return "" if shutil.which("xdotool") else "no xdotool to click with"


class Window:
    """One run of Blender from factory settings in an empty profile; `clicks` counts what was done.

    `folder` is the place of files that both sides see, `inside` its path in Blender.
    """

    def __init__(self, *arguments: str) -> None:
        self.clicks = 0
        self._tool = os.environ["LOBEFIT_GUI_BLENDER"]
        self._root = Path(os.environ["LOBEFIT_GUI_FOLDER"])
        # The folder is the root of what Blender sees.
        self.folder, self.inside = self._root / "lobefit", Path("/", "lobefit")
        self.downloads = self.folder / "downloads"
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        shutil.copy(HERE / "driver.py", self.folder)
        driver = self.inside / "driver.py"
        subprocess.run(
            [self._tool, "start", self._root, "--python", driver, *arguments],
            env=os.environ | {"BLENDER_USER_RESOURCES": str(self.inside / "profile")},
            check=True,
            stdout=subprocess.DEVNULL,
        )
        self.process = int((self._root / "run-ids" / "blender").read_text())
        self.ask("result = 1")

    def close(self) -> None:
        """Ends Blender and the display."""
        subprocess.run([self._tool, "stop", self._root], check=True)

    def is_alive(self) -> bool:
        """Whether Blender still runs."""
        try:
            state = Path(f"/proc/{self.process}/stat").read_text().rsplit(")", 1)[1].split()[0]
        except OSError:
            return False
        return state != "Z"

    def log(self) -> str:
        """What Blender has printed."""
        return (self._root / "work" / "blender.log").read_text()

    def tell(self, source: str) -> None:
        """Runs Python in Blender, without waiting for an answer."""
        answer = self.folder / "answer.json"
        answer.unlink(missing_ok=True)
        unfinished = self.folder / "question.unfinished"
        unfinished.write_text(source)
        unfinished.rename(self.folder / "question.py")

    def ask(self, source: str) -> Any:
        """Runs Python in Blender; what it leaves in `result`."""
        self.tell(source)
        answer, end = self.folder / "answer.json", time.monotonic() + PATIENCE
        while not answer.exists():
            if time.monotonic() > end or not self.is_alive():
                raise TimeoutError(f"Blender does not answer:\n{self.log()}")
            time.sleep(0.02)
        told = json.loads(answer.read_text())
        if "error" in told:
            raise RuntimeError(told["error"])
        return told["result"]

    def wait_for(self, expression: str) -> Any:
        """Waits until an expression is true in Blender; its value."""
        end = time.monotonic() + PATIENCE
        while not (value := self.ask(f"result = {expression}")):
            if time.monotonic() > end:
                raise TimeoutError(f"never true: {expression}\n{self.log()}")
            time.sleep(0.1)
        return value

    def area(self, kind: str) -> tuple[int, int, int, int]:
        """Left, top, width and height of the editor of this kind on the display."""
        x, y, width, height = self.ask(
            "areas = bpy.context.window_manager.windows[0].screen.areas\n"
            f"result = next([a.x, a.y, a.width, a.height] for a in areas if a.type == {kind!r})"
        )
        return x, HEIGHT - y - height, width, height

    def drop(self, *names: str) -> list[str]:
        """Drops files of the downloads on the viewport; what the operator returns."""
        files = [{"name": name} for name in names]
        return self.ask(_DROP.format(directory=str(self.inside / "downloads"), files=files))

    def move(self, place: Place) -> None:
        """Moves the mouse there."""
        self._xdotool("mousemove", *(str(round(number)) for number in place))
        self._settle()

    def click(self, place: Place, times: int = 1) -> None:
        """Clicks at a place of the display; a double click counts as one."""
        self.clicks += 1
        self.move(place)
        self._xdotool("click", "--repeat", str(times), "--delay", "80", "1")
        self._settle()

    def drag(self, start: Place, end: Place, picture: str = "") -> None:
        """Drags from one place to another; the picture is taken before the button is let go."""
        self.clicks += 1
        self.move(start)
        self._xdotool("mousedown", "1")
        self._settle()
        for step in range(1, 11):
            place = [a + (b - a) * step / 10 for a, b in zip(start, end, strict=True)]
            self._xdotool("mousemove", *(str(round(number)) for number in place))
            time.sleep(0.08)
        self._settle()
        if picture:
            self.shot(picture)
        self._xdotool("mouseup", "1")
        self._settle()

    def key(self, *names: str) -> None:
        """Presses keys, by the names that X has for them."""
        self._xdotool("key", *names)
        self._settle()

    def write(self, text: str) -> None:
        """Types a text."""
        self._xdotool("type", "--delay", "30", text)

    def shot(self, name: str) -> Path:
        """Takes a picture of the whole display; it goes to build/gui."""
        path = ROOT / "build" / "gui" / f"{name}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        subprocess.run([self._tool, "shot", path], check=True)
        return path

    def _settle(self) -> None:
        """Waits until Blender has seen the last event and drawn what follows from it."""
        time.sleep(0.2)
        for _ in range(2):
            self.ask("result = True")

    def _xdotool(self, *arguments: str) -> None:
        subprocess.run(["xdotool", *arguments], env=os.environ | {"DISPLAY": DISPLAY}, check=True)


class FileBrowser:
    """Blender's own File Browser in the place of the timeline, showing the downloads."""

    def __init__(self, window: Window) -> None:
        self._window = window
        left, top, width, _ = window.area("DOPESHEET_EDITOR")
        # The timeline is low: its upper edge is drawn up first.
        window.drag((left + width // 2, top - 1), (left + width // 2, top - 350))
        time.sleep(1)
        left, top, _, _ = window.area("DOPESHEET_EDITOR")
        window.click((left + 25, top + 14))
        window.shot("the_choice_of_an_editor")
        window.click((left + 683, top + 117))
        time.sleep(1)
        left, top, _, _ = window.area("FILE_BROWSER")
        window.click((left + 650, top + 50), times=2)
        window.key("ctrl+a")
        window.write(str(window.inside / "downloads"))
        window.key("Return")
        time.sleep(2)
        self._names: list[str] = sorted(path.name for path in window.downloads.iterdir())
        self._first = (left + 300, top + 106)

    def place(self, name: str) -> Place:
        """Where the line of a file is on the display."""
        x, y = self._first
        return x, y + 20 * self._names.index(name)
