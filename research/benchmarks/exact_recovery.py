#!/usr/bin/env python3
"""Match random sets with copies under random similarity transforms, without noise.

    .venv/bin/python research/benchmarks/exact_recovery.py [HOW MANY]
    .venv/bin/python research/benchmarks/exact_recovery.py --large POINTS [HOW MANY]

Every transform, of 100,000 unless another number is given, must come back to one part in a million
of the sets' extent, and every point must find its partner. The exit status is 1 where one does not.
With --large, a table for sets of so many points, by the share that has partners: how many of 5
transforms come back, how many matches are wrong, and the CPU time of the slowest. The exit status
is 1 where one is wrong, or does not come back though half the points have partners.
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

HOW_MANY = 100_000
FEWEST, MOST = 4, 200
SIDE = 100.0
MAX_SHIFT = 1000.0
MAX_LOG_SCALE = 3.0
MAX_ERROR = 1e-6
SHARES = (1.0, 0.7, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0)
FEW = 5
ALWAYS_FOUND = 0.5


def error(seed: int) -> float:
    """Return the largest error of one recovery over the extent, infinite where it failed."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, SIDE, (int(rng.integers(FEWEST, MOST + 1)), 2))
    scale = math.exp(rng.uniform(-MAX_LOG_SCALE, MAX_LOG_SCALE))
    shift = rng.uniform(-MAX_SHIFT, MAX_SHIFT, 2)
    truth = Similarity(scale, rng.uniform(-math.pi, math.pi), float(shift[0]), float(shift[1]))
    order = rng.permutation(len(p))
    match = match_points(p, truth.apply(p)[order])
    if match.transform is None or len(match.pairs) < len(p):
        return math.inf
    if not (order[match.pairs[:, 1]] == match.pairs[:, 0]).all():
        return math.inf
    return float(abs(match.transform.apply(p) - truth.apply(p)).max()) / (scale * SIDE)


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
@click.argument("how_many", type=int, required=False)
@click.option("--large", metavar="POINTS", type=int, help="Size of sets that lack partners.")
def main(how_many: int | None, large: int | None) -> None:
    """Run the script and exit with its status."""
    if large is not None:
        sys.exit(measure_large(large, how_many or FEW))
    sys.exit(measure_copies(how_many or HOW_MANY))


def measure_copies(how_many: int) -> int:
    """Match copies and print how many were recovered; return the exit status."""
    errors = np.empty(how_many)
    with click.progressbar(range(how_many), file=sys.stderr, hidden=not sys.stderr.isatty()) as bar:
        for seed in bar:
            errors[seed] = error(seed)
    missed = np.flatnonzero(errors > MAX_ERROR)
    print(f"{how_many - len(missed)} of {how_many} transforms recovered to {MAX_ERROR:g}")
    print(
        f"largest error of these: {errors[errors <= MAX_ERROR].max(initial=0.0):.1e} of the extent"
    )
    if len(missed):
        print(f"missed, by seed: {', '.join(map(str, missed[:20]))}")
    return int(len(missed) > 0)


if __name__ == "__main__":
    main()
