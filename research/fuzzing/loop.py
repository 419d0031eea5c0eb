"""The loop of ``python -m research fuzz``: damage good files, have them read, and watch the reader.

The readers run in a process of their own, which writes down each input before it is read: where the
process dies, or an input takes too long, the input is known and the next process continues.
"""

from __future__ import annotations

import hashlib
import math
import multiprocessing
import os
import random
import resource
import struct
import time
import traceback
import warnings
import zlib
from dataclasses import dataclass, field
from multiprocessing.sharedctypes import RawArray
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

MOST_BYTES = 4 * 2**20  # of an input
MEMORY_BYTES = 4 * 2**30  # of address space, for one process
PEAK_MB = 2000  # that a process may really use
HANG_SECONDS = 60.0  # of work on one input, of which none should take more than one
SLEEP_TIMES = 10  # so much longer it may take where it does not work
START_SECONDS = 600.0  # for a process, on a machine that is busy
STARTING, READING, BETWEEN = 0, 1, 2  # stages of a process
STDERR = 2
MOST_FAILURES = 10  # of one target, after which it is left
MOST_WORDS = 500  # of a reason: a pipe takes them without a reader
EXTREMES = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
WORDS = (b"0", b"-1", b"99999", b"nan", b"1e308", b"", b"4294967296", b"\xff\xfe", b"[" * 50)
PNG = b"\x89PNG\r\n\x1a\n"
KIB_PER_MB = 1000**2 / 1024

# The state of a process in the array that it shares: files read, those of them that were damaged,
# and those refused; bytes of the current one, and the stage; milliseconds so far, and of the
# slowest file; peak memory.
FILES, DAMAGED, REFUSED, LENGTH, STAGE, PASSED_MS, SLOWEST_MS, MEMORY_MB = FIELDS = range(8)


@dataclass
class Count:
    """Count the outcomes of the files of one target.

    Parameters
    ----------
    inputs, damaged, refused : int
        Files that were to be read, those of them that had been damaged, and those refused.
    seconds : float
        How long it took, without the start of processes.
    slowest_ms : int
        The longest that a file took, in milliseconds.
    peak_mb : int
        The most memory that a process used, in millions of bytes.
    failures : list of (Path, str)
        Where the files lie that were neither read nor refused, and what happened.
    """

    inputs: int = 0
    damaged: int = 0
    refused: int = 0
    seconds: float = 0.0
    slowest_ms: int = 0
    peak_mb: int = 0
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
    if data.startswith(PNG) and rng.random() < 0.5:
        data = with_right_sums(data)
    return bytes(data[:MOST_BYTES])


def with_right_sums(png: bytearray) -> bytearray:
    """Return a PNG with right checksums, which otherwise stop nearly all damage."""
    at = len(PNG)
    while at + 12 <= len(png):
        end = at + 8 + struct.unpack_from(">L", png, at)[0]
        if end + 4 > len(png):
            break
        struct.pack_into(">L", png, end, zlib.crc32(png[at + 4 : end]))
        at = end + 4
    return png


def inputs(seed: int, corpus: list[bytes]) -> Iterator[tuple[bytes, bool]]:
    """Yield the corpus, then endless damaged files; and whether each is damaged."""
    yield from ((data, False) for data in corpus)
    rng = random.Random(seed)
    while True:
        yield damaged(rng, corpus), True


def run(
    name: str,
    targets: Callable[[], list[Any]],
    extra: list[bytes],
    seed: int,
    into: Path,
    *,
    seconds: float = math.inf,
    files: float = math.inf,
    hang_seconds: float = HANG_SECONDS,
    most_failures: int = MOST_FAILURES,
) -> Count:
    """Feed the target `name` for some seconds or files, and save each failing input.

    Parameters
    ----------
    name : str
        Of the target.
    targets : callable
        Returns the targets; a function at the top of a module.
    extra : list of bytes
        Files besides the target's own corpus.
    seed : int
        Another seed gives other inputs.
    into : Path
        Folder for failing inputs.
    seconds, files : float
        How long, and how many damaged files, whichever is over first.
    hang_seconds : float
        How long one input may take.
    most_failures : int
        After how many the target is left.

    Returns
    -------
    Count
        The outcomes of the inputs.
    """
    count = Count()
    context = multiprocessing.get_context("spawn")
    while count.seconds < seconds and count.damaged < files and len(count.failures) < most_failures:
        buffer = RawArray("B", MOST_BYTES)
        state = RawArray("q", len(FIELDS))
        failures = context.SimpleQueue()
        left = (seconds - count.seconds, files - count.damaged)
        work = (name, targets, extra, *left, seed + count.inputs, buffer, state, failures)
        process = context.Process(target=_work, args=work, daemon=True)
        process.start()
        reason = _watch(process, state, hang_seconds)
        process.join()
        count.inputs += state[FILES]
        count.damaged += state[DAMAGED]
        count.refused += state[REFUSED]
        count.seconds += max(state[PASSED_MS], 1) / 1000
        count.slowest_ms = max(count.slowest_ms, state[SLOWEST_MS])
        count.peak_mb = max(count.peak_mb, state[MEMORY_MB])
        if not failures.empty():
            reason = failures.get()
        elif process.exitcode and not reason:
            reason = f"the process died (exit status {process.exitcode})"
        if reason:
            count.failures.append((_save(name, bytes(buffer[: state[LENGTH]]), into), reason))
    return count


