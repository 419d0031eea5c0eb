#!/usr/bin/env python3
"""Time `match_points` on clusters, lines, lattices and others beside uniform sets of the same size.

    .venv/bin/python research/benchmarks/point_arrangements.py [POINTS ...] [--method NAME]

For each arrangement: the CPU time of the slowest of three tasks (a copy, a copy of which a fifth is
replaced, independent sets) over that of uniform sets in the same run; and whether the transform was
found. The exit status is 1 where a ratio is above ten.
"""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import repository  # noqa: F401

from fpmatch.errors import PointSetError
from fpmatch.lab.points.match import match_points
from research.arrangements import ARRANGEMENTS, TASKS, UNIFORM, arranged_pair

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset.geometry.similarity import Similarity

METHODS: dict[str, dict[str, Any]] = {
    "triangles": {},
    "reflect": {"reflect": True},
    "affine": {"model": "affine"},
    "paper": {"matcher": "paper"},
    "van-wamelen": {"matcher": "van-wamelen"},
}
MOST = 10.0  # times the time of uniform sets
NEAR = 1e-3  # of the extent: median error of a transform that was found


def was_found(p: NDArray[np.float64], found: Any, truth: Similarity) -> bool:
    """Return whether a transform takes most points near their true places."""
    if found is None:
        return False
    error = np.hypot(*(found.apply(p) - truth.apply(p)).T)
    return bool(np.median(error) <= NEAR * np.ptp(truth.apply(p)))


def measure(name: str, n: int, arguments: dict[str, Any]) -> tuple[float, list[str]]:
    """Return the time of the slowest task in seconds, and the result of each."""
    slowest, results = 0.0, []
    for task in TASKS:
        p, q, truth = arranged_pair(name, n, task)
        begin = time.process_time()
        try:
            found = match_points(p, q, **arguments).transform
        except PointSetError:
            results.append("refused")
            continue
        slowest = max(slowest, time.process_time() - begin)
        if truth is None:
            results.append("no match" if found is None else "match")
        else:
            results.append("found" if was_found(p, found, truth) else "not found")
    return slowest, results


@click.command()
@click.argument("points", type=int, nargs=-1)
@click.option("--method", type=click.Choice(list(METHODS)), default="triangles")
def main(points: tuple[int, ...], method: str) -> None:
    """Print a table in Markdown."""
    worst = 0.0
    print("| points | arrangement | time, ms | of uniform |", " | ".join(TASKS), "|")
    print("| ---: | --- | ---: | ---: | --- | --- | --- |")
    for n in points or (100, 1_000, 10_000):
        yardstick = 0.0
        for name in ARRANGEMENTS:
            seconds, results = measure(name, n, METHODS[method])
            yardstick = seconds if name == UNIFORM else yardstick
            worst = max(worst, seconds / yardstick)
            figures = f"{1e3 * seconds:.0f} | {seconds / yardstick:.2f}"
            print(f"| {n} | {name} | {figures} |", " | ".join(results), "|", flush=True)
    print(f"\nat most {worst:.1f} times the time of uniform sets")
    sys.exit(worst > MOST)


if __name__ == "__main__":
    main()
