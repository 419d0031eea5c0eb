#!/usr/bin/env python3
"""Time the default matcher's comparison of one print with many, on one core.

    .venv/bin/python research/benchmarks/one_to_many.py [--most 100000]

The prints are perturbed copies of a few that are made at random: minutiae lost, added, moved and
turned, so that none is like another's copy by more than chance. Printed are, for 1,000, 10,000 and
100,000 of them (or as many as `--most` allows), comparisons a second, the processor time of one
comparison over that of ``scipy.spatial.Delaunay`` on 40 points, measured in turn with it, bytes a
print, and seconds to save, to map again and to check. The exit status is 1 where a print takes more
than 8,192 bytes, where a comparison takes more than half as long as a triangulation, or where its
time grows by more than a third from the fewest prints to the most.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import repository  # noqa: F401
from scipy.spatial import Delaunay

from fpmatch.array_file import read_arrays, write_arrays
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.packed_templates import COLUMNS, PackedTemplates
from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline._kernels._alignment_kernel import COMPILED
from fpmatch.minutiae import Minutiae, Template
from fpmatch.ridge_field import RidgeField
from research.training.score_samples import NO_PREFILTER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from fpmatch.matching.prepare import PreparedTemplate

COUNTS = (1_000, 10_000, 100_000)
POINTS = 40
WIDTH, HEIGHT = 300, 350  # px, of which the print takes up an ellipse
SPACING_PX = 12.0
FIELD_STEP_PX = 16.0
PREPARED = 1_000  # prints that are prepared; of more, each stands for several
SHARE_KEPT = 0.8  # of a finger's minutiae in any of its prints
PRINTS_OF_A_FINGER = 5
MOVE_PX, TURN_RAD = 3.0, 0.1
PROBES = 5
ROUNDS = 9

MAX_BYTES = 8192
MAX_RATIO = 0.5
MAX_GROWTH = 4 / 3


@contextmanager
def without_prefilter() -> Iterator[None]:
    """Align all prints, whatever the score of their bit descriptors."""
    usual = score.load_weights
    models = tuple(replace(model, prefilter=NO_PREFILTER) for model in usual().models)
    every = replace(usual(), models=models)
    score.load_weights = lambda: every
    try:
        yield
    finally:
        score.load_weights = usual


def spread(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return n places in an ellipse, not too near to one another, shape (n, 2)."""
    middle = np.array([WIDTH, HEIGHT]) / 2
    kept = np.empty((0, 2))
    while len(kept) < n:
        place = rng.uniform(0, 1, 2) * (WIDTH, HEIGHT)
        inside = (((place - middle) / (middle - SPACING_PX)) ** 2).sum() < 1
        if inside and not (np.hypot(*(kept - place).T) < SPACING_PX).any():
            kept = np.vstack([kept, place])
    return kept


