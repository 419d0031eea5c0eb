"""Ctrl-C at any moment: the exit status of an interrupt, no traceback, no process left behind.

`python -m research check interrupts` tries many more moments and commands.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fpmatch.base.threads import interrupt_deferred, interrupt_kept_from_children

ROOT = Path(__file__).parents[2]
PRINTS = str(ROOT / "sample_data")
BEFORE_ANY_PROGRAM = "Fatal Python error: init_import_site"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals"),
]


def interrupted(words: list[str], after_s: float, folder: Path) -> tuple[int, str, str]:
    """Return status and output of a command, whose process group is interrupted."""
    program = (  # Ctrl-C is ignored in background jobs, as suites may be
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from fpmatch.cli import main; main(prog_name='fpmatch')"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    time.sleep(after_s)
    os.killpg(process.pid, signal.SIGINT)
    # returns once nobody holds the pipes any more: neither the command nor a worker
    output, errors = process.communicate(timeout=60)
    return process.returncode, output, errors


@pytest.mark.parametrize("after_s", [0.15, 0.3, 0.5, 0.7, 0.9, 1.2])
@pytest.mark.parametrize(
    "words",
    [
        ["score", "--references", PRINTS, "--probes", PRINTS, "-o", "s.csv", "--workers", "2"],
        ["enrol", "new.db", PRINTS, "--workers", "2"],
    ],
    ids=lambda words: words[0],
)
def test_a_command_ends_at_once_and_says_no_more_than_how_to_resume(
    words: list[str], after_s: float, tmp_path: Path, kernels_line: str
) -> None:
    status, output, errors = interrupted(words, after_s, tmp_path)
    if errors.startswith(BEFORE_ANY_PROGRAM):
        return
    if status == 0:  # it was done before
        assert output
    else:
        assert status in {130, -signal.SIGINT}
        how = "fpmatch: note: the same command resumes the run\n"
        assert errors.removeprefix(kernels_line) in {"", how}


def run(program: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", program]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_an_interrupt_in_a_destructor_is_not_lost() -> None:
    done = run(
        "import signal, time\n"
        "from fpmatch.cli.interrupt import repeat_swallowed_interrupts\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "repeat_swallowed_interrupts()\n"
        "class Destroyed:\n"
        "    def __del__(self):\n"
        "        signal.raise_signal(signal.SIGINT)\n"
        "Destroyed()\n"
        "try:\n"
        "    time.sleep(30)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted')\n"
    )
    assert (done.stdout, done.stderr) == ("interrupted\n", "")


SWALLOWED = """
import signal, sys, time
from fpmatch.cli.interrupt import repeat_swallowed_interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)
repeat_swallowed_interrupts()
try:
    signal.raise_signal(signal.SIGINT)
except:
    pass
try:
    time.sleep(30)
except KeyboardInterrupt:
    print("interrupted")
"""
CLEANED = """
import signal, time
from contextlib import closing
from fpmatch.cli.interrupt import repeat_swallowed_interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)
repeat_swallowed_interrupts()
def work():
    try:
        yield
    finally:
        try:
            int("x")
        except ValueError:
            time.sleep(0.3)
        time.sleep(0.3)
        print("cleaned")
try:
    with closing(work()) as stream:
        next(stream)
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            time.sleep(0.3)
            print("kept")
except KeyboardInterrupt:
    time.sleep(0.3)
    print("interrupted")
"""


@pytest.mark.parametrize(
    ("program", "output"), [(SWALLOWED, "interrupted\n"), (CLEANED, "kept\ncleaned\ninterrupted\n")]
)
def test_an_interrupt_is_repeated_where_it_is_ignored_and_not_where_work_is_ended(
    program: str, output: str
) -> None:
    done = run(program)
    assert (done.stdout, done.stderr) == (output, "")


def test_other_errors_in_a_destructor_are_printed_as_usual() -> None:
    done = run(
        "from fpmatch.cli.interrupt import repeat_swallowed_interrupts\n"
        "repeat_swallowed_interrupts()\n"
        "class Destroyed:\n"
        "    def __del__(self):\n"
        "        raise ValueError('odd')\n"
        "Destroyed()\n"
    )
    assert "ValueError: odd" in done.stderr


DEFERRED = """
import os, signal
from fpmatch.base.threads import interrupt_deferred
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    with interrupt_deferred():
        os.kill(os.getpid(), signal.SIGINT)
        print("work")
        raise EOFError
except KeyboardInterrupt:
    print("interrupted")
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
"""
RECEIVED = """
import os, signal, time
from fpmatch.base.threads import interrupt_kept_from_children
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    with interrupt_kept_from_children():
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(300):
            time.sleep(0.1)
except KeyboardInterrupt:
    print("interrupted")
"""


# in processes of their own: another thread of this one may receive a signal, at any later time
@pytest.mark.parametrize(
    ("program", "output"), [(DEFERRED, "work\ninterrupted\n"), (RECEIVED, "interrupted\n")]
)
def test_an_interrupt_comes_at_the_end_of_a_start_and_reaches_a_server(
    program: str, output: str
) -> None:
    done = run(program)
    assert (done.stdout, done.stderr) == (output, "")


SLEEPS = [sys.executable, "-c", "import time; print('there', flush=True); time.sleep(0.5)"]


@pytest.mark.parametrize("keeping", [interrupt_deferred, interrupt_kept_from_children])
def test_processes_that_start_meanwhile_receive_no_interrupt(keeping) -> None:  # type: ignore[no-untyped-def]
    with keeping():
        child = subprocess.Popen(SLEEPS, stdout=subprocess.PIPE, start_new_session=True)
    with child:
        assert child.stdout is not None
        child.stdout.readline()
        os.killpg(child.pid, signal.SIGINT)
        assert child.wait(30) == 0
