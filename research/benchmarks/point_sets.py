#!/usr/bin/env python3
"""Measure `match_points` on large sets that lack partners, on arrangements, and on affine maps.

.venv/bin/python research/benchmarks/point_sets.py large POINTS [HOW MANY]
.venv/bin/python research/benchmarks/point_sets.py arrangements [POINTS ...] [--method NAME]
.venv/bin/python research/benchmarks/point_sets.py kinds [SEEDS]
.venv/bin/python research/benchmarks/point_sets.py affine [PAIRS A CELL]
"""

from __future__ import annotations

import math
import sys
import time
from itertools import product
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import repository  # noqa: F401

from fpmatch.errors import PointSetError
from fpmatch.lab.points.match import match_points
from fpmatch.lab.points.triangles.matcher import TriangleParameters
from fpmatch.lab.points.triangles.search import MAX_CHANCE
from fpmatch.pointset.geometry.affine_transform import AffineTransform
from fpmatch.pointset.geometry.similarity import Similarity
from research.arrangements import (
    ARRANGEMENTS,
    COPIED,
    INDEPENDENT,
    TASKS,
    UNIFORM,
    arranged_pair,
    copied_pair,
    independent_sets,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

SIDE = 100.0
SHARES = (1.0, 0.7, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0)
FEW = 5
ALWAYS_FOUND = 0.5

METHODS: dict[str, dict[str, Any]] = {
    "triangles": {},
    "reflect": {"reflect": True},
    "affine": {"model": "affine"},
    "paper": {"matcher": "paper"},
    "van-wamelen": {"matcher": "van-wamelen"},
}
MOST = 10.0  # times the time of uniform sets
NEAR = 1e-3  # of the extent: median error of a transform that was found

PAIRS = 20
SIZES = (20, 60, 200)
MODELS = ("whole", "patch")
JITTERS = (0.0, 0.1, 0.2)  # rms, in mean spacings of Q
ANISOTROPIES = (1.0, 3.0)
REPLACED = (0.0, 0.1, 0.2, 0.4)
SPACING = 10.0  # of Q
INDEPENDENT_PER_PAIR = 20


def timed_match(p: Floats, q: Floats, **arguments: Any) -> tuple[Any, float]:
    """Return the transform of a match, and the CPU time in seconds."""
    begin = time.process_time()
    transform = match_points(p, q, **arguments).transform
    return transform, time.process_time() - begin


def errors(p: Floats, found: Any, truth: Any) -> Floats:
    """Return how far a transform takes each point from its true place; infinite without one."""
    if found is None:
        return np.full(len(p), np.inf)
    return np.hypot(*(found.apply(p) - truth.apply(p)).T)


@click.group()
def main() -> None:
    """Measure `match_points`; each command prints a table in Markdown."""


def try_share(n: int, share: float, seed: int) -> tuple[bool, bool, float]:
    """Return whether sets with a share of partners match, and truly; and the CPU time in s."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, SIDE, (n, 2))
    q = p.copy()
    replaced = rng.permutation(n)[: n - round(share * n)]
    q[replaced] = rng.uniform(0, SIDE, (len(replaced), 2))
    truth = Similarity(1.7, 0.7, 300.0, -200.0)
    found, seconds = timed_match(p, truth.apply(q)[rng.permutation(n)])
    true = errors(p, found, truth).max() < truth.scale * SIDE / math.sqrt(n)
    return found is not None, bool(true), seconds


@main.command()
@click.argument("n", metavar="POINTS", type=int)
@click.argument("how_many", type=int, default=FEW)
def large(n: int, how_many: int) -> None:
    """Match uniform sets of so many POINTS, of which others replace a share.

    By the share that has partners: how many transforms come back, how many matches are wrong, and
    the CPU time of the slowest. The exit status is 1 where one is wrong, or does not come back
    though half the points have partners.
    """
    status, cells = 0, []
    for share in SHARES:
        tries = [try_share(n, share, seed) for seed in range(how_many)]
        matched, true, seconds = (np.array(column) for column in zip(*tries, strict=True))
        right, wrong = np.count_nonzero(true), np.count_nonzero(matched & ~true)
        status |= bool(wrong or (share >= ALWAYS_FOUND and right < how_many))
        cells.append(f"{right}, {wrong} wrong, {seconds.max():.2f} s")
    print(f"| points | limit | {' | '.join(f'{share:.0%}' for share in SHARES)} |")
    print(f"{'| ---: ' * (2 + len(SHARES))}|")
    limit = TriangleParameters().most_proposals(n)
    print(f"| {n:,} | {limit:,} | {' | '.join(cells)} |")
    sys.exit(status)


def try_tasks(name: str, n: int, arguments: dict[str, Any]) -> tuple[float, list[str]]:
    """Return the time of the slowest task in seconds, and the result of each."""
    slowest, results = 0.0, []
    for task in TASKS:
        p, q, truth = arranged_pair(name, n, task)
        try:
            found, seconds = timed_match(p, q, **arguments)
        except PointSetError:
            results.append("refused")
            continue
        slowest = max(slowest, seconds)
        if truth is None:
            results.append("no match" if found is None else "match")
        else:
            near = np.median(errors(p, found, truth)) <= NEAR * np.ptp(truth.apply(p))
            results.append("found" if near else "not found")
    return slowest, results


@main.command()
@click.argument("points", type=int, nargs=-1)
@click.option("--method", type=click.Choice(list(METHODS)), default="triangles")
def arrangements(points: tuple[int, ...], method: str) -> None:
    """Time clusters, lines, lattices and others beside uniform sets of the same size.

    For each arrangement: the CPU time of the slowest of three tasks (a copy, a copy of which a
    fifth is replaced, independent sets) over that of uniform sets in the same run; and whether the
    transform was found. The exit status is 1 where a ratio is above ten.
    """
    worst = 0.0
    print("| points | arrangement | time, ms | of uniform |", " | ".join(TASKS), "|")
    print("| ---: | --- | ---: | ---: | --- | --- | --- |")
    for n in points or (100, 1_000, 10_000):
        yardstick = 0.0
        for name in ARRANGEMENTS:
            seconds, results = try_tasks(name, n, METHODS[method])
            yardstick = seconds if name == UNIFORM else yardstick
            worst = max(worst, seconds / yardstick)
            figures = f"{1e3 * seconds:.0f} | {seconds / yardstick:.2f}"
            print(f"| {n} | {name} | {figures} |", " | ".join(results), "|", flush=True)
    print(f"\nat most {worst:.1f} times the time of uniform sets")
    sys.exit(worst > MOST)


@main.command()
@click.argument("seeds", type=int, default=PAIRS)
def kinds(seeds: int) -> None:
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
            elif errors(p, match.transform, truth).max() > np.ptp(p) / 10:
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


@main.command()
@click.argument("pairs", type=int, default=PAIRS)
def affine(pairs: int) -> None:
    """Measure how often the affine model finds a known map, and how often a false one.

    Points are random in a square; a share of them is replaced by others, and all are mapped by an
    affine map of a given anisotropy and jittered. Around a *patch* Q goes on: it has three times
    the area. A map is right where it takes every point of P to within half a mean spacing of its
    true place, along the direction that it stretches most. The independent pairs are of 5 to 120
    points. The exit status is 1 where one of them matches.
    """
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
                found, seconds = timed_match(p, q, model="affine")
                slowest = max(slowest, seconds)
                within = 0.5 * SPACING * math.sqrt(move.anisotropy)
                is_right = bool(errors(p, found, move).max() <= within)
                right += is_right
                wrong += found is not None and not is_right
            row.append(f"{right / pairs:.0%}")
        note = f" ({wrong} wrong)" if wrong else ""
        print(f"| {n} | {model} | {jitter:g}{note}", *row, "", sep=" | ", end="")
        print(f"{1e3 * slowest:.0f} |", flush=True)
    false, many = 0, pairs * INDEPENDENT_PER_PAIR
    with click.progressbar(range(many), file=sys.stderr, hidden=not sys.stderr.isatty()) as bar:
        for seed in bar:
            rng = np.random.default_rng(seed)
            p, q = (rng.uniform(0, 100, (int(size), 2)) for size in rng.integers(5, 121, 2))
            false += timed_match(p, q, model="affine", reflect=True)[0] is not None
    print(f"\n{false} of {many} independent pairs match, with their mirror images")
    sys.exit(false > 0)


if __name__ == "__main__":
    main()