def ridge_field(rng: np.random.Generator) -> RidgeField:
    """Return arched ridges over an ellipse; their picture is noise, which costs the same."""
    columns, rows = int(WIDTH // FIELD_STEP_PX), int(HEIGHT // FIELD_STEP_PX)
    y, x = np.mgrid[:rows, :columns] + 0.5
    mask = (2 * x / columns - 1) ** 2 + (2 * y / rows - 1) ** 2 < 1
    bend = rng.uniform(-1, 1) * (x / columns - rng.uniform(0.3, 0.7)) * y / rows
    ridges = rng.integers(0, 2**64, mask.shape, np.uint64)
    return RidgeField(FIELD_STEP_PX, np.mod(np.pi * bend, np.pi), mask, ridges)


def prints(rng: np.random.Generator, count: int) -> list[PreparedTemplate]:
    """Return prepared prints of 40 minutiae, a few of each finger."""
    made = []
    for _ in range(-(-count // PRINTS_OF_A_FINGER)):
        places, angle, field = spread(rng, POINTS), rng.uniform(0, 2 * np.pi, POINTS), None
        for _ in range(PRINTS_OF_A_FINGER):
            lost = rng.random(POINTS) > SHARE_KEPT
            xy = np.where(lost[:, None], spread(rng, POINTS), places)
            xy = xy + rng.normal(0, MOVE_PX, xy.shape)
            turned = np.where(lost, rng.uniform(0, 2 * np.pi, POINTS), angle)
            turned = turned + rng.normal(0, TURN_RAD, POINTS)
            quality = rng.integers(20, 100, POINTS)
            field = field or ridge_field(rng)
            minutiae = Minutiae(*xy.T, turned, quality=quality)
            made.append(MATCHER.prepare(Template(minutiae, WIDTH, HEIGHT, field=field)))
    return made[:count]


def seconds(function: Callable[[], object]) -> float:
    """Return the processor time of one call."""
    start = time.process_time()
    function()
    return time.process_time() - start


def repeated(few: PackedTemplates, count: int) -> PackedTemplates:
    """Return so many prints, those of `few` again and again."""
    return PackedTemplates.concatenate([few] * (count // len(few)))


def file_seconds(many: PackedTemplates) -> tuple[float, float]:
    """Return the seconds that it takes to save prints, and to map and check them."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "prints")
        start = time.perf_counter()
        write_arrays(path, many.arrays(), COLUMNS, {})
        saved = time.perf_counter()
        PackedTemplates.of_arrays(read_arrays(path, COLUMNS, {}))
        return saved - start, time.perf_counter() - saved


def main() -> int:
    """Run the script; return its exit status."""
    parser = argparse.ArgumentParser(description="Time one print compared with many.")
    parser.add_argument("--most", type=int, default=COUNTS[-1], help="prints, at most")
    most = parser.parse_args().most
    rng = np.random.default_rng(40)
    print(f"kernels {'compiled' if COMPILED else 'interpreted'}")
    made = prints(rng, PREPARED)
    few = PackedTemplates.pack(made)
    probes = made[:: PREPARED // PROBES]
    clouds = [rng.random((POINTS, 2)) for _ in range(200)]
    print(
        f"{'prints':>8}{'a second':>10}{'us':>8}{'/ Delaunay':>12}{'bytes':>8}{'save s':>8}"
        f"{'load s':>8}"
    )
    ratio, size = {}, 0.0
    for count in [c for c in COUNTS if c <= most]:
        many = repeated(few, count)
        size = many.nbytes / count
        # as long a look at the largest set as at the others: parts of it, spread over the whole
        parts = range(0, count, max(PREPARED, count // 10))
        ours, scipys = [], []
        for k in range(ROUNDS):
            probe = probes[k % PROBES]
            for first in parts:
                last = first + PREPARED
                ours.append(seconds(partial(MATCHER.similarities, probe, many, first, last)))
                scipys.append(seconds(lambda: [Delaunay(points) for points in clouds]))
        each, cloud = min(ours) / PREPARED, min(scipys) / len(clouds)
        ratio[count] = np.median(ours) / PREPARED / (np.median(scipys) / len(clouds))
        save, load = file_seconds(many)
        print(
            f"{count:8}{1 / each:10.0f}{each * 1e6:8.1f}{ratio[count]:12.2f}{size:8.0f}"
            f"{save:8.2f}{load:8.2f}"
        )
        print(f"{'':8}(a triangulation: {cloud * 1e6:.1f} us)")
    growth = ratio[max(ratio)] / ratio[min(ratio)]
    print(f"bytes a print: {size:.0f} (at most {MAX_BYTES})")
    print(f"most of a triangulation: {max(ratio.values()):.2f} (at most {MAX_RATIO})")
    print(
        f"growth from {min(ratio)} to {max(ratio)} prints: {growth:.2f} (at most {MAX_GROWTH:.2f})"
    )
    return int(size > MAX_BYTES or max(ratio.values()) > MAX_RATIO or growth > MAX_GROWTH)


if __name__ == "__main__":
    sys.exit(main())
