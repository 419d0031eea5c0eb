"""`fpmatch.gallery.engine`: the same results in the same order, wherever the work is done."""

import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import closing
from functools import partial
from itertools import count, islice
from pathlib import Path
from tempfile import TemporaryDirectory

import chunk_work  # spawned workers must find it by this name
import pytest

from fpmatch.errors import EngineError, ImageError
from fpmatch.gallery.engine import executors
from fpmatch.gallery.engine.engine import CHUNKS_IN_FLIGHT, make_engine, serial
from fpmatch.gallery.engine.workers import attempt_each
from tests.gallery.engine.conftest import ENVIRONMENT


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
    done = []
    with pytest.raises(ValueError, match="3"):
        done.extend(engine.map(chunk_work.fail_at, 3, range(8)))
    assert done == [0, 1, 2]


def test_an_item_that_is_refused_stops_nothing_and_other_errors_come_through(engine):
    drawn = count()
    with closing(attempt_each(engine, chunk_work.halve, drawn)) as attempts:
        first = list(islice(attempts, 9))
        assert [item for item, _ in first] == list(range(9))
        assert [attempt.result for _, attempt in first] == [0, None, 1, None, 2, None, 3, None, 4]
        assert [attempt.reason for _, attempt in first[1:4]] == ["1 is odd", "", "3 is odd"]
        with pytest.raises(ValueError, match="10"):
            list(attempts)


def test_after_a_dead_process_a_held_engine_works_again(tmp_path):
    with make_engine(2) as engine:
        with pytest.raises(
            EngineError, match=r"a worker process ended .* \(at .*print 3"
        ) as raised:
            list(engine.map(chunk_work.die_once, tmp_path, range(8), "print {}".format))
        assert "\n" not in str(raised.value)
        assert list(engine.map(chunk_work.die_once, tmp_path, range(8))) == list(range(8))


def _is_there(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


SLEEPS = """
import signal
from pathlib import Path
import chunk_work
from fpmatch.gallery.engine.engine import make_engine
signal.signal(signal.SIGINT, signal.default_int_handler)
with make_engine(2) as engine:
    list(engine.map(chunk_work.sleep_long, Path({folder!r}), range(2)))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
def test_workers_of_a_killed_process_end_and_leave_no_file(tmp_path):
    program = SLEEPS.format(folder=str(tmp_path))
    with TemporaryDirectory() as temporary:
        words = [sys.executable, "-c", program]
        with subprocess.Popen(words, env={**ENVIRONMENT, "TMPDIR": temporary}) as main:
            while len(workers := [int(p.name) for p in tmp_path.iterdir() if p.name.isdigit()]) < 2:
                assert main.poll() is None
                time.sleep(0.01)
            main.send_signal(signal.SIGKILL)
        while any(_is_there(worker) for worker in workers):
            time.sleep(0.01)
        assert not list(Path(temporary).iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("who", ["nobody", "somebody else", "nonsense"])
def test_no_scheduler_is_one_line(monkeypatch, who):
    pytest.importorskip("distributed")
    monkeypatch.setattr(executors, "CONNECT_S", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = who if who == "nonsense" else f"tcp://127.0.0.1:{server.getsockname()[1]}"
        if who == "nobody":
            server.close()
        with pytest.raises(EngineError) as raised, make_engine(scheduler=address):
            pass
    assert str(raised.value).startswith(f"{address}: no Dask scheduler answers: ")
    assert "\n" not in str(raised.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "why"), [(["without"], "a worker cannot import fpmatch"), ([], "connection")]
)
def test_what_a_cluster_lacks_is_one_line(other_cluster, tmp_path, words, why):
    """A worker without fpmatch, and a scheduler that is killed."""
    pytest.importorskip("distributed")
    address, process = other_cluster(*words)

    def work():
        with make_engine(scheduler=address) as engine:
            for done in engine.map(chunk_work.add, 1, count()):
                if done == 5:
                    process.kill()

    with pytest.raises(EngineError, match=why) as raised:
        work()
    assert "\n" not in str(raised.value)


def test_workers_and_scheduler_exclude_each_other_and_dask_is_an_extra(monkeypatch):
    with pytest.raises(ValueError, match="not both"):
        make_engine(workers=2, scheduler="tcp://127.0.0.1:8786")
    with pytest.raises(ValueError, match="at least 1"):
        make_engine(workers=0)
    with make_engine(workers=1) as engine, serial() as other:
        assert {*engine.map(_process, 0, [1]), *other.map(_process, 0, [1])} == {os.getpid()}
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(EngineError, match=r"pip install 'fpmatch\[dask\]'"),
        make_engine(scheduler="tcp://127.0.0.1:8786"),
    ):
        pass


def _process(shared, chunk):
    return os.getpid()


def test_what_cannot_be_sent_is_one_line():
    with pytest.raises(EngineError, match="cannot be sent to other processes"):
        list(make_engine(2).map(chunk_work.add, lambda: 1, [1]))


@pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
def test_an_interrupt_while_processes_start_is_not_lost(monkeypatch):
    """The new processes do not see it, and end."""
    before, start = signal.getsignal(signal.SIGINT), executors.SpawnProcess.start
    interrupt = partial(signal.pthread_kill, threading.main_thread().ident, signal.SIGINT)
    monkeypatch.setattr(executors.SpawnProcess, "start", lambda one: interrupt() or start(one))
    monkeypatch.setitem(os.environ, "PYTHONSAFEPATH", "")
    with pytest.raises(KeyboardInterrupt), make_engine(2):
        pass
    assert signal.getsignal(signal.SIGINT) is before
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
    assert os.environ["PYTHONSAFEPATH"] == ""
    assert not multiprocessing.active_children()
