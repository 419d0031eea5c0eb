"""The conditions of the experiment on random point sets, and the pairs of sets tried under them.

A condition is one column of one row of the paper's tables under one model of where P's partners
lie; 13 rows of three columns make 39 a model. Each trial has a seed of its own, made of the seed of
the experiment, the model, the row, the column and the number of the trial, so that it does not
depend on the other conditions and the matchers that run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.points.published_results import PAPER_ROWS, TARGET_FACTORS
from fpmatch.pointset.random_sets import POINT_MODELS, independent_pair, random_pair

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.points.published_results import PaperRow
    from fpmatch.pointset.random_sets import PointModel, RandomPair

_GENUINE: Final = 0
_INDEPENDENT: Final = 1


@dataclass(frozen=True, slots=True)
class Condition:
    """Hold one column of one row of the paper's tables, under one model.

    Parameters
    ----------
    model : {"patch", "clutter"}
        Where P's partners lie in Q; see `fpmatch.pointset.random_sets`.
    row : int
        Index into `PAPER_ROWS`.
    factor : int
        Points of Q for each point of P.
    """

    model: PointModel
    row: int
    factor: int

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
        mine, others = self.parameters, other.parameters
        same = (self.model, mine.rho, mine.eta, mine.lambda_) == (
            *(other.model, others.rho, others.eta, others.lambda_),
        )
        larger = self.m >= other.m and self.n >= other.n
        return same and larger and self != other

    def __str__(self) -> str:
        row = self.parameters
        return f"{self.model}, rho {row.rho:g}, m {self.m}, n {self.n}"


def conditions(
    models: Sequence[PointModel] = POINT_MODELS, largest_m: int | None = None
) -> list[Condition]:
    """Return the conditions of these models in the order of the tables, 39 a model.

    Rows of more than `largest_m` points of P are left out.

    Examples
    --------
    >>> len(conditions()), str(conditions(["clutter"])[1])
    (78, 'clutter, rho 0.95, m 50, n 200')
    """
    return [
        Condition(model, row, factor)
        for model in models
        for row, parameters in enumerate(PAPER_ROWS)
        if largest_m is None or parameters.m <= largest_m
        for factor in TARGET_FACTORS
    ]


def make_pair(condition: Condition, seed: int, trial: int, *, genuine: bool) -> RandomPair:
    """Return the sets and the truth of trial number `trial`, from 0.

    Parameters
    ----------
    condition : Condition
        Where in the tables.
    seed, trial : int
        Seed of the experiment, number of the trial.
    genuine : bool
        Whether the sets have points in common.

    Examples
    --------
    >>> pair = make_pair(Condition("patch", 0, 2), seed=0, trial=3, genuine=True)
    >>> pair.p.shape, pair.q.shape, len(pair.pairs)
    ((50, 2), (100, 2), 48)
    """
    row, kind = condition.parameters, _GENUINE if genuine else _INDEPENDENT
    key = (POINT_MODELS.index(condition.model), condition.row, condition.factor, trial, kind)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    if not genuine:
        return independent_pair(
            condition.m, condition.n, row.lambda_, model=condition.model, rng=rng
        )
    return random_pair(
        condition.m, condition.n, row.rho, row.eta, row.lambda_, model=condition.model, rng=rng
    )
