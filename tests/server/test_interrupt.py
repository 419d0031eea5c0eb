"""Ctrl-C while a server runs: it comes once, and not to the processes that it has started."""

import os
import signal
import subprocess
import sys

import pytest

from fpmatch.server.interrupt import interrupt_kept_from_children

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals"),
]

PROGRAM = """
import os, signal, time
from fpmatch.server.interrupt import interrupt_kept_from_children
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    with interrupt_kept_from_children():
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(300):
            time.sleep(0.1)
except KeyboardInterrupt:
    time.sleep(0.3)
    print("interrupted")
assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
"""
SLEEPS = [sys.executable, "-c", "import time; print('there', flush=True); time.sleep(0.5)"]


def test_an_interrupt_comes_once():
    """In a process of its own: another thread of this one may receive a signal, at any time."""
    command = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.stdout, done.stderr) == ("interrupted\n", "")


def test_processes_that_start_meanwhile_receive_no_interrupt():
    with interrupt_kept_from_children():
        child = subprocess.Popen(SLEEPS, stdout=subprocess.PIPE, start_new_session=True)
    with child:
        assert child.stdout is not None
        child.stdout.readline()
        os.killpg(child.pid, signal.SIGINT)
        assert child.wait(30) == 0
