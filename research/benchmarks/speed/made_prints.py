"""Prepared prints that are made at random, and comparisons of all of them.

The prints are perturbed copies of a few: minutiae lost, added, moved and turned, so that none is
like another's copy by more than chance.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.pipeline import evidence as score
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from research.training.score_samples import NO_PREFILTER

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.matching.prints.prepared import PreparedTemplate

POINTS = 40
WIDTH, HEIGHT = 300, 350  # px, of which the print takes up an ellipse
SPACING_PX = 12.0
FIELD_STEP_PX = 16.0
SHARE_KEPT = 0.8  # of a finger's minutiae in any of its prints
PRINTS_OF_A_FINGER = 5
MOVE_PX, TURN_RAD = 3.0, 0.1


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
