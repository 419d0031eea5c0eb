#!/usr/bin/env python3
"""Match random sets with copies under random similarity transforms, without noise.

    .venv/bin/python research/benchmarks/exact_recovery.py [HOW MANY]

Every transform, of 100,000 unless another number is given, must come back to one part in a million
of the sets' extent, and every point must find its partner. The exit status is 1 where one does not.
"""

from __future__ import annotations

import math
import sys

import click
import numpy as np

from fpmatch.pointset.match import match_points
from fpmatch.pointset.similarity import Similarity

HOW_MANY = 100_000
FEWEST, MOST = 4, 200
SIDE = 100.0
MAX_SHIFT = 1000.0
MAX_LOG_SCALE = 3.0
MAX_ERROR = 1e-6


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


def main() -> int:
    """Run the script; return its exit status."""
    how_many = int(sys.argv[1]) if len(sys.argv) > 1 else HOW_MANY
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
    sys.exit(main())
