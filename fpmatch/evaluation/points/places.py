"""The places of the experiment on random point sets, and the pairs of sets that are tried there.

A place is one column of one row of the paper's tables under one reading; 13 rows of three columns
make 39 a reading. Each trial of a place has a seed of its own, made of the seed of the experiment,
the reading, the row, the column and the number of the trial, so that it is the same whichever
matchers and places run besides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.points.published_results import PAPER_ROWS, TARGET_FACTORS
from fpmatch.pointset.random_sets import READINGS, independent_pair, random_pair

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.points.published_results import PaperRow
    from fpmatch.pointset.random_sets import PointModel, RandomPair

_GENUINE: Final = 0
_INDEPENDENT: Final = 1


@dataclass(frozen=True, slots=True)
class Place:
    """Hold one column of one row of the paper's tables, under one reading.

    Parameters
    ----------
    reading : {"patch", "clutter"}
        The reading.
    row : int
        Index into `PAPER_ROWS`.
    factor : int
        Points of Q for each point of P.
    """

    reading: PointModel
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

    def is_harder_than(self, other: Place) -> bool:
        """Tell whether this place differs from the other in larger sets only."""
        mine, others = self.parameters, other.parameters
        alike = (self.reading, mine.rho, mine.eta, mine.lambda_) == (
            *(other.reading, others.rho, others.eta, others.lambda_),
        )
        larger = self.m >= other.m and self.n >= other.n
        return alike and larger and self != other

    def __str__(self) -> str:
        row = self.parameters
        return f"{self.reading}, rho {row.rho:g}, m {self.m}, n {self.n}"


def places(readings: Sequence[PointModel] = READINGS, largest_m: int | None = None) -> list[Place]:
    """Return the places of the tables, in their order.

    Parameters
    ----------
    readings : sequence of str
        The readings.
    largest_m : int, optional
        Leaves out rows with more points of P.

    Returns
    -------
    list of Place
        39 a reading where no row is left out.

    Examples
    --------
    >>> len(places()), str(places(["clutter"])[1])
    (78, 'clutter, rho 0.95, m 50, n 200')
    """
    return [
        Place(reading, row, factor)
        for reading in readings
        for row, parameters in enumerate(PAPER_ROWS)
        if largest_m is None or parameters.m <= largest_m
        for factor in TARGET_FACTORS
    ]


def make_pair(place: Place, seed: int, trial: int, *, genuine: bool) -> RandomPair:
    """Return the pair of sets of one trial.

    Parameters
    ----------
    place : Place
        Where in the tables.
    seed : int
        Seed of the experiment.
    trial : int
        Number of the trial, from 0.
    genuine : bool
        Whether the sets have points in common.

    Returns
    -------
    RandomPair
        The sets and the truth.

    Examples
    --------
    >>> pair = make_pair(Place("patch", 0, 2), seed=0, trial=3, genuine=True)
    >>> pair.p.shape, pair.q.shape, len(pair.pairs)
    ((50, 2), (100, 2), 48)
    """
    row, kind = place.parameters, _GENUINE if genuine else _INDEPENDENT
    key = (READINGS.index(place.reading), place.row, place.factor, trial, kind)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    if not genuine:
        return independent_pair(place.m, place.n, row.lambda_, reading=place.reading, rng=rng)
    return random_pair(
        place.m, place.n, row.rho, row.eta, row.lambda_, reading=place.reading, rng=rng
    )
