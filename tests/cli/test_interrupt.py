"""Ctrl-C at any moment: the exit status of an interrupt, no traceback, no process left behind."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from fpmatch.gallery.engine.processes import interrupt_deferred, interrupt_kept_from_children

ROOT = Path(__file__).parents[2]
PRINTS = str(ROOT / "sample_data")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals"),
]


def interrupted(words, after_s, folder):
    """Return status and output of a command, whose process group is interrupted after its start.

    Until it calls `main`, Python itself answers an interrupt.
    """
    program = (  # Ctrl-C is ignored in background jobs, as suites may be
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from fpmatch.cli import main; print('there', flush=True); main(prog_name='fpmatch')"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "there\n"
    time.sleep(after_s)
    os.killpg(process.pid, signal.SIGINT)
    # returns once nobody holds the pipes any more: neither the command nor a worker
    output, errors = process.communicate(timeout=60)
    return process.returncode, output, errors


def run(program):
    command = [sys.executable, "-c", program]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.parametrize("after_s", [0.05, 0.15, 0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize(
    "words",
    [
        ["score", "--references", PRINTS, "--probes", PRINTS, "-o", "s.csv", "--workers", "2"],
        ["enrol", "new.db", PRINTS, "--workers", "2"],
    ],
    ids=lambda words: words[0],
)
def test_a_command_ends_at_once_and_says_no_more_than_how_to_resume(
    words, after_s, tmp_path, kernels_line
):
    status, output, errors = interrupted(words, after_s, tmp_path)
    if status == 0:  # it was done before
        assert output
    else:
        assert status in {130, -signal.SIGINT}
        how = "fpmatch: note: the same command resumes the run\n"
        assert errors.removeprefix(kernels_line) in {"", how}


START = """
import os, signal, time
from fpmatch.cli import ignore_lost_interrupts
from fpmatch.gallery.engine.processes import interrupt_deferred, interrupt_kept_from_children
signal.signal(signal.SIGINT, signal.default_int_handler)
ignore_lost_interrupts()
handler = signal.getsignal(signal.SIGINT)
"""
DESTROYED = """
class Destroyed:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
Destroyed()
raise KeyboardInterrupt
"""
CLEANED = """
from contextlib import closing
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
with closing(work()) as stream:
    next(stream)
    try:
        signal.raise_signal(signal.SIGINT)
    finally:
        time.sleep(0.3)
        print("kept")
"""
DEFERRED = """
with interrupt_deferred():
    os.kill(os.getpid(), signal.SIGINT)
    print("work")
    raise EOFError
"""
RECEIVED = """
with interrupt_kept_from_children():
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(300):
        time.sleep(0.1)
"""
END = """
except KeyboardInterrupt:
    time.sleep(0.3)
    print("interrupted")
assert signal.getsignal(signal.SIGINT) is handler
assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
"""


# in processes of their own: another thread of this one may receive a signal, at any later time
@pytest.mark.parametrize(
    ("program", "output"),
    [
        (DESTROYED, ""),
        (CLEANED, "kept\ncleaned\n"),
        (DEFERRED, "work\n"),
        (RECEIVED, ""),
    ],
    ids=["destroyed", "cleaned", "deferred", "received"],
)
def test_an_interrupt_comes_once_and_where_work_may_end(program, output):
    done = run(f"{START}try:{textwrap.indent(program, '    ')}{END.lstrip()}")
    assert (done.stdout, done.stderr) == (f"{output}interrupted\n", "")


def test_other_errors_in_a_destructor_are_printed_as_usual():
    program = "class Destroyed:\n    def __del__(self):\n        raise ValueError('odd')\n"
    assert "ValueError: odd" in run(f"{START}{program}Destroyed()\n").stderr


SLEEPS = [sys.executable, "-c", "import time; print('there', flush=True); time.sleep(0.5)"]


@pytest.mark.parametrize("keeping", [interrupt_deferred, interrupt_kept_from_children])
def test_processes_that_start_meanwhile_receive_no_interrupt(keeping):
    with keeping():
        child = subprocess.Popen(SLEEPS, stdout=subprocess.PIPE, start_new_session=True)
    with child:
        assert child.stdout is not None
        child.stdout.readline()
        os.killpg(child.pid, signal.SIGINT)
        assert child.wait(30) == 0
