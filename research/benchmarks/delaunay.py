#!/usr/bin/env python3
"""Time `triangulate`, with its rings, against scipy.spatial.Delaunay on random points.

    .venv/bin/python research/benchmarks/delaunay.py

Both take the same points in turn, and the least processor time of each is compared. The exit
status is 1 where `triangulate` is less than 4 times as fast at 50 to 6,400 points, or where its
time from 6,400 to 100,000 points grows more than 1.2 times as n log n does.
"""

from __future__ import annotations

import math
import sys
import time
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import Delaunay

from fpmatch.pointset.delaunay._delaunay_kernel import COMPILED
from fpmatch.pointset.delaunay.triangulate import triangulate

if TYPE_CHECKING:
    from collections.abc import Callable

SIZES = (30, 40, 50, 100, 200, 400, 800, 1600, 3200, 6400, 100_000)
COMPARED = (50, 6400)
MIN_SPEED_UP = 4.0
GROWTH = (6400, 100_000)
MAX_GROWTH = 1.2
SETS_OF_POINTS = 20_000  # points in the sets that are timed together, so that none is remembered
ROUNDS = 7


def seconds(function: Callable[[np.ndarray], object], sets: list[np.ndarray]) -> float:
    """Return the processor time of one call, the mean over the sets."""
    start = time.process_time()
    for points in sets:
        function(points)
    return (time.process_time() - start) / len(sets)


def measure(n: int) -> tuple[float, float]:
    """Return the least time of `triangulate` and of scipy for n random points."""
    rng = np.random.default_rng(n)
    sets = [rng.random((n, 2)) for _ in range(max(1, SETS_OF_POINTS // n))]
    times = [(seconds(triangulate, sets), seconds(Delaunay, sets)) for _ in range(ROUNDS)]
    ours, scipys = zip(*times, strict=True)
    return min(ours), min(scipys)


def main() -> int:
    """Run the script; return its exit status."""
    print(f"kernels {'compiled' if COMPILED else 'interpreted'}")
    print(f"{'points':>8}{'ours, ms':>12}{'scipy, ms':>12}{'ratio':>8}")
    ours, speed_up = {}, {}
    for n in SIZES:
        ours[n], scipys = measure(n)
        speed_up[n] = scipys / ours[n]
        print(f"{n:8}{ours[n] * 1e3:12.4f}{scipys * 1e3:12.4f}{speed_up[n]:8.2f}")
    few, many = GROWTH
    growth = ours[many] / ours[few] / (many * math.log(many) / (few * math.log(few)))
    least = min(speed_up[n] for n in SIZES if COMPARED[0] <= n <= COMPARED[1])
    print(
        f"least ratio, {COMPARED[0]} to {COMPARED[1]} points: {least:.2f} (at least {MIN_SPEED_UP})"
    )
    print(f"growth over n log n, {few} to {many} points: {growth:.2f} (at most {MAX_GROWTH})")
    return int(least < MIN_SPEED_UP or growth > MAX_GROWTH)


if __name__ == "__main__":
    sys.exit(main())
