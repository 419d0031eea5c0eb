"""What two processes gain that share nothing but the machine; no program gains more."""

from __future__ import annotations

import subprocess
import sys
import time

ARITHMETIC = "total = 0\nfor k in range(20_000_000): total += k * k % 7"


def gain_of_two_processes(environment: dict[str, str] | None = None) -> float:
    """Return how many times as much two processes get done as one, in plain arithmetic."""
    took = []
    for processes in (1, 2):
        start = time.perf_counter()
        words = [sys.executable, "-c", ARITHMETIC]
        started = [subprocess.Popen(words, env=environment) for _ in range(processes)]
        for process in started:
            process.wait()
        took.append(time.perf_counter() - start)
    return 2 * took[0] / took[1]
