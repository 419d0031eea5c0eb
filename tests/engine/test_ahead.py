"""`fpmatch.engine.ahead`: workers forked from a program that has just begun."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from fpmatch.engine.ahead import fork_ahead, take_forked

FOLDER = Path(__file__).parent

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="workers are forked on Linux only")


@pytest.fixture
def run(tmp_path):
    """Return what runs a program that has just begun."""

    def run(*lines):
        script = tmp_path / "script.py"
        script.write_text(
            "import os, signal; import chunk_work; from fpmatch.engine.engine import cores\n"
            "from fpmatch.engine.local import get_ready\n"
            "if __name__ == '__main__':\n" + "".join(f"    {line}\n" for line in lines)
        )
        environment = {**os.environ, "PYTHONPATH": str(FOLDER)}
        return subprocess.run(
            [sys.executable, script],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )

    return run


def test_what_workers_need_is_imported_before_they_are_handed_work(run):
    done = run(
        "before = dict(os.environ), signal.getsignal(signal.SIGINT)",
        "get_ready(1, 'no.such.module')",
        "get_ready(2, 'no.such.module', 'colorsys')",
        "assert (dict(os.environ), signal.getsignal(signal.SIGINT)) == before",
        "with cores(2) as engine:",
        "    assert all(engine.map(chunk_work.is_loaded, 'colorsys', range(4)))",
        "    assert all(engine.map(chunk_work.looks_for_garbage, None, range(4)))",
        "assert not any(cores(2).map(chunk_work.is_loaded, 'colorsys', range(4)))",
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_all_processes_end_with_the_work(run):
    done = run(
        "get_ready(2)",
        "workers = set(cores(2).map(chunk_work.process, None, range(8)))",
        "assert len(workers) == 2",
        "assert not any(os.path.exists(f'/proc/{worker}') for worker in workers)",
        "try:",
        "    os.wait()",
        "except ChildProcessError:",
        "    print('no children')",
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "no children\n", "")


def test_workers_that_nobody_needs_end_with_the_program(run):
    done = run("get_ready(2, 'colorsys')")  # and let go of the pipes to this process
    assert (done.returncode, done.stderr) == (0, "")


def test_a_dead_worker_is_said(run, tmp_path):
    done = run(
        "from pathlib import Path",
        "get_ready(2)",
        f"list(cores(2).map(chunk_work.die_once, Path({str(tmp_path)!r}), range(8)))",
    )
    assert done.returncode == 1
    assert "EngineError: a worker process ended before its work was done" in done.stderr


def test_a_process_with_threads_is_not_forked():
    done = threading.Event()
    other = threading.Thread(target=done.wait)
    other.start()
    try:
        fork_ahead(2, [])
        assert take_forked() is None
    finally:
        done.set()
        other.join()