def _watch(process: Any, state: Any, hang_seconds: float) -> str:
    """Wait for a process to end; end it where it hangs on one input, and say so.

    Time is the process's own, for others may have the machine; of a process that sleeps, more of
    the clock's.
    """
    last, since, spent = (0, STARTING), time.monotonic(), 0.0
    while process.is_alive():
        process.join(0.1)
        now = time.monotonic()
        at = (state[FILES], state[STAGE])
        if at != last:
            last, since, spent = at, now, _cpu_seconds(process.pid)
        if state[STAGE] == STARTING:
            if now - since > START_SECONDS:
                process.kill()
                raise RuntimeError(f"a process did not start within {START_SECONDS:g} s")
        elif now - since > hang_seconds and (
            _cpu_seconds(process.pid) - spent > hang_seconds
            or now - since > SLEEP_TIMES * hang_seconds
        ):
            process.kill()
            state[PASSED_MS] += round(1000 * hang_seconds)
            state[SLOWEST_MS] = round(1000 * hang_seconds)
            return f"took more than {hang_seconds:g} s"
    return ""


def _cpu_seconds(pid: int) -> float:
    """Return the CPU time of a process; 0 where it has ended or is unknown."""
    try:
        return time.clock_gettime((~pid << 3) | 2)  # as clock_getcpuclockid makes it
    except OSError:
        return 0.0


def _work(
    name: str,
    targets: Callable[[], list[Any]],
    extra: list[bytes],
    seconds: float,
    files: float,
    seed: int,
    buffer: Any,
    state: Any,
    failures: Any,
) -> None:
    """Read inputs until enough are read; a failure ends the process, as it may have left harm."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), STDERR)  # C libraries report each damaged file
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    warnings.simplefilter("error")
    target = next(target for target in targets() if target.name == name)
    start = before = time.monotonic()
    shared = memoryview(buffer).cast("B")
    for data, is_damaged in inputs(seed, [*target.corpus, *extra]):
        if before - start > seconds or state[DAMAGED] >= files:
            return
        shared[: len(data)] = data
        state[LENGTH], state[STAGE] = len(data), READING
        reason = _failure_of(target, data, state)
        now = time.monotonic()
        state[PASSED_MS] = round(1000 * (now - start))
        state[SLOWEST_MS] = max(state[SLOWEST_MS], round(1000 * (now - before)))
        before = now
        state[FILES] += 1
        state[DAMAGED] += is_damaged
        state[STAGE] = BETWEEN
        if reason:
            failures.put(reason[:MOST_WORDS])
            return


def _failure_of(target: Any, data: bytes, state: Any) -> str:
    """Have a target read bytes; return what went wrong, "" where nothing did."""
    try:
        target.read(data)
    except FpmatchError as error:
        state[REFUSED] += 1
        if "\n" in str(error) or not str(error):
            return f"an error that is not one line: {error!r}"
    except BaseException as error:  # noqa: BLE001 - any other error is a bug
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}:{place.lineno}"
        return f"{type(error).__name__} in {where}: {error}"
    peak = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / KIB_PER_MB)
    state[MEMORY_MB] = max(state[MEMORY_MB], peak)
    return f"the process has used {peak} MB" if peak > PEAK_MB else ""


def _save(name: str, data: bytes, into: Path) -> Path:
    into.mkdir(parents=True, exist_ok=True)
    path = into / f"{name}-{hashlib.sha256(data).hexdigest()[:12]}.bin"
    path.write_bytes(data)
    return path
