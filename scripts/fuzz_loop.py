"""The loop of `scripts/fuzz`: damage good files, have them read, and watch what becomes of it.

The readers run in a process of their own, which writes down each input before it is read: where the
process dies, or an input takes too long, the input is known and the next process goes on after it.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import random
import resource
import time
import traceback
import warnings
from dataclasses import dataclass, field
from multiprocessing.sharedctypes import RawArray
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

MOST_BYTES = 4 * 2**20  # of an input
MEMORY_BYTES = 4 * 2**30  # of address space, for one process
HANG_SECONDS = 60.0  # for one input, of which none should take more than one
START_SECONDS = 600.0  # for a process, on a machine that is busy
STARTING, READING, BETWEEN = 0, 1, 2  # what a process is at
STDERR = 2
MOST_FAILURES = 10  # of one target, after which it is left
MOST_WORDS = 500  # of a reason: a pipe takes them without a reader
EXTREMES = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
WORDS = (b"0", b"-1", b"99999", b"nan", b"1e308", b"", b"4294967296", b"\xff\xfe", b"[" * 50)


@dataclass
class Count:
    """Count what became of the inputs of one target."""

    inputs: int = 0
    refused: int = 0
    failures: list[tuple[Path, str]] = field(default_factory=list)


def damaged(rng: random.Random, corpus: list[bytes]) -> bytes:
    """Return a file of the corpus with a few places changed, cut out, doubled or exchanged."""
    data = bytearray(rng.choice(corpus))
    for _ in range(rng.choice((1, 1, 2, 3, 5, 8))):
        at = rng.randrange(len(data) + 1)
        if rng.random() < 0.5:
            at = min(at, rng.randrange(64))  # headers decide most
        length = rng.choice((1, 1, 2, 4, 8, rng.randrange(1, 64)))
        way = rng.randrange(8)
        if way == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif way == 1:
            data[at : at + length] = rng.randbytes(length)
        elif way == 2:
            size = rng.choice((1, 2, 4))
            number = rng.choice(EXTREMES) & ((1 << 8 * size) - 1)
            data[at : at + size] = number.to_bytes(size, rng.choice(("big", "little")))
        elif way == 3:
            del data[at : at + length]
        elif way == 4:
            data[at:at] = data[at : at + length] * rng.choice((1, 2, 20))
        elif way == 5:
            data[at : at + rng.choice((0, length))] = rng.choice(WORDS)
        elif way == 6:
            other = rng.choice(corpus)
            data[at:] = other[rng.randrange(len(other) + 1) :]
        elif rng.random() < 0.3:
            del data[at:]
    return bytes(data[:MOST_BYTES])


def inputs(seed: int, corpus: list[bytes]) -> Iterator[bytes]:
    """Yield the corpus as it is, and then damaged, without end."""
    yield from corpus
    rng = random.Random(seed)
    while True:
        yield damaged(rng, corpus)


def run(
    name: str,
    targets: Callable[[], list[Any]],
    extra: list[bytes],
    seconds: float,
    seed: int,
    into: Path,
    hang_seconds: float = HANG_SECONDS,
    most_failures: int = MOST_FAILURES,
) -> Count:
    """Feed the target `name` for some seconds, and save each input that it fails on.

    Parameters
    ----------
    name : str
        Of the target.
    targets : callable
        Returns the targets; a function at the top of a module.
    extra : list of bytes
        Files besides the target's own corpus.
    seconds : float
        How long.
    seed : int
        Another seed gives other inputs.
    into : Path
        Folder for failing inputs.
    hang_seconds : float
        How long one input may take.
    most_failures : int
        After how many the target is left.

    Returns
    -------
    Count
        What became of the inputs.
    """
    count, left = Count(), seconds
    context = multiprocessing.get_context("spawn")
    while left > 0 and len(count.failures) < most_failures:
        buffer = RawArray("B", MOST_BYTES)
        state = RawArray("q", 5)  # inputs so far, refused, bytes of this one, what it is at, ms
        failures = context.SimpleQueue()
        work = (name, targets, extra, left, seed + count.inputs, buffer, state, failures)
        process = context.Process(target=_work, args=work, daemon=True)
        process.start()
        reason = _watch(process, state, hang_seconds)
        process.join()
        count.inputs += state[0]
        count.refused += state[1]
        left -= max(state[4], 1) / 1000
        if not failures.empty():
            reason = failures.get()
        elif process.exitcode and not reason:
            reason = f"the process died (exit status {process.exitcode})"
        if reason:
            count.failures.append((_save(name, bytes(buffer[: state[2]]), into), reason))
    return count


def _watch(process: Any, state: Any, hang_seconds: float) -> str:
    """Wait for a process to end; end it where it hangs on one input, and say so."""
    last, since = (0, STARTING), time.monotonic()
    while process.is_alive():
        process.join(0.1)
        now = time.monotonic()
        at = (state[0], state[3])
        if at != last:
            last, since = at, now
        if state[3] == STARTING:
            if now - since > START_SECONDS:
                process.kill()
                raise RuntimeError(f"a process did not start within {START_SECONDS:g} s")
        elif now - since > hang_seconds:
            process.kill()
            state[4] += round(1000 * hang_seconds)
            return f"took more than {hang_seconds:g} s"
    return ""


def _work(
    name: str,
    targets: Callable[[], list[Any]],
    extra: list[bytes],
    seconds: float,
    seed: int,
    buffer: Any,
    state: Any,
    failures: Any,
) -> None:
    """Read inputs until the time is over; a failure ends the process, as it may have left harm."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), STDERR)  # C libraries tell of each damaged file
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    warnings.simplefilter("error")
    target = next(target for target in targets() if target.name == name)
    start = time.monotonic()
    shared = memoryview(buffer).cast("B")
    for data in inputs(seed, [*target.corpus, *extra]):
        passed = time.monotonic() - start
        state[4] = round(1000 * passed)
        if passed > seconds:
            return
        shared[: len(data)] = data
        state[2], state[3] = len(data), READING
        try:
            target.read(data)
        except FpmatchError as error:
            state[1] += 1
            if "\n" in str(error) or not str(error):
                failures.put(f"an error that is not one line: {error!r}"[:MOST_WORDS])
                return
        except BaseException as error:  # noqa: BLE001 - whatever it is, it is what we look for
            place = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{Path(place.filename).name}:{place.lineno}"
            failures.put(f"{type(error).__name__} in {where}: {error}"[:MOST_WORDS])
            return
        finally:
            state[0] += 1
            state[3] = BETWEEN


def _save(name: str, data: bytes, into: Path) -> Path:
    into.mkdir(parents=True, exist_ok=True)
    path = into / f"{name}-{hashlib.sha256(data).hexdigest()[:12]}.bin"
    path.write_bytes(data)
    return path
