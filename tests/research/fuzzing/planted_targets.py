"""Readers with a bug each, for the fuzzer to find."""

import os
import signal
import time

from fpmatch.errors import TemplateError
from research.fuzzing.target import Reader, Target

GOOD = b"good file"
MEGABYTES = 1500


def planted():
    """Return a target for each kind of bug, and one that has none."""
    readers = (sound, raises, dies, hangs, wordy, escapes, large)
    return {
        read.__name__: (Target(read.__name__, lambda: None), Reader([GOOD], read))
        for read in readers
    }


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
        os.kill(os.getpid(), signal.SIGSEGV)


def hangs(data):
    """Take forever."""
    if data != GOOD:
        time.sleep(1000)


def wordy(data):
    """Refuse in two lines."""
    if data != GOOD:
        error = TemplateError("one line")
        error.args = ("one line\nand another",)
        raise error


def escapes(data):
    """Return a name that acts on a terminal."""
    return ["\x1b[31m"] if data != GOOD else []


def large(data):
    """Use much memory."""
    if data != GOOD:
        bytearray(MEGABYTES * 10**6)[:: 1 << 12] = b"x" * -(-MEGABYTES * 10**6 // (1 << 12))
