"""How long a window stands still while files are imported: stalls.py FILE..

For each file, dropped on the viewport by its operator: the seconds until there is a material, and
the longest gap between two rounds of Blender's main loop, which draws in between, by the clock and
by the main thread's processor time. The first line is the same of a window where nothing is done
but the mouse moved. Needs what the tests beside it need.
"""

import shutil
import sys
import time
from pathlib import Path

from conftest import start_installed
from window import Window, missing

WATCH = """
import time
watched = bpy.app.driver_namespace.setdefault('watched', {})
watched.update(clock=0.0, own=0.0, last=(time.perf_counter(), time.thread_time()), on=True)

def look():
    now = time.perf_counter(), time.thread_time()
    watched['clock'] = max(watched['clock'], now[0] - watched['last'][0])
    watched['own'] = max(watched['own'], now[1] - watched['last'][1])
    watched['last'] = now
    return 0.002 if watched['on'] else None

bpy.app.timers.register(look)
"""
WATCHED = """
watched = bpy.app.driver_namespace['watched']
watched['on'] = False
result = watched['clock'], watched['own']
"""
IDLE = "__import__('sys').modules['bl_ext.user_default.lobefit.operators.run'].current() is None"


def tell(name: str, window: Window, seconds: float) -> None:
    clock, own = window.ask(WATCHED)
    print(f"| {name} | {seconds:.2f} | {clock * 1e3:.0f} | {own * 1e3:.0f} |", flush=True)


def main(paths: list[Path]) -> None:
    reason = missing()
    if reason:
        raise SystemExit(reason)
    window = start_installed()
    try:
        print("| file | s | longest gap ms | processor ms |")
        print("|---" * 4 + "|")
        window.ask(WATCH)
        start = time.monotonic()
        for step in range(20):
            window.move((400 + 20 * step, 400))
        tell("no import", window, time.monotonic() - start)
        for path in paths:
            shutil.copy(path, window.downloads)
            window.ask(WATCH)
            start = time.monotonic()
            window.drop(path.name)
            window.wait_for(IDLE)
            tell(path.stem, window, time.monotonic() - start)
    finally:
        window.close()


if __name__ == "__main__":
    main([Path(argument) for argument in sys.argv[1:]])
