"""Readers with a bug each, for the fuzzer to find."""

import os
import signal
import time
from types import SimpleNamespace

from fpmatch.errors import TemplateError

GOOD = b"good file"


def planted():
    """Return a target for each kind of bug, and one that has none."""
    readers = {"sound": sound, "raises": raises, "dies": dies, "hangs": hangs, "wordy": wordy}
    return [SimpleNamespace(name=name, corpus=[GOOD], read=read) for name, read in readers.items()]


def sound(data):
    """Refuse all that is not the good file."""
    if data != GOOD:
        raise TemplateError("another file")


def raises(data):
    """Divide by zero."""
    if data != GOOD:
        raise ZeroDivisionError("on purpose")


def dies(data):
    """End the process as a fault in a C library does."""
    if data != GOOD:
        os.kill(os.getpid(), signal.SIGKILL)


def hangs(data):
    """Take forever."""
    if data != GOOD:
        time.sleep(1000)


def wordy(data):
    """Refuse in two lines."""
    if data != GOOD:
        raise TemplateError("one line\nand another")
