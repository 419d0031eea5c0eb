"""The loop of ``python -m research fuzz``: damage good files, have them read, and watch the reader.

The readers run in forked processes, which write down each input before it is read: where a process
dies, or an input takes too long, the input is known, and the next process continues.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import tempfile
import time
from dataclasses import dataclass, field
from multiprocessing.sharedctypes import RawArray
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.gallery.engine.processes import single_threaded
from research.fuzzing.findings import Finding, place_in_dump
from research.fuzzing.mutators.octets import MOST_BYTES
from research.fuzzing.sanitizer import reason_of, report_of
from research.fuzzing.worker import (
    DAMAGED,
    FIELDS,
    FILES,
    LENGTH,
    MEMORY_MB,
    PASSED_MS,
    READING,
    REFUSED,
    SLOWEST_MS,
    STAGE,
    Work,
    work,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from research.fuzzing.targets.target import Reader, Target

HANG_SECONDS = 5.0  # of work on one input, of which none should take more than one
PEAK_MB = 1000  # that a process may use
SLEEP_TIMES = 10  # so much longer an input may take where it does not work
MOST_KINDS = 10  # of failures of one target, after which it is left
POLL_SECONDS = 0.02
DUMP_SECONDS = 0.5  # that a process which hangs may take to write where it is


@dataclass
class Count:
    """Count the outcomes of the inputs of one target.

    `inputs`, `damaged`, `refused`: files that were to be read, those of them that had been damaged,
    and those refused. `findings`: what went wrong, each kind once, with the first input that showed
    it.
    """

    inputs: int = 0
    damaged: int = 0
    refused: int = 0
    seconds: float = 0.0  # how long it took, all processes together
    slowest_ms: int = 0  # the longest that an input took, in milliseconds
    peak_mb: int = 0  # the most memory that a process used, in millions of bytes
    findings: dict[str, Finding] = field(default_factory=dict)


@dataclass(frozen=True)
class Limits:
    """Bound what an input may cost, and how much of a target is done.

    `seconds`, `files`: how long a target is fed, and with how many damaged files, whichever is over
    first. `hang_seconds`: how long one input may take. `peak_mb`: how much memory a process may
    use. `most_kinds`: after how many kinds of failures a target is left.
    """

    seconds: float = math.inf
    files: float = math.inf
    hang_seconds: float = HANG_SECONDS
    peak_mb: float = PEAK_MB
    most_kinds: int = MOST_KINDS


class _Process:
    """A forked process that reads inputs of a target, and what is known of it."""

    def __init__(self, target: Target, reader: Reader, given: Work) -> None:
        self.buffer = RawArray("B", MOST_BYTES)
        self.state: Any = RawArray("q", len(FIELDS))
        self.dump = tempfile.NamedTemporaryFile(prefix="fpmatch-fuzz-")  # noqa: SIM115
        context = multiprocessing.get_context("fork")
        self.failures = context.SimpleQueue()
        shared = (self.buffer, self.state, self.failures, self.dump.name)
        self.process = context.Process(target=work, args=(target, reader, given, *shared))
        self.process.daemon = True
        self.process.start()
        self.at, self.since, self.spent = (-1, -1), time.monotonic(), 0.0

    def hangs(self, limit: float) -> bool:
        """Whether it has worked on one input for longer than the limit.

        Time is the process's own, for others may have the machine; of a process that sleeps, more
        of the clock's.
        """
        now, at = time.monotonic(), (self.state[FILES], self.state[STAGE])
        if at != self.at:
            self.at, self.since, self.spent = at, now, _cpu_seconds(self.process.pid)
            return False
        if at[1] != READING or now - self.since <= limit:
            return False
        worked = _cpu_seconds(self.process.pid) - self.spent
        return worked > limit or now - self.since > SLEEP_TIMES * limit

    def end(self, limit: float) -> None:
        """End a process that hangs, after it has written where it is."""
        os.kill(self.process.pid or 0, signal.SIGUSR1)
        end = time.monotonic() + DUMP_SECONDS
        while time.monotonic() < end and not Path(self.dump.name).stat().st_size:
            time.sleep(POLL_SECONDS)
        self.process.kill()
        self.process.join()
        self.state[PASSED_MS] += round(1000 * limit)
        self.state[SLOWEST_MS] = max(self.state[SLOWEST_MS], round(1000 * limit))

    def finding(self, name: str, limit: float, *, hung: bool) -> Finding | None:
        """Return what went wrong in an ended process; None where nothing did."""
        data = bytes(self.buffer[: self.state[LENGTH]])
        dump = Path(self.dump.name).read_text("utf-8", "replace")
        self.dump.close()
        if report := report_of(self.process.pid):
            return Finding(name, data, reason_of(report), report)
        if not self.failures.empty():
            return Finding(name, data, *self.failures.get())
        if hung:
            return Finding(name, data, f"took more than {limit:g} s {place_in_dump(dump)}", dump)
        if code := self.process.exitcode:
            why = f"the process died (exit status {code}) {place_in_dump(dump)}"
            return Finding(name, data, why, dump)
        return None


def run(
    target: Target,
    reader: Reader,
    extra: Sequence[bytes] = (),
    *,
    seed: int = 0,
    limits: Limits = Limits(),
    jobs: int = 1,
) -> Iterator[Count]:
    """Feed a target until its limits are reached; yield the counts so far now and then."""
    total = Count()
    corpus = [*reader.corpus, *extra]
    done = [Count() for _ in range(jobs)]
    running: dict[int, _Process] = {}

    def start(k: int) -> None:
        one = done[k]
        left = (limits.seconds - one.seconds, limits.files / jobs - one.damaged)
        if min(left) > 0 and len(total.findings) < limits.most_kinds:
            chosen = (seed * 1000 + k) * 1_000_003 + one.inputs
            given = Work(corpus, one.inputs, *left, chosen, limits.peak_mb)
            running[k] = _Process(target, reader, given)

    with single_threaded():  # a forked process would wait for threads
        yield from _run(start, running, done, total, target.name, limits)


def _run(
    start: Callable[[int], None],
    running: dict[int, _Process],
    done: list[Count],
    total: Count,
    name: str,
    limits: Limits,
) -> Iterator[Count]:
    """Start processes, and others where they end, until none is needed."""
    for k in range(len(done)):
        start(k)
    while running:
        time.sleep(POLL_SECONDS)
        for k, one in list(running.items()):
            hung = one.hangs(limits.hang_seconds)
            if hung:
                one.end(limits.hang_seconds)
            if one.process.is_alive():
                continue
            one.process.join()
            del running[k]
            _add(one.state, done[k], total)
            finding = one.finding(name, limits.hang_seconds, hung=hung)
            if finding is not None:
                total.findings.setdefault(finding.kind, finding).times += 1
            start(k)
        yield total


def _add(state: Any, own: Count, total: Count) -> None:
    """Add what a process did to the counts of its place and of the target."""
    for count in (own, total):
        count.inputs += state[FILES]
        count.damaged += state[DAMAGED]
        count.refused += state[REFUSED]
        count.seconds += max(state[PASSED_MS], 1) / 1000
        count.slowest_ms = max(count.slowest_ms, state[SLOWEST_MS])
        count.peak_mb = max(count.peak_mb, state[MEMORY_MB])


def _cpu_seconds(pid: int | None) -> float:
    """Return the CPU time of a process; 0 where it has ended or is unknown."""
    try:
        return time.clock_gettime((~(pid or 0) << 3) | 2)  # as clock_getcpuclockid makes it
    except OSError:
        return 0.0
