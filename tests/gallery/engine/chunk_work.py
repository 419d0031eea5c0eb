"""Work to hand to engines; a module, so that workers can import it."""

import os
import signal
import time


def add(shared, chunk):
    return shared + chunk


def count(shared, chunk):
    """Return how many chunks this worker's copy of `shared` has seen before."""
    shared.append(chunk)
    time.sleep(0.01)
    return os.getpid(), len(shared) - 1


def fail(shared, chunk):
    raise shared


def die_once(folder, chunk):
    """Take the worker down at the first try of chunk 3, as a lack of memory would."""
    time.sleep(0.01)
    mark = folder / "died"
    if chunk == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return chunk


def fail_at(last, chunk):
    if chunk == last:
        raise ValueError(chunk)
    return chunk


def sleep_long(folder, chunk):
    (folder / str(os.getpid())).touch()
    time.sleep(60)


def halve(number):
    if number % 2:
        from fpmatch.errors import ImageError

        raise ImageError(f"{number} is odd")
    if number > 9:
        raise ValueError(number)
    return number // 2
