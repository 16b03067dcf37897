"""What goes wrong around Lobefit, on purpose: ./dev bench faults [FAULT ..] [--kills 100]

Every fault is tried on commands that read and write. What comes of a try is looked at from outside:
"done", or "refused", which is one sentence and exit code 1 or 2. In either case every file that has
a name is whole, what was there before is there, and nothing is left beside. Anything else is told
under the table. Disks that are full and folders that cannot be written to are mounted, which takes
root.
"""

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import lobefit
from lobefit.catalogues import FILE as CATALOGUES
from lobefit.origin import write_samples

PATIENCE = 300  # seconds after which a command hangs
SEED = 20
TABLES = 4  # of a folder that is fitted
SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.95)  # of the room that a command needs
MEMORY = (0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 1024)  # MB more than what is loaded takes
TOO_LONG = "too long"
NAMES = {
    "spaces": "two  words",
    "Unicode": "Ünïcödé 材料 🎨",
    "255 bytes": "é" * 120,
    "quotes": 'it\'s "$(one)" & `two`; *',
    "a dash": "-o",
    "two lines": "one\ntwo",
    "no UTF-8": os.fsdecode(b"caf\xe9"),
    "300 characters": "/".join(["a" * 49] * 6),
    TOO_LONG: "a" * 300,
}

# What became of a try; all else is a defect.
DONE, REFUSED = "done", "refused"
Tries = Iterator[tuple[str, str]]  # of what, and what became of it


@dataclass(frozen=True)
class Inputs:
    """What the commands read."""

    table: Path
    tables: Path
    record: Path
    records: Path
    library: Path
    scene: Path

    @classmethod
    def below(cls, folder: Path, stem: str) -> "Inputs":
        """Where they are in a folder, the table and its record named `stem`."""
        names = (f"{stem}.binary", "tables", f"{stem}.json", "records", "lib.blend", "scene.blend")
        return cls(*(folder / name for name in names))


def commands(inputs: Inputs, out: Path, stem: str = "a") -> dict[str, list[object]]:
    """Commands that write into the folder `out`, by what they are called here."""
    return {
        "fit": ["fit", inputs.table, "-o", out / f"{stem}.json"],
        "fit --jobs": ["fit", inputs.tables, "--jobs", 2, "-o", out / "fitted"],
        "closures": ["closures", inputs.record, "--closures", 3, "-o", out / f"{stem}.json"],
        "preview": ["preview", inputs.record, "--size", 64, "-o", out / f"{stem}.png"],
        "sample": ["sample", out / "samples", "nickel"],
        "material": ["material", inputs.record, "--kind", "live", "-o", out / f"{stem}.blend"],
        "library": ["library", inputs.records, "--closures", 1, "-o", out / f"{stem}.blend"],
        "simplify": ["simplify", inputs.scene, "--frames", 1, "-o", out / f"{stem}.blend"],
        "export": ["export", inputs.library, "-o", out / "exported"],
    }


def start(words: list[object], before: Callable[[], None] | None = None) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "lobefit", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        errors="backslashreplace",
        start_new_session=True,
        preexec_fn=before,
    )


def run(words: list[object], out: Path, old: dict[str, bytes] | None = None, **options) -> str:
    """Runs a command to its end and judges what it has left in `out`."""
    process = start(words, **options)
    return judged(process, out, old or {})


def judged(process: subprocess.Popen, out: Path, old: dict[str, bytes]) -> str:
    """What became of a command; `old` are the files that were in `out` before."""
    told = process.communicate(timeout=PATIENCE)[1].splitlines()
    told = [line for line in told if "kept from before" not in line]
    if problem := problem_in(out, old):
        return problem
    if process.returncode == 0 and not told:
        return DONE
    last = told[-1][:200] if told else "nothing"
    sentences = "Traceback" not in last and all(
        line.startswith("lobefit: ") and line.endswith((".", "?")) for line in told
    )
    if process.returncode in (1, 2) and told and sentences and len(set(told)) == len(told):
        return REFUSED
    return f"exit code {process.returncode}, saying {last}"


