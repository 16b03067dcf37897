"""Batches of files: in one process, in several, and on a Dask cluster; whatever ends on the way."""

import json
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest
from commands import PATIENCE, await_that, finished, refuse, start
from lobefit import InputError, batch, blender
from lobefit.batch import Batch, Task, tasks_in
from lobefit.command_line import main
from lobefit.origin import origin_of, write_samples

# All that a record may hold, and no more work than that takes.
EVERYTHING = ["closures", "--closures", "1", "--uncertainty"]
MANY = 8
NAMES = {f"{index}.json" for index in range(MANY)}


def processes_of(session: int) -> dict[int, str]:
    """The command lines of the processes of a session that still run, by process id."""
    found = {}
    for place in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, owner = (place / "stat").read_text().rpartition(")")[2].split()[:4]
            command = (place / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(owner) == session and state != "Z":
            found[int(place.name)] = command
    return found


def workers_of(session: int) -> list[int]:
    return [pid for pid, command in processes_of(session).items() if "spawn_main" in command]


def results(folder: Path) -> dict[str, object]:
    """All that the records of a folder hold but for their seconds."""

    def timeless(value):
        if isinstance(value, dict):
            return {key: timeless(item) for key, item in value.items() if key != "seconds"}
        return [timeless(item) for item in value] if isinstance(value, list) else value

    return {path.name: timeless(json.loads(path.read_text())) for path in folder.iterdir()}


@pytest.fixture(scope="module")
def different(tmp_path_factory, table) -> Path:
    """A folder of three different tables."""
    folder = tmp_path_factory.mktemp("different")
    write_samples(folder, ["nickel", "violet-rubber"])
    (folder / "truth.binary").symlink_to(table)
    return folder


@pytest.fixture
def many(tmp_path, table) -> Path:
    """A folder of tables, of which some are left when the first has its record."""
    folder = tmp_path / "many"
    folder.mkdir()
    for index in range(MANY):
        (folder / f"{index}.binary").symlink_to(table)
    return folder


@pytest.fixture(scope="module")
def alone(tmp_path_factory, different) -> Path:
    """The records of `different` as one process makes them."""
    folder = tmp_path_factory.mktemp("alone")
    assert main([*EVERYTHING, str(different), "-o", str(folder)]) == 0
    return folder


def test_several_jobs_find_what_one_finds(tmp_path, different, alone, capfd):
    out = tmp_path / "out"
    assert main([*EVERYTHING, str(different), "--jobs", "2", "--json", "-o", str(out)]) == 0
    told = capfd.readouterr()
    places = [json.loads(line)["record"] for line in told.out.splitlines()]
    assert sorted(places) == sorted(str(path) for path in out.iterdir())
    assert told.err == ""
    assert results(out) == results(alone)


def test_a_killed_worker_costs_its_file_alone(tmp_path, many):
    out = tmp_path / "out"
    process = start("fit", many, "--jobs", "2", "-o", out)
    await_that(lambda: finished(out), process)
    os.kill(workers_of(process.pid)[0], signal.SIGKILL)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 1
    assert err.count("\n") == 1 and "SIGKILL" in err
    (lost,) = NAMES - set(finished(out))
    assert f"{many / lost}".replace(".json", ".binary: ") in err
    assert len(os.listdir(out)) == MANY - 1
    # The same command does what is missing, and nothing else.
    before = finished(out)
    again = start("fit", many, "--jobs", "2", "-o", out)
    assert f"{MANY - 1} of {MANY} kept" in again.communicate(timeout=PATIENCE)[1]
    after = finished(out)
    assert again.returncode == 0
    assert after.pop(lost)
    assert after == before


@pytest.mark.parametrize(("end", "code"), [(signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_the_end_of_a_batch_is_the_end_of_its_workers(tmp_path, many, end, code):
    out = tmp_path / "out"
    process = start("fit", many, "--jobs", "2", "-o", out)
    await_that(lambda: finished(out), process)
    if end == signal.SIGINT:
        os.killpg(process.pid, end)  # as a terminal does
    else:
        process.kill()
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == code
    assert err == ("lobefit: interrupted\n" if end == signal.SIGINT else "")
    await_that(lambda: not processes_of(process.pid))
    assert set(finished(out)) < NAMES
    # What is killed while it writes cannot remove the file beside the record.
    assert end == signal.SIGKILL or set(finished(out)) == set(os.listdir(out))


def test_a_bad_file_is_told_and_the_others_done(tmp_path, table, capfd):
    files = [tmp_path / f"{name}.binary" for name in ("bad", "good", "fine")]
    files[0].write_bytes(b"")
    for path in files[1:]:
        path.symlink_to(table)
    out = tmp_path / "out"
    assert main(["fit", *map(str, files), "--jobs", "2", "-o", str(out)]) == 1
    assert capfd.readouterr().err.startswith(f"lobefit: {files[0]}: ")
    assert set(finished(out)) == set(os.listdir(out)) == {"good.json", "fine.json"}


def test_wrong_use(tmp_path, table, capfd, monkeypatch):
    command = ["fit", table, "-o", tmp_path / "truth.json"]
    assert "a number from 1" in refuse(capfd, *command, "--jobs", "0")
    both = ["--jobs", "2", "--scheduler", "tcp://127.0.0.1:1"]
    assert "not allowed with" in refuse(capfd, *command, *both)
    monkeypatch.setitem(sys.modules, "distributed", None)
    err = refuse(capfd, *command, "--scheduler", "tcp://127.0.0.1:1")
    assert "pip install 'lobefit[cluster]'" in err
    monkeypatch.setattr(blender, "is_this_program", lambda: True)
    assert "found Blender" in refuse(capfd, *command, "--scheduler", "tcp://127.0.0.1:1")
    monkeypatch.setattr(sys, "executable", "/usr/bin/blender")
    assert "/usr/bin/blender; use one job" in refuse(capfd, *command, "--jobs", "2")
    assert os.listdir(tmp_path) == []


def test_two_files_of_one_name():
    folder, options = Path("out"), {"threads": 0}
    with pytest.raises(InputError, match=r"out/a.json: .* found x/a.binary and y/a.binary"):
        tasks_in(folder, [Path("x/a.binary"), Path("y/a.binary")], [], options)
    # A record that is about to be replaced is there on the second run of the same command.
    sources = [Path("out/a.binary"), Path("out/a.json"), Path("out/b.json")]
    tasks = tasks_in(folder, sources, [], options)
    assert [task.source for task in tasks] == [sources[0], sources[2]]


def test_a_share_of_the_processors():
    task = Task(Path("a.binary"), Path("a.json"), [], {"threads": 0, "norm": "l1"})
    assert task.with_threads(3).options == {"threads": 3, "norm": "l1"}
    assert task.with_threads(3).with_threads(5).options["threads"] == 3


def test_the_bar_tells_how_far_all_files_are(tmp_path):
    tasks = [Task(tmp_path / f"{n}.binary", tmp_path / f"{n}.json", [], {}) for n in range(4)]
    titles, drawn = [], []

    @contextmanager
    def bar(title: str) -> Iterator[Callable[[float, str], None]]:
        titles.append(title)
        yield lambda share, text: drawn.append((share, text))

    def two_at_once(tasks, watch):
        for one, other in (tasks[:2], tasks[2:]):
            watch(one, 0.5, "polish")
            watch(other, 0.5, "polish")
            yield one, InputError("one")
            yield other, InputError("other")

    ended = list(Batch(tasks, two_at_once, keep=False, bar=bar).run())
    assert [task for task, _ in ended] == tasks
    assert [title.partition(",")[0] for title in titles] == [f"{n} of 4 done" for n in range(5)]
    assert titles[0] == "0 of 4 done" and titles[1].endswith(" s left")
    assert (0.125, "0.binary: polish") in drawn and (0.25, "1.binary: polish") in drawn
    shares = [share for share, _ in drawn]
    assert shares == sorted(shares) and shares[-1] == 1.0


def test_a_folder_that_is_taken_away_meanwhile_is_made_again(tmp_path, record):
    place = tmp_path / "records" / "gold.json"
    place.parent.mkdir()

    def taken_away(tasks, watch):
        place.parent.rmdir()
        yield tasks[0], record

    tasks = [Task(tmp_path / "gold.binary", place, [], {})]
    batch_of_one = Batch(tasks, taken_away, keep=False, bar=lambda title: nullcontext())
    assert [outcome for _, outcome in batch_of_one.run()] == [record]
    assert place.is_file()


@pytest.fixture(scope="module")
def cluster():
    """A Dask scheduler with two workers, each a process of its own."""
    reason = "distributed is not installed, so nothing is tried on a cluster"
    distributed = pytest.importorskip("distributed", reason=reason)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        yield cluster


def test_a_cluster_finds_what_one_process_finds(tmp_path, different, alone, cluster, capfd):
    address = cluster.scheduler_address
    command = [*EVERYTHING, str(different), "--scheduler", address, "-o", str(tmp_path)]
    assert main(command) == 0
    assert capfd.readouterr().err == ""
    assert results(tmp_path) == results(alone)
    before = finished(tmp_path)
    assert main(command) == 0
    assert "3 of 3 kept" in capfd.readouterr().err
    assert finished(tmp_path) == before


def test_a_cluster_does_again_what_a_killed_worker_had(tmp_path, many, cluster):
    from distributed import Client

    with Client(cluster.scheduler_address, set_as_default=False) as client:
        victim = next(iter(client.run(os.getpid).values()))
    out = tmp_path / "out"
    process = start("fit", many, "--scheduler", cluster.scheduler_address, "--json", "-o", out)
    await_that(lambda: finished(out), process)
    os.kill(victim, signal.SIGKILL)
    done = finished(out)
    told, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err) == (0, "")
    places = [json.loads(line)["record"] for line in told.splitlines()]
    assert sorted(places) == sorted(str(out / name) for name in NAMES)
    after = finished(out)
    assert set(after) == set(os.listdir(out)) == NAMES
    assert {name: after[name] for name in done} == done
    record, *others = [content for _, content in sorted(results(out).items())]
    for other in others:
        assert other["parameters"] == record["parameters"]


def test_ctrl_c_leaves_the_cluster_idle(tmp_path, many, cluster):
    from distributed import Client

    out = tmp_path / "out"
    process = start("fit", many, "--scheduler", cluster.scheduler_address, "-o", out)
    await_that(lambda: finished(out), process)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err) == (130, "lobefit: interrupted\n")
    assert set(finished(out)) == set(os.listdir(out))
    with Client(cluster.scheduler_address, set_as_default=False) as client:
        await_that(lambda: not any(client.processing().values()))


def test_a_cluster_of_another_build_is_refused(tmp_path, table, cluster, capfd, monkeypatch):
    monkeypatch.setattr(batch, "build_id", "0" * 64)
    command = ["fit", table, "-o", tmp_path / "truth.json"]
    err = refuse(capfd, *command, "--scheduler", cluster.scheduler_address)
    assert "expected Lobefit of build 000000000000 at tcp://" in err
    # A worker that joins later finds it out by itself.
    task = Task(table, tmp_path / "truth.json", [], {"threads": 1})
    assert "at a worker, found build 0000" in str(batch._attempt_as("f" * 64, task))


def test_no_scheduler_and_no_workers(tmp_path, table, cluster, capfd, monkeypatch):
    from distributed import LocalCluster

    monkeypatch.setattr(batch, "_PATIENCE", 1)
    command = ["fit", table, "-o", tmp_path / "truth.json", "--scheduler"]
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        assert "none within 1 s" in refuse(capfd, *command, f"tcp://127.0.0.1:{port}")
    assert "none within 1 s" in refuse(capfd, *command, f"tcp://127.0.0.1:{port}")
    assert "an address like" in refuse(capfd, *command, "nowhere")
    with LocalCluster(n_workers=0, processes=True, dashboard_address=":0") as empty:
        err = refuse(capfd, *command, empty.scheduler_address)
    assert "expected workers of the scheduler, found none" in err


def test_workers_that_read_another_file(table, record):
    task = Task(table, Path("truth.json"), [], {})
    future = SimpleNamespace(status="finished", result=lambda: record)
    record.source |= origin_of(table).entries()
    assert batch._outcome(task, future) is record
    record.source["sha256"] = "0123"
    assert "another at the same path" in str(batch._outcome(task, future))
