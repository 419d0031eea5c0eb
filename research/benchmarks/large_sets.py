#!/usr/bin/env python3
"""Match large random sets, of which others replace a share, under a random similarity transform.

    .venv/bin/python research/benchmarks/large_sets.py POINTS [HOW MANY]

The table has, by the share that has partners, how many of 5 transforms come back, how many matches
are wrong, and the CPU time of the slowest. The exit status is 1 where one is wrong, or does not
come back though half the points have partners.
"""

from __future__ import annotations

import math
import sys
import time

import click
import numpy as np

from fpmatch.lab.points.match import match_points
from fpmatch.lab.points.triangles.matcher import TriangleParameters
from fpmatch.pointset.geometry.similarity import Similarity

SIDE = 100.0
SHARES = (1.0, 0.7, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0)
FEW = 5
ALWAYS_FOUND = 0.5


def try_share(n: int, share: float, seed: int) -> tuple[bool, bool, float]:
    """Return whether sets with a share of partners match, and truly; and the CPU time in s."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, SIDE, (n, 2))
    q = p.copy()
    replaced = rng.permutation(n)[: n - round(share * n)]
    q[replaced] = rng.uniform(0, SIDE, (len(replaced), 2))
    truth = Similarity(1.7, 0.7, 300.0, -200.0)
    q = truth.apply(q)[rng.permutation(n)]
    begin = time.process_time()
    found = match_points(p, q).transform
    seconds = time.process_time() - begin
    near = 1.7 * SIDE / math.sqrt(n)
    true = found is not None and abs(found.apply(p) - truth.apply(p)).max() < near
    return found is not None, bool(true), seconds


def measure_large(n: int, how_many: int) -> int:
    """Print the row of a table for sets of so many points; return the exit status."""
    status, cells = 0, []
    for share in SHARES:
        tries = [try_share(n, share, seed) for seed in range(how_many)]
        matched, true, seconds = (np.array(column) for column in zip(*tries, strict=True))
        found, wrong = np.count_nonzero(true), np.count_nonzero(matched & ~true)
        status |= bool(wrong or (share >= ALWAYS_FOUND and found < how_many))
        cells.append(f"{found}, {wrong} wrong, {seconds.max():.2f} s")
    print(f"| points | limit | {' | '.join(f'{share:.0%}' for share in SHARES)} |")
    print(f"{'| ---: ' * (2 + len(SHARES))}|")
    limit = TriangleParameters().most_proposals(n)
    print(f"| {n:,} | {limit:,} | {' | '.join(cells)} |")
    return status


@click.command()
@click.argument("points", type=int)
@click.argument("how_many", type=int, default=FEW)
def main(points: int, how_many: int) -> None:
    """Print the row of a table for sets of so many points, and exit with the status."""
    sys.exit(measure_large(points, how_many))


if __name__ == "__main__":
    main()
