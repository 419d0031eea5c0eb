#!/usr/bin/env python3
"""Measure how often `match_points(model="affine")` finds a known map, and how often a false one.

    .venv/bin/python research/benchmarks/affine_recovery.py [PAIRS A CELL]

Points are random in a square; a share of them is replaced by others, and all are mapped by an
affine map of a given anisotropy and jittered. Around a *patch* Q goes on: it has three times the
area. A map is right where it takes every point of P to within half a mean spacing of its true
place, along the direction that it stretches most. The independent pairs are of 5 to 120 points.
"""

from __future__ import annotations

import math
import sys
import time
from itertools import product
from typing import TYPE_CHECKING

import click
import numpy as np

from fpmatch.lab.points.match import match_points
from fpmatch.pointset.geometry.affine_transform import AffineTransform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

PAIRS = 20
SIZES = (20, 60, 200)
MODELS = ("whole", "patch")
JITTERS = (0.0, 0.1, 0.2)  # rms, in mean spacings of Q
ANISOTROPIES = (1.0, 3.0)
REPLACED = (0.0, 0.1, 0.2, 0.4)
SPACING = 10.0  # of Q
INDEPENDENT_PER_PAIR = 20


def make_pair(
    rng: np.random.Generator, n: int, model: str, jitter: float, anisotropy: float, replaced: float
) -> tuple[Floats, Floats, AffineTransform]:
    """Return P, Q in another order, and the map of P onto Q; P has one point to a unit of area."""
    side = math.sqrt(n)
    p = rng.uniform(0, side, (n, 2))
    first, then = rng.uniform(-math.pi, math.pi, 2)
    stretch = SPACING * math.sqrt(anisotropy), SPACING / math.sqrt(anisotropy)
    move = AffineTransform.of_parts(*stretch, rotation=float(then), tx=300.0, ty=-50.0).after(
        AffineTransform.of_parts(rotation=float(first))
    )
    kept = p[: n - round(replaced * n)]
    parts = [kept, rng.uniform(0, side, (n - len(kept), 2))]
    if model == "patch":
        around = rng.uniform(-0.366 * side, 1.366 * side, (round(3 * n), 2))
        parts.append(around[((around < 0) | (around > side)).any(axis=1)])
    q = move.apply(np.vstack(parts))
    q += rng.normal(0, jitter * SPACING / math.sqrt(2), q.shape)
    return p, q[rng.permutation(len(q))], move


def is_right(p: Floats, found: object, move: AffineTransform) -> bool:
    """Return whether a transform takes all points near their true places."""
    if not isinstance(found, AffineTransform):
        return False
    error = float(np.hypot(*(found.apply(p) - move.apply(p)).T).max())
    return error <= 0.5 * SPACING * math.sqrt(move.anisotropy)


def main() -> int:
    """Print the tables in Markdown; return 1 where an independent pair matched."""
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else PAIRS
    columns = list(product(ANISOTROPIES, REPLACED))
    heads = [f"{anisotropy:g}, {replaced:.0%}" for anisotropy, replaced in columns]
    print("| points | model | jitter |", " | ".join(heads), "| slowest, ms |")
    print("|", " | ".join(["---:", "---", *["---:"] * (len(heads) + 2)]), "|")
    for n, model, jitter in product(SIZES, MODELS, JITTERS):
        row, slowest, wrong = [], 0.0, 0
        for anisotropy, replaced in columns:
            right = 0
            for seed in range(pairs):
                rng = np.random.default_rng(seed)
                p, q, move = make_pair(rng, n, model, jitter, anisotropy, replaced)
                begin = time.process_time()
                found = match_points(p, q, model="affine").transform
                slowest = max(slowest, time.process_time() - begin)
                right += is_right(p, found, move)
                wrong += found is not None and not is_right(p, found, move)
            row.append(f"{right / pairs:.0%}")
        note = f" ({wrong} wrong)" if wrong else ""
        print(f"| {n} | {model} | {jitter:g}{note}", *row, "", sep=" | ", end="")
        print(f"{1e3 * slowest:.0f} |", flush=True)
    false, many = 0, pairs * INDEPENDENT_PER_PAIR
    with click.progressbar(range(many), file=sys.stderr, hidden=not sys.stderr.isatty()) as bar:
        for seed in bar:
            rng = np.random.default_rng(seed)
            p, q = (rng.uniform(0, 100, (int(size), 2)) for size in rng.integers(5, 121, 2))
            false += match_points(p, q, model="affine", reflect=True).transform is not None
    print(f"\n{false} of {many} independent pairs match, with their mirror images")
    return int(false > 0)


if __name__ == "__main__":
    sys.exit(main())
