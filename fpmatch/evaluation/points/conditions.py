"""The conditions of the experiment on random point sets, and the pairs of sets tried under them.

A condition is one column of one row of the paper's tables under one model of where P's partners
lie; 13 rows of three columns make 39 a model. Each trial has a seed of its own, made of the seed of
the experiment, the model, the row, the column and the number of the trial, so that it does not
depend on the other conditions and the matchers that run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fpmatch.evaluation.points.published_results import PAPER_ROWS, TARGET_FACTORS
from fpmatch.pointset.random_sets import POINT_MODELS, independent_pair, random_pair

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.points.published_results import PaperRow
    from fpmatch.pointset.random_sets import PointModel, RandomPair


class Condition(NamedTuple):
    """One column of one row of the paper's tables, under one model of where P's partners lie."""

    model: PointModel
    row: int  # index into `PAPER_ROWS`
    factor: int  # points of Q for each point of P

    @property
    def parameters(self) -> PaperRow:
        """The row itself."""
        return PAPER_ROWS[self.row]

    @property
    def m(self) -> int:
        """Points of P."""
        return self.parameters.m

    @property
    def n(self) -> int:
        """Points of Q."""
        return self.m * self.factor

    def is_harder_than(self, other: Condition) -> bool:
        """Return whether this condition differs from the other in larger sets only."""
        same = (self.model, self.parameters.setting) == (other.model, other.parameters.setting)
        return same and self.m >= other.m and self.n >= other.n and self != other

    def __str__(self) -> str:
        row = self.parameters
        return f"{self.model}, rho {row.rho:g}, m {self.m}, n {self.n}"


def conditions(
    models: Sequence[PointModel] = POINT_MODELS, largest_m: int | None = None
) -> list[Condition]:
    """Return the conditions of these models in the order of the tables, 39 a model.

    Rows of more than `largest_m` points of P are left out.
    """
    return [
        Condition(model, row, factor)
        for model in models
        for row, parameters in enumerate(PAPER_ROWS)
        if largest_m is None or parameters.m <= largest_m
        for factor in TARGET_FACTORS
    ]


def make_pair(condition: Condition, seed: int, trial: int, *, genuine: bool) -> RandomPair:
    """Return the sets and the truth of trial number `trial`, from 0, of an experiment's `seed`."""
    model, kind = condition.model, 0 if genuine else 1
    key = (POINT_MODELS.index(model), condition.row, condition.factor, trial, kind)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    sizes, row = (condition.m, condition.n), condition.parameters
    if genuine:
        return random_pair(*sizes, *row.setting, model=model, rng=rng)
    return independent_pair(*sizes, row.lambda_, model=model, rng=rng)
