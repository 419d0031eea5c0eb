"""The process of ``python -m research fuzz`` that reads inputs, and judges what comes of each."""

from __future__ import annotations

import faulthandler
import gc
import os
import resource
import signal
import time
import traceback
import warnings
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.errors import FpmatchError
from fpmatch.printable import printable
from research.fuzzing.findings import place_of
from research.fuzzing.mutators.octets import inputs
from research.fuzzing.sanitizer import is_sanitized

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from research.fuzzing.targets.target import Reader, Target

MEMORY_BYTES = 6 * 2**30  # of address space, for one process; what it really uses is measured
KIB_PER_MB = 1000**2 / 1024
STDERR = 2
STARTING, READING, BETWEEN = 0, 1, 2  # stages of a process

# The state of a process in the array that it shares: files read, those of them that were damaged,
# and those refused; bytes of the current one, and the stage; milliseconds so far, and of the
# slowest file; peak memory.
FILES, DAMAGED, REFUSED, LENGTH, STAGE, PASSED_MS, SLOWEST_MS, MEMORY_MB = FIELDS = range(8)


@dataclass(frozen=True)
class Work:
    """State what a process reads: good files, of which some were read before, and for how long.

    `files` is the number of damaged files, and `peak_mb` the memory that it may use.
    """

    corpus: list[bytes]
    read_before: int
    seconds: float
    files: float
    seed: int
    peak_mb: float


def work(
    target: Target, reader: Reader, given: Work, buffer: Any, state: Any, failures: Any, dump: str
) -> None:
    """Read inputs until enough are read; a failure ends the process, as it may have left harm."""
    prepare_process(dump, sanitized=is_sanitized())
    start = before = time.monotonic()
    shared = memoryview(buffer).cast("B")
    for data, is_damaged in _inputs(target, given):
        if before - start > given.seconds or state[DAMAGED] >= given.files:
            return
        shared[: len(data)] = data
        state[LENGTH], state[STAGE] = len(data), READING
        used = time.process_time()
        refused, failure = outcome(reader, data)
        used = time.process_time() - used
        now = time.monotonic()
        state[PASSED_MS] = round(1000 * (now - start))
        state[SLOWEST_MS] = max(state[SLOWEST_MS], round(1000 * used))
        state[MEMORY_MB] = max(state[MEMORY_MB], _peak_mb())
        before = now
        state[FILES] += 1
        state[REFUSED] += refused
        state[DAMAGED] += is_damaged
        state[STAGE] = BETWEEN
        if failure is None and state[MEMORY_MB] > given.peak_mb:
            failure = (f"the process has used more than {given.peak_mb:g} MB", "")
        if failure is not None:
            failures.put(failure)
            return


def prepare_process(dump: str, *, sanitized: bool) -> None:
    """Silence C libraries, turn warnings into errors, and write to `dump` where it dies."""
    gc.freeze()
    stream = Path(dump).open("w", encoding="utf-8")  # noqa: SIM115  (until the process ends)
    if not sanitized:  # which reports faults itself, and needs much address space
        faulthandler.enable(stream, all_threads=False)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    faulthandler.register(signal.SIGUSR1, stream, all_threads=False)
    os.dup2(os.open(os.devnull, os.O_WRONLY), STDERR)
    warnings.simplefilter("error")


def _inputs(target: Target, given: Work) -> Iterator[tuple[bytes, bool]]:
    """Yield the good files that are still to be read, then damaged ones; and which they are."""
    endless = inputs(given.seed, given.corpus, target.mutators, target.words)
    return islice(endless, min(given.read_before, len(given.corpus)), None)


def outcome(reader: Reader, data: bytes) -> tuple[bool, tuple[str, str] | None]:
    """Have bytes read; return whether they were refused, and what went wrong with its traceback."""
    try:
        texts: Iterable[str] = reader.read(data) or ()
    except FpmatchError as error:
        if wrong := _wrong_text(str(error)):
            place = place_of(error)
            return True, (f"{wrong} of {type(error).__name__} {place}", repr(error))
        return True, None
    except BaseException as error:  # noqa: BLE001  (any other error is a bug)
        trace = "".join(traceback.format_exception(error))
        first = next(iter(str(error).splitlines()), "")[:200]
        return False, (f"{type(error).__name__} {place_of(error)}: {first}", trace[-4000:])
    for text in texts:
        if wrong := _wrong_text(text):
            return False, (f"{wrong} of a note or name", repr(text)[:1000])
    return False, None


def _wrong_text(text: str) -> str:
    """Return what is wrong with a line that a command would print; "" where nothing is."""
    if not text:
        return "an empty text"
    if "\n" in text:
        return "a text of several lines"
    return "" if text == printable(text) else "control characters in the text"


def _peak_mb() -> int:
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / KIB_PER_MB)
