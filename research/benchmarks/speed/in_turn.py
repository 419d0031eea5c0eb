"""Ours and a yardstick measured in turn, so that a busy machine slows both alike."""

from __future__ import annotations

import resource
import time

import pytest

OURS, YARDSTICK = "ours", "yardstick"


def in_turn(turns: int) -> pytest.MarkDecorator:
    """Return what runs a benchmark with its argument `side` ours, then the yardstick, in turn."""
    sides = [
        pytest.param(side, id=f"{side}-{turn}")
        for turn in range(turns)
        for side in (OURS, YARDSTICK)
    ]
    return pytest.mark.parametrize("side", sides)


def cpu(group: str) -> pytest.MarkDecorator:
    """Return the mark of a benchmark whose measure is the CPU time of this process."""
    return pytest.mark.benchmark(group=group, timer=time.process_time)


def wall(group: str) -> pytest.MarkDecorator:
    """Return the mark of a benchmark whose measure is the time that passes."""
    return pytest.mark.benchmark(group=group, timer=time.perf_counter)


def cpu_of_processes(group: str) -> pytest.MarkDecorator:
    """Return the mark of a benchmark whose measure is the CPU time of processes that it runs."""
    return pytest.mark.benchmark(group=group, timer=_of_children)


def _of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
