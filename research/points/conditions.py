"""The conditions of the paper's experiment on random point sets, and the pairs tried under them.

A condition is one column of one row of the paper's tables under one model of where P's partners
lie; 13 rows of three columns make 39 a model. The rows hold the times that the paper published in
Tables 1 and 2: N. Choi, B.-G. Lee and J. J. Lee, "Point pattern matching algorithm using
unit-circle parametrization", section 4.2, seconds a match, on average, on a processor of 1.66 GHz.
Table 1 is the algorithm of van Wamelen, Li and Iyengar (2004), Table 2 the paper's own. The paper
does not say how often either of them was right.

Each trial has a seed of its own, made of the seed of the experiment, the model, the row, the column
and the number of the trial, so that it does not depend on the other conditions and the matchers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from research.points.random_sets import POINT_MODELS, independent_pair, random_pair

if TYPE_CHECKING:
    from collections.abc import Sequence

    from research.points.random_sets import PointModel, RandomPair


TARGET_FACTORS: Final = (2, 4, 8)
"""Points of Q for each point of P, in the order of the tables' columns."""


class PaperRow(NamedTuple):
    """One row of the paper's two tables."""

    m: int  # points of P; Q has 2, 4 and 8 times as many
    rho: float  # share of P that has a partner in Q, and that a match must reach
    eta: float  # radius of the jitter, in mean nearest-neighbour distances of Q
    lambda_: float  # matching distance, in the same unit
    van_wamelen_s: tuple[float, float, float]  # seconds in Table 1 for n = 2m, 4m and 8m
    unit_circle_s: tuple[float, float, float]  # the same in Table 2

    @property
    def setting(self) -> tuple[float, float, float]:
        """ρ, η and λ."""
        return self.rho, self.eta, self.lambda_


PAPER_ROWS: Final = (
    PaperRow(50, 0.95, 0.175, 0.428, (0.02, 0.053, 0.089), (0.00062, 0.00116, 0.00202)),
    PaperRow(100, 0.95, 0.175, 0.428, (0.051, 0.099, 0.23), (0.00117, 0.00216, 0.00347)),
    PaperRow(200, 0.95, 0.175, 0.428, (0.13, 0.257, 0.518), (0.0024, 0.00346, 0.00618)),
    PaperRow(400, 0.95, 0.175, 0.428, (0.347, 0.704, 1.401), (0.00367, 0.00611, 0.01209)),
    PaperRow(800, 0.95, 0.175, 0.428, (0.759, 1.596, 3.802), (0.00639, 0.0121, 0.02381)),
    PaperRow(50, 0.6, 0.25, 0.61, (0.504, 1.065, 2.852), (0.00058, 0.00121, 0.00219)),
    PaperRow(100, 0.6, 0.25, 0.61, (1.208, 2.102, 4.479), (0.00122, 0.00218, 0.00356)),
    PaperRow(200, 0.6, 0.25, 0.61, (2.854, 6.612, 11.853), (0.00194, 0.00346, 0.00626)),
    PaperRow(400, 0.6, 0.25, 0.61, (8.257, 17.007, 34.475), (0.00356, 0.00636, 0.01211)),
    PaperRow(50, 0.9, 0.4, 0.84, (0.138, 0.322, 0.613), (0.0006, 0.00115, 0.00214)),
    PaperRow(100, 0.9, 0.4, 0.84, (0.282, 0.607, 1.614), (0.0012, 0.00216, 0.00332)),
    PaperRow(200, 0.9, 0.4, 0.84, (0.797, 1.495, 3.61), (0.00218, 0.00349, 0.00648)),
    PaperRow(400, 0.9, 0.4, 0.84, (3.001, 5.862, 11.491), (0.00326, 0.00652, 0.01207)),
)
"""The 13 rows, in the order of the tables."""


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
    """Return the conditions of these models in the order of the tables, 39 a model."""
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
