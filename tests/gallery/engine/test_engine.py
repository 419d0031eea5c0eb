"""`fpmatch.gallery.engine`: the same results in the same order, wherever the work is done."""

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import closing, contextmanager
from itertools import count, islice
from pathlib import Path
from tempfile import TemporaryDirectory

import chunk_work  # spawned workers must find it by this name
import pytest

from fpmatch.errors import EngineError, ImageError
from fpmatch.gallery.engine import cluster, local, task
from fpmatch.gallery.engine.engine import make_engine, processes
from fpmatch.gallery.engine.local import CHUNKS_IN_FLIGHT, Serial
from tests.gallery.conftest import start_cluster
from tests.gallery.engine.conftest import ENVIRONMENT


@pytest.fixture(scope="module")
def scheduler(workers_find_the_work):
    """Return the address of a cluster of two workers on this machine."""
    with start_cluster(threads=2) as started:
        yield started.scheduler_address


@pytest.mark.parametrize("count", [0, 40])
def test_results_come_in_order(engine, count):
    with closing(engine.map(chunk_work.add, 10, iter(range(count)))) as results:
        assert list(results) == list(range(10, 10 + count))


def test_chunks_are_drawn_as_they_are_needed(engine):
    drawn = count()
    with closing(engine.map(chunk_work.add, 0, drawn)) as results:
        assert list(islice(results, 5)) == [0, 1, 2, 3, 4]
    assert next(drawn) <= 5 + 2 * CHUNKS_IN_FLIGHT


def test_a_worker_keeps_its_copy_of_what_is_shared(engine):
    seen = {}
    for worker, before in engine.map(chunk_work.count, [], range(30)):
        seen.setdefault(worker, []).append(before)
    assert all(sorted(order) == list(range(len(order))) for order in seen.values())
    assert 1 <= len(seen) <= 2


def test_an_error_of_the_work_comes_through(engine):
    with pytest.raises(ImageError, match="too small"):
        list(engine.map(chunk_work.fail, ImageError("too small"), range(3)))
    with pytest.raises(TimeoutError, match="late"):
        list(engine.map(chunk_work.fail, TimeoutError("late"), range(3)))


@pytest.fixture(params=["files in memory", "shared memory"])
def tasks(request, monkeypatch):
    """Return the tasks that workers can read now, in each kind of memory."""
    if request.param == "shared memory":
        monkeypatch.delattr(os, "memfd_create", raising=False)
    there = []

    @contextmanager
    def noted(packed):
        with task.task_in_memory(packed) as made:
            there.append(made)
            assert task._is_there(made)
            yield made

    monkeypatch.setattr(local, "task_in_memory", noted)
    return lambda: [one for one in there if task._is_there(one)]


def test_after_a_dead_process_a_held_engine_works_again(tasks, tmp_path):
    with processes(2) as engine:
        with pytest.raises(EngineError, match="a worker process ended before its work was done"):
            list(engine.map(chunk_work.die_once, tmp_path, range(8)))
        assert tasks() == []
        assert list(engine.map(chunk_work.die_once, tmp_path, range(8))) == list(range(8))


def test_results_before_an_error_come_first(engine, request):
    found = []
    with pytest.raises(ValueError, match="3") as raised:
        found.extend(engine.map(chunk_work.fail_at, 3, range(8)))
    assert found == [0, 1, 2]
    if "processes" in request.node.name:
        assert "chunk_work.py" in str(raised.value.__cause__)  # where it was raised


def _is_there(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.slow
def test_workers_end_with_the_process_that_started_them(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from pathlib import Path; import chunk_work\n"
        "from fpmatch.gallery.engine.engine import processes\n"
        "if __name__ == '__main__':\n"
        f"    list(processes(2).map(chunk_work.sleep_long, Path({str(tmp_path)!r}), range(2)))"
    )
    with TemporaryDirectory() as temporary:  # of a short name, as fork servers need it
        environment = {**ENVIRONMENT, "TMPDIR": temporary}
        with subprocess.Popen([sys.executable, script], env=environment) as main:
            while len(workers := [int(p.name) for p in tmp_path.iterdir() if p.name.isdigit()]) < 2:
                assert main.poll() is None
                time.sleep(0.01)
            main.send_signal(signal.SIGKILL)
        while any(_is_there(worker) for worker in workers):
            time.sleep(0.01)
        assert not [path for path in Path(temporary).rglob("*") if path.is_file()]


@pytest.mark.slow
def test_what_a_dead_worker_had_is_done_again(scheduler, tmp_path):
    with make_engine(scheduler=scheduler) as engine:
        done = list(engine.map(chunk_work.die_once, tmp_path, range(30)))
    assert done == list(range(30))
    assert (tmp_path / "died").exists()


@pytest.mark.slow
@pytest.mark.parametrize("who", ["nobody", "somebody else", "nonsense"])
def test_no_scheduler_is_one_line(monkeypatch, who):
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "CONNECT_S", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = who if who == "nonsense" else f"tcp://127.0.0.1:{server.getsockname()[1]}"
        if who == "nobody":
            server.close()
        with pytest.raises(EngineError) as raised, make_engine(scheduler=address):
            pass
    assert str(raised.value).startswith(f"{address}: no Dask scheduler answers: ")
    assert "\n" not in str(raised.value)


@pytest.mark.slow
def test_a_worker_without_fpmatch_is_one_line(other_cluster):
    pytest.importorskip("distributed")
    address, _ = other_cluster("without")
    with (
        pytest.raises(EngineError, match=r"a worker cannot import fpmatch .*") as raised,
        make_engine(scheduler=address) as engine,
    ):
        list(engine.map(chunk_work.add, 1, [2]))
    assert "\n" not in str(raised.value)


def test_without_dask_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(EngineError, match=r"pip install 'fpmatch\[dask\]'"):
        make_engine(scheduler="tcp://127.0.0.1:8786")


def test_workers_and_scheduler_exclude_each_other():
    with pytest.raises(ValueError, match="not both"):
        make_engine(workers=2, scheduler="tcp://127.0.0.1:8786")
    with pytest.raises(ValueError, match="at least 1"):
        make_engine(workers=0)
    assert isinstance(make_engine(workers=1), Serial)