def problem_in(out: Path, old: dict[str, bytes]) -> str:
    """What is wrong with the files of a folder; empty if all are whole and none is lost."""
    found = files_below(out)
    for name, path in found.items():
        if path.name.startswith("."):
            return f"left {path.name}"
        same = old.get(name) == path.read_bytes()
        if not same and (problem := damage_of(path)):
            return f"damaged {path.name}: {problem}"
    lost = sorted(set(old) - set(found))
    return f"lost {lost[0]}" if lost else ""


def files_below(folder: Path) -> dict[str, Path]:
    """The files in and below a folder, hidden ones too, by their path from it."""
    found = [Path(place) / name for place, _, names in os.walk(folder) for name in names]
    return {str(path.relative_to(folder)): path for path in found}


def damage_of(path: Path) -> str:
    """What is wrong with a file that has its name; empty for one that is whole."""
    data, whole = path.read_bytes(), True
    match path.suffix:
        case ".json" | ".binary":
            try:
                (lobefit.Record.load if path.suffix == ".json" else lobefit.read)(path)
            except lobefit.InputError as problem:
                return str(problem)
        case ".blend":
            whole = bool(materials_in(path))
        case ".png":
            whole = data.endswith(b"IEND\xaeB`\x82")
        case ".glb":
            whole = int.from_bytes(data[8:12], "little") == len(data)
        case ".usdc":
            table = int.from_bytes(data[16:24], "little")
            whole = data[:8] == b"PXR-USDC" and 0 < table < len(data)
        case _:
            whole = data.endswith(b"\n")
    return "" if whole else "its end is missing"


def materials_in(path: Path) -> list[str]:
    """The names of the materials of a Blender file, empty where it is none."""
    import bpy

    try:
        with bpy.data.libraries.load(str(path)) as (source, _):
            return list(source.materials)
    except OSError:
        return []


# Each of the faults tells of every try.


def killed_fits(inputs: Inputs, folder: Path, kills: int) -> Tries:
    """kill -9 at a random moment of fitting a folder"""
    command = ["fit", inputs.tables, "--jobs", 2, "-o"]
    yield from killed(command, folder / "fitted", kills)


def killed_libraries(inputs: Inputs, folder: Path, kills: int) -> Tries:
    """kill -9 at a random moment of making a library"""
    (folder / "made").mkdir()
    command = ["library", inputs.tables, "--kind", "principled", "--jobs", 2, "-o"]
    yield from killed(command, folder / "made" / "a.blend", kills)


def killed(command: list[object], place: Path, kills: int) -> Tries:
    """Kills a command again and again until it ends, and starts anew, until it has been killed so
    often; each end is compared with what comes of the command when it is left alone.
    """
    chance, out = random.Random(SEED), place if not place.suffix else place.parent
    began = time.monotonic()
    run([*command, place], out)
    seconds, expected = time.monotonic() - began, contents(out)
    shutil.rmtree(out)
    while kills:
        out.mkdir(exist_ok=True)
        old = {name: path.read_bytes() for name, path in visible(out).items()}
        process = start([*command, place])
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(chance.uniform(0, seconds))
        if process.returncode is None:
            kills -= 1
            process.kill()
            process.communicate()
            await_end(process.pid)
            yield "killed", killed_problem(out, old) or DONE
        elif process.returncode == 0:
            yield "resumed", DONE if contents(out) == expected else "another result"
            age_and_write(command, place)
            yield "left behind", problem_in(out, {}) or DONE
            shutil.rmtree(out)
        else:
            yield "resumed", f"exit code {process.returncode}"


def killed_problem(out: Path, old: dict[str, bytes]) -> str:
    """What is wrong after a kill, which leaves a hidden file where it meets a command writing."""
    for name, path in visible(out).items():
        if name not in old and (problem := damage_of(path)):
            return f"damaged {name}: {problem}"
        if name in old and name.endswith(".json") and path.read_bytes() != old[name]:
            return f"computed {name} again"
    lost = sorted(set(old) - set(visible(out)))
    return f"lost {lost[0]}" if lost else ""


