"""Ctrl-C while processes start: it comes once, after the block, and not to the processes."""

import os
import signal
import subprocess
import sys
import textwrap

import pytest

from fpmatch.gallery.engine.processes import interrupt_deferred, interrupt_kept_from_children

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals"),
]

START = """
import os, signal, time
from fpmatch.gallery.engine.processes import interrupt_deferred, interrupt_kept_from_children
signal.signal(signal.SIGINT, signal.default_int_handler)
handler = signal.getsignal(signal.SIGINT)
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
@pytest.mark.parametrize(("program", "output"), [(DEFERRED, "work\n"), (RECEIVED, "")])
def test_an_interrupt_comes_once_and_where_work_may_end(program, output):
    text = f"{START}try:{textwrap.indent(program, '    ')}{END.lstrip()}"
    command = [sys.executable, "-c", text]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.stdout, done.stderr) == (f"{output}interrupted\n", "")


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
