"""The loop of ``python -m research fuzz``: damage good files, have them read, and watch the reader.

The readers run in a forked process, which writes down each input before it is read: where the
process dies, or an input takes too long, the input is known, and the next process continues.
"""

from __future__ import annotations

import faulthandler
import gc
import hashlib
import math
import multiprocessing
import os
import random
import re
import resource
import signal
import tempfile
import time
import traceback
import warnings
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count as count_from
from multiprocessing.sharedctypes import RawArray
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fpmatch
from fpmatch.errors import FpmatchError
from fpmatch.gallery.engine.worker import single_threaded
from fpmatch.printable import printable
from research.fuzzing.damage import MOST_BYTES, damaged
from research.fuzzing.sanitizer import is_sanitized, reason_of, report_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from research.fuzzing.target import Reader, Target

MOST_KINDS = 10  # of failures of one target, after which it is left
POLL_SECONDS = 0.02
DUMP_SECONDS = 0.5  # that a process which hangs may take to write where it is
MEMORY_BYTES = 6 * 2**30  # of address space, for one process; what it really uses is measured
KIB_PER_MB = 1000**2 / 1024
DONE, REFUSED, LENGTH, READING, MEMORY_MB = FIELDS = range(5)
"""What a process shares: files read, those refused, bytes of the current one, whether it is being
read, and peak memory."""
_FRAME = re.compile(r'File "([^"]+)", line (\d+)')
_OURS = (Path(fpmatch.__file__).parent, Path(__file__).parent)  # package first


@dataclass
class Finding:
    """The first input that showed one kind of failure, and how often it was seen."""

    target: str  # name of the target
    data: bytes
    reason: str  # one line: what happened, and where
    details: str = ""  # the traceback, or the report of a sanitizer
    times: int = 0  # how many inputs showed it

    def save(self, folder: Path) -> Path:
        """Write the input, and its details beside it; return the file of the input."""
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{self.target}-{hashlib.sha256(self.data).hexdigest()[:12]}.bin"
        path.write_bytes(self.data)
        text = f"{self.reason}\n\n{self.details}\n"
        path.with_suffix(".txt").write_text(text, "utf-8", "replace")
        return path


@dataclass
class Count:
    """Count the inputs of one target, and those refused; keep the first input of each failure."""

    inputs: int = 0
    refused: int = 0
    findings: dict[str, Finding] = field(default_factory=dict)


@dataclass(frozen=True)
class Limits:
    """Bound what an input may cost, and how much of a target is done.

    `seconds`, `files`: how long a target is fed, and with how many files, whichever is over first.
    `hang_seconds`: how long one input may take. `peak_mb`: how much memory a process may use.
    """

    seconds: float = math.inf
    files: float = math.inf
    hang_seconds: float = 5.0
    peak_mb: float = 1000.0


def run(
    target: Target,
    reader: Reader,
    extra: Sequence[bytes] = (),
    *,
    seed: int = 0,
    limits: Limits = Limits(),
) -> Count:
    """Feed a target good files, then damaged ones, until its limits are reached."""
    total, end = Count(), time.monotonic() + limits.seconds
    given = reader._replace(corpus=[*reader.corpus, *extra])
    context = multiprocessing.get_context("fork")
    with single_threaded(), tempfile.TemporaryDirectory() as folder:
        # a forked process would wait for threads
        while time.monotonic() < end and total.inputs < limits.files:
            buffer, state = RawArray("B", MOST_BYTES), RawArray("q", len(FIELDS))
            failures, dump = context.SimpleQueue(), Path(folder, "dump")
            words = (target, given, total.inputs, seed, limits, end, buffer, state, failures, dump)
            process = context.Process(target=_work, args=words, daemon=True)
            process.start()
            hung = _watch(process, state, end, limits.hang_seconds)
            total.inputs += state[DONE] + (1 if state[READING] else 0)
            total.refused += state[REFUSED]
            reason, details = "", ""
            trace = dump.read_text("utf-8", "replace") if dump.exists() else ""
            if details := report_of(process.pid):
                reason = reason_of(details)
            elif not failures.empty():
                reason, details = failures.get()
            elif hung:
                reason, details = f"took more than {limits.hang_seconds:g} s {_place(trace)}", trace
            elif process.exitcode and time.monotonic() < end:
                reason = f"the process died (exit status {process.exitcode}) {_place(trace)}"
                details = trace
            if reason:
                finding = Finding(target.name, bytes(buffer[: state[LENGTH]]), reason, details)
                total.findings.setdefault(reason.partition(": ")[0], finding).times += 1
            if len(total.findings) >= MOST_KINDS:
                break
    return total