def visible(out: Path) -> dict[str, Path]:
    return {name: p for name, p in files_below(out).items() if not p.name.startswith(".")}


def contents(out: Path) -> dict[str, object]:
    """What files hold that does not depend on how long it took."""

    def timeless(value):
        if isinstance(value, dict):
            return {key: timeless(item) for key, item in value.items() if key != "seconds"}
        return [timeless(item) for item in value] if isinstance(value, list) else value

    found: dict[str, object] = {}
    for name, path in visible(out).items():
        if path.suffix == ".json":
            found[name] = timeless(json.loads(path.read_text()))
        elif path.suffix == ".blend":
            found[name] = materials_in(path)
        else:
            found[name] = path.read_bytes()
    return found


def age_and_write(command: list[object], place: Path) -> None:
    """Writes everything once more, two hours later for what was left beside."""
    before = time.time() - 7200
    out = place.parent if place.suffix else place
    for path in files_below(out).values():
        os.utime(path, (before, before))
    run([*command, place, "--again"], out)


def await_end(session: int) -> None:
    """Waits until no process of a session is left."""
    end = time.monotonic() + PATIENCE
    while any(map(lambda place: belongs(place, session), Path("/proc").glob("[0-9]*"))):
        assert time.monotonic() < end, "a process was left"
        time.sleep(0.02)


def belongs(place: Path, session: int) -> bool:
    try:
        state, _, _, owner = (place / "stat").read_text().rpartition(")")[2].split()[:4]
    except OSError:
        return False
    return int(owner) == session and state != "Z"


def full_disk(inputs: Inputs, folder: Path, _: int) -> Tries:
    """a disk that is full before the end"""
    for name in commands(inputs, folder):
        with disk(folder / "disk", 1 << 28) as out:
            verdict = run(commands(inputs, out)[name], out)
            yield name, verdict
            needed = 512 * sum(path.stat().st_blocks for path in files_below(out).values())
        for share in SHARES:
            with disk(folder / "disk", max(4096, int(share * needed))) as out:
                yield name, run(commands(inputs, out)[name], out)


@contextlib.contextmanager
def disk(place: Path, size: int) -> Iterator[Path]:
    """An empty file system of that many bytes."""
    place.mkdir(exist_ok=True)
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)]
    subprocess.run(mount, check=True)
    try:
        yield place
    finally:
        subprocess.run(["umount", str(place)], check=True)


def read_only(inputs: Inputs, folder: Path, _: int) -> Tries:
    """a folder that cannot be written to"""
    for name in commands(inputs, folder):
        with disk(folder / "disk", 1 << 20) as out:
            old = {"a.json": b"old", "a.png": b"old", "a.blend": b"old"}
            for path, data in old.items():
                (out / path).write_bytes(data)
            subprocess.run(["mount", "-o", "remount,ro", str(out)], check=True)
            verdict = run(commands(inputs, out)[name], out, old)
            yield name, "was done" if verdict == DONE else verdict


def little_memory(inputs: Inputs, folder: Path, _: int) -> Tries:
    """little memory (ulimit -v)"""
    program = """
import resource, sys
from pathlib import Path
from lobefit.command_line import main
if sys.argv[2] in ("material", "library", "simplify", "export"):
    import bpy
taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (taken + int(sys.argv[1]) * 1000000,) * 2)
sys.exit(main(sys.argv[2:]))
"""
    for name in commands(inputs, folder):
        for megabytes in MEMORY:
            out = folder / f"{name} {megabytes}"
            out.mkdir()
            words = map(str, [megabytes, *commands(inputs, out)[name]])
            process = subprocess.Popen(
                [sys.executable, "-P", "-c", program, *words],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
            )
            yield f"{name}, {megabytes} MB", judged(process, out, {})


