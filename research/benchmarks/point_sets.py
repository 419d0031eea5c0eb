#!/usr/bin/env python3
"""Measure `match_points` on sets with rows, periods and crowds.

.venv/bin/python research/benchmarks/point_sets.py [SEEDS]
"""

from __future__ import annotations

import sys
from typing import Any

import click
import numpy as np
import repository  # noqa: F401

from fpmatch.lab.points.match import match_points
from fpmatch.lab.points.triangles.matcher import MAX_CHANCE
from research.arrangements import COPIED, INDEPENDENT, copied_pair, independent_sets

PAIRS = 20


@click.command()
@click.argument("seeds", type=int, default=PAIRS)
def main(seeds: int) -> None:
    """Match copies of sets with rows, periods and crowds, and independent sets with the same.

    A map is wrong where it takes a point farther than a tenth of P's extent from its true place.
    The exit status is 1 where a map of a copy is wrong.
    """
    status = 0
    print("| kind | copies | right | all pairs | several maps | no match | wrong |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for kind in COPIED:
        right = whole = several = none = wrong = 0
        for seed in range(seeds):
            p, q, truth = copied_pair(kind, seed)
            match = match_points(p, q)
            if match.transform is None:
                none, several = none + 1, several + (match.equal_maps > 1)
            elif _farthest(p, match.transform, truth) > np.ptp(p) / 10:
                wrong += 1
            else:
                right, whole = right + 1, whole + (len(match.pairs) == len(p))
        status |= wrong > 0
        row = (kind, seeds, right, whole, several, none, wrong)
        print("|", " | ".join(map(str, row)), "|", flush=True)
    print("\n| kind | independent pairs | matches | stated, at most |")
    print("| --- | ---: | ---: | ---: |")
    for kind in INDEPENDENT:
        pairs = (independent_sets(kind, seed) for seed in range(seeds))
        matched = sum(match_points(p, q).transform is not None for p, q in pairs)
        print("|", kind, "|", seeds, "|", matched, "|", f"{MAX_CHANCE * seeds:g} |", flush=True)
    sys.exit(status)


def _farthest(p: np.ndarray, found: Any, truth: Any) -> float:
    """Return how far a transform takes a point from its true place, at most."""
    return float(np.hypot(*(found.apply(p) - truth.apply(p)).T).max())


if __name__ == "__main__":
    main()
