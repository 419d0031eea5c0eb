"""Work to hand to engines; a module, so that workers can import it."""

import os
import signal
import time


def add(shared, chunk):
    return shared + chunk


def count(shared, chunk):
    """Return how many chunks this worker's copy of `shared` has seen before."""
    shared.append(chunk)
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


def process(shared, chunk):
    """Return which process this is, late enough for another to begin with the next chunk."""
    time.sleep(0.02)
    return os.getpid()


def fail_at(last, chunk):
    if chunk == last:
        raise ValueError(chunk)
    return chunk


def sleep_long(folder, chunk):
    (folder / str(os.getpid())).touch()
    time.sleep(60)


def note(folder, chunk):
    """Leave a mark that this chunk was begun, and take a while."""
    (folder / f"{chunk}.begun").touch()
    time.sleep(0.1)
    return chunk


def add_piece(shared, piece, chunk):
    return shared + float(piece.sum()) + chunk


def address(shared, piece, chunk):
    """Return which process this is, and whether the memory of the piece is its own."""
    time.sleep(0.01)
    return os.getpid(), piece.flags.writeable


def fail_on_piece(shared, piece, chunk):
    raise shared


def die_on_piece(folder, piece, chunk):
    """Take the worker down at the first try of chunk 3, as a lack of memory would."""
    time.sleep(0.01)
    die_once(folder, chunk)
    return float(piece.sum()) + chunk