def changing_files(inputs: Inputs, folder: Path, _: int) -> Tries:
    """a file that vanishes, is cut, changes or is replaced while it is fitted"""
    tables = [path.read_bytes() for path in (inputs.table, inputs.tables / "1.binary")]
    tables.append(tables[0][: len(tables[0]) // 2] + tables[1][len(tables[0]) // 2 :])
    path, place = folder / "table.binary", folder / "out" / "a.json"
    place.parent.mkdir()
    command = ["closures", path, "--closures", 1, "-o", place]
    truths = []
    for table in tables:
        path.write_bytes(table)
        began = time.monotonic()
        run(command, place.parent)
        seconds = time.monotonic() - began
        truths.append(contents(place.parent))

    def replace() -> None:
        (folder / "new").write_bytes(tables[1])
        os.replace(folder / "new", path)

    def change() -> None:
        with path.open("r+b") as file:
            file.seek(len(tables[2]) // 2)
            file.write(tables[2][len(tables[2]) // 2 :])

    meddlers = {
        "vanishes": path.unlink,
        "is cut": lambda: os.truncate(path, len(tables[0]) // 3),
        "changes": change,
        "replaced": replace,
    }
    chance = random.Random(SEED)
    for name, meddle in meddlers.items():
        for _ in range(10):
            place.unlink(missing_ok=True)
            path.write_bytes(tables[0])
            process = start(command)
            time.sleep(chance.uniform(0, seconds))
            meddle()
            verdict = judged(process, place.parent, {})
            fine = verdict != DONE or contents(place.parent) in truths
            yield name, verdict if fine else "a record of a file that never was"


def two_at_once(inputs: Inputs, folder: Path, _: int) -> Tries:
    """two processes that write the same, or into one folder"""
    for name in commands(inputs, folder):
        for index in range(5):
            out = folder / f"{name} {index}"
            out.mkdir()
            pair = [start(commands(inputs, out)[name]) for _ in range(2)]
            told = [process.communicate(timeout=PATIENCE)[1] for process in pair]
            codes = {process.returncode for process in pair}
            both = DONE if codes == {0} else f"exit codes {codes}, saying {''.join(told)[-200:]}"
            yield name, problem_in(out, {}) or both
    for index in range(10):
        out = folder / f"libraries {index}"
        pair = []
        for letter in "ab":
            kind = folder / f"kinds {index}" / letter
            (kind / letter).mkdir(parents=True)
            shutil.copy(inputs.record, kind / letter)
            out.mkdir(exist_ok=True)
            pair.append(start(["library", kind, "--closures", 1, "-o", out / f"{letter}.blend"]))
        codes = {process.wait(PATIENCE) for process in pair}
        listed = {line.split(":")[1] for line in (out / CATALOGUES).read_text().splitlines()[6:]}
        problem = problem_in(out, {}) or ("" if codes == {0} else f"exit codes {codes}")
        lost = "" if listed == {"a", "b"} else f"catalogues {sorted(listed)} of a and b"
        yield "two libraries", problem or lost or DONE


def odd_names(inputs: Inputs, folder: Path, _: int) -> Tries:
    """names with blanks, Unicode, quotes, of 255 bytes, and paths of 300 characters"""
    for what, odd in NAMES.items():
        place, stem = folder / odd, "a" if "/" in odd else odd
        if what != TOO_LONG:
            shutil.copytree(inputs.table.parent, place / "in")
            os.rename(place / "in" / inputs.table.name, place / "in" / f"{stem}.binary")
            os.rename(place / "in" / inputs.record.name, place / "in" / f"{stem}.json")
        moved = Inputs.below(place / "in", stem)
        for name in commands(moved, folder):
            out = folder / f"{what} {name}" if what == TOO_LONG else place / name
            out.mkdir()
            verdict = run(commands(moved, out, stem)[name], out)
            # A folder of samples is named by none of these.
            expected = REFUSED if what == TOO_LONG and name != "sample" else DONE
            wrong = verdict in (DONE, REFUSED) and verdict != expected
            yield f"{name}, {what}", f"wrongly {verdict}" if wrong else verdict


def closed_blender(inputs: Inputs, folder: Path, _: int) -> Tries:
    """Blender closed, ended or killed during a fit or the making of a library"""
    program = """
import sys, time
import bpy, lobefit, lobefit_addon
from lobefit_addon import child
place, table, tables, way = sys.argv[1:]
work = [lobefit.start_fit(table) for _ in range(4)]
work.append(child.Child(["library", tables, "-o", place, "--json", "--kind", "principled"]))
print("started", flush=True)
time.sleep(float(way.partition(" ")[2] or 0))
if way.startswith("quit"):
    lobefit_addon.register()
    lobefit_addon.unregister()
    bpy.ops.wm.quit_blender()
elif way.startswith("exit"):
    sys.exit()
time.sleep(60)
"""
    chance = random.Random(SEED)
    for way in ("quit", "exit", "SIGTERM", "SIGINT", "SIGKILL"):
        for index in range(5):
            out = folder / f"{way} {index}"
            out.mkdir()
            seconds = chance.uniform(0, 1.5)
            words = [out / "a.blend", inputs.table, inputs.tables, f"{way} {seconds}"]
            process = subprocess.Popen(
                [sys.executable, "-P", "-c", program, *map(str, words)],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                start_new_session=True,
            )
            process.stdout.readline()
            if way.startswith("SIG"):
                time.sleep(seconds)
                os.kill(process.pid, signal.Signals[way])
            process.communicate(timeout=PATIENCE)
            await_end(process.pid)
            signals = {-signal.Signals[way]} if way.startswith("SIG") else {0}
            code = process.returncode
            # The module bpy lets Python end as it likes on SIGINT.
            ended = "" if code in {*signals, 0, 1} else f"exit code {code}"
            yield way, ended or killed_problem(out, {}) or DONE


FAULTS = {
    "kill-fit": killed_fits,
    "kill-library": killed_libraries,
    "disk": full_disk,
    "read-only": read_only,
    "memory": little_memory,
    "changes": changing_files,
    "two": two_at_once,
    "names": odd_names,
    "closed": closed_blender,
}


def made_inputs(folder: Path) -> Inputs:
    """The inputs, made from published figures."""
    inputs = Inputs.below(folder, "table")
    for place in (inputs.tables, inputs.records):
        place.mkdir(parents=True)
    (table,) = write_samples(folder / "samples", ["nickel"])
    names = lobefit._native.sample_names()
    for index in range(TABLES):
        (other,) = write_samples(folder / "samples", [names[index % len(names)]])
        shutil.copy(other, inputs.tables / f"{index}.binary")
    shutil.copy(table, inputs.table)
    shutil.rmtree(folder / "samples")
    record = lobefit.closures(inputs.table, count=1, norm="cosine-l1")
    record.save(inputs.record)
    for name in ("a", "b"):
        record.save(inputs.records / f"{name}.json")
    for words in (
        ["library", inputs.records, "--closures", 1, "-o", inputs.library],
        ["material", inputs.record, "--closures", 1, "-o", inputs.scene],
    ):
        assert start(words).wait() == 0
    return inputs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("faults", nargs="*", choices=[[], *FAULTS], metavar="FAULT", default=[])
    parser.add_argument("--kills", type=int, default=100)
    options = parser.parse_args()
    defects = []
    print("| fault | tries | outcome |")
    print("|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        inputs = made_inputs(Path(folder) / "in")
        for key in options.faults or FAULTS:
            if key in ("disk", "read-only") and os.geteuid() != 0:
                continue
            place = Path(folder) / key
            place.mkdir()
            counts: Counter[str] = Counter()
            for what, verdict in FAULTS[key](inputs, place, options.kills):
                fine = verdict in (DONE, REFUSED)
                counts[verdict if fine else "defects"] += 1
                if not fine:
                    defects.append(f"{key}, {what}: {verdict}")
            told = ", ".join(f"{number} {verdict}" for verdict, number in counts.items())
            print(f"| {FAULTS[key].__doc__} | {counts.total()} | {told} |", flush=True)
            shutil.rmtree(place)
    print("\n".join(defects))
    sys.exit(bool(defects))


if __name__ == "__main__":
    main()