def _watch(process: Any, state: Any, end: float, limit: float) -> bool:
    """Wait until a process ends, and end it where the time is over; return whether it hung."""
    before, since, spent = -1, time.monotonic(), 0.0
    while process.is_alive():
        time.sleep(POLL_SECONDS)
        now = time.monotonic()
        used = _cpu_seconds(process.pid)
        if state[DONE] != before or not state[READING]:
            before, since, spent = state[DONE], now, used
        # its own time, for others may have the machine; of one that sleeps, the clock's
        hangs = used - spent > limit or now - since > 10 * limit
        if hangs or now > end + limit:
            os.kill(process.pid, signal.SIGUSR1)
            time.sleep(DUMP_SECONDS)
            process.kill()
            process.join()
            return hangs
    process.join()
    return False


def _work(
    target: Target,
    reader: Reader,
    before: int,
    seed: int,
    limits: Limits,
    end: float,
    buffer: Any,
    state: Any,
    failures: Any,
    dump: Path,
) -> None:
    """Read inputs until enough are read; a failure ends the process, as it may have left harm."""
    gc.freeze()
    stream = dump.open("w", encoding="utf-8")  # until the process ends
    if not is_sanitized():  # which reports faults itself, and needs much address space
        faulthandler.enable(stream, all_threads=False)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    faulthandler.register(signal.SIGUSR1, stream, all_threads=False)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    warnings.simplefilter("error")
    shared = memoryview(buffer).cast("B")
    for number, data in _inputs(target, reader, before, seed):
        if number >= limits.files or time.monotonic() > end:
            return
        shared[: len(data)] = data
        state[LENGTH], state[READING] = len(data), 1
        refused, failure = outcome(reader, data)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / KIB_PER_MB
        state[MEMORY_MB], state[READING] = round(peak), 0
        state[DONE] += 1
        state[REFUSED] += refused
        if failure is None and peak > limits.peak_mb:
            failure = (f"the process has used more than {limits.peak_mb:g} MB", "")
        if failure is not None:
            failures.put(failure)
            return


def _inputs(target: Target, reader: Reader, before: int, seed: int) -> Iterator[tuple[int, bytes]]:
    """Yield the inputs from a number on: the good files, then endless damaged ones."""
    for number in count_from(before):
        if number < len(reader.corpus):
            yield number, reader.corpus[number]
        else:
            rng = random.Random(f"{seed} {number}")
            yield number, damaged(rng, reader.corpus, target.words, reader.repair)


def outcome(reader: Reader, data: bytes) -> tuple[bool, tuple[str, str] | None]:
    """Have bytes read; return whether they were refused, and what went wrong with its traceback."""
    try:
        texts = reader.read(data) or ()
    except FpmatchError as error:
        wrong = _wrong_text(str(error))
        trace = "".join(traceback.format_exception(error))
        return True, (f"{wrong} {_place(trace)}", trace) if wrong else None
    except BaseException as error:  # noqa: BLE001  (any other error is a bug)
        trace = "".join(traceback.format_exception(error))
        first = next(iter(str(error).splitlines()), "")[:200]
        return False, (f"{type(error).__name__} {_place(trace)}: {first}", trace[-4000:])
    wrong = next(filter(None, map(_wrong_text, texts)), "")
    return False, (f"{wrong} of a note or name", "") if wrong else None


def _wrong_text(text: str) -> str:
    """Return what is wrong with a line that a command would print; "" where nothing is."""
    if not text:
        return "an empty text"
    if "\n" in text:
        return "a text of several lines"
    return "" if text == printable(text) else "control characters in the text"


def _place(trace: str) -> str:
    """Return the innermost line of fpmatch's own code in a traceback, or in what a dump has."""
    frames = [(Path(found[1]), found[2]) for found in _FRAME.finditer(trace)]
    if trace.startswith("Traceback"):
        frames.reverse()
    for folder in _OURS:
        for file, line in frames:
            if file.is_relative_to(folder):
                return f"in {file.name}:{line}"
    return "in no file of fpmatch"


def _cpu_seconds(pid: int) -> float:
    """Return the CPU time of a process; 0 where it has ended."""
    with suppress(OSError):
        return time.clock_gettime((~pid << 3) | 2)  # as clock_getcpuclockid makes it
    return 0.0
