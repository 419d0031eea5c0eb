"""Bounds of the evidence: the decades of the FMR that pairs and ridges justify at most."""

from __future__ import annotations

import math

from fpmatch.matching.constants.comparison import (
    ALIGNED,
    CELLS_PER_DECADE,
    DECADES_PER_PAIR,
    DENSER,
    FULL_AGREEMENT,
    FULL_CELLS,
    FULLY_ALIGNED,
    LEAST_BY_CHANCE,
    LEAST_MEAN_SQUARE,
    LOG_10,
    USUAL_CHANCE,
)


def most_decades(pairs: int, chance: float, ridges: float, cells: int) -> float:
    """Return the greatest -log10 of the FMR that so many pairs and cells of ridges justify.

    `chance` is the number of pairs expected by chance, `ridges` the ridge correlation less that of
    different fingers. Of dense minutiae many pairs agree under any transform.
    """
    decades = DECADES_PER_PAIR * max(pairs - 1.0, 0.0)
    if chance > USUAL_CHANCE:
        chance *= min((chance - USUAL_CHANCE) / DENSER, 1.0)
        decades = min(decades, poisson_decades(pairs, chance))
    return decades + min(max(ridges / FULL_AGREEMENT, 0.0), 1.0) * cells / CELLS_PER_DECADE


def decades_beyond_chance(
    pairs: int, by_chance: float, nearness: float, ridges: float, cells: int
) -> float:
    """Return about how many decades of the FMR pairs and ridges justify under the best transform.

    `by_chance` is the number of pairs expected of the minutiae around, `nearness` the decades by
    which the pairs lie nearer to their predictions, in place and direction, than those would;
    half of them count, since the mesh fits the pairs.
    """
    decades = poisson_decades(pairs, max(by_chance, LEAST_BY_CHANCE)) + 0.5 * nearness
    ridges = min(max((ridges - ALIGNED) / FULLY_ALIGNED, 0.0), 1.0)
    return decades + ridges * (cells - 0.75 * max(cells - FULL_CELLS, 0.0)) / CELLS_PER_DECADE


def poisson_decades(count: int, mean: float) -> float:
    """Return Chernoff's bound of -log10 of the probability of `count` or more Poisson events."""
    if mean <= 0.0:
        return math.inf
    return (count * math.log(count / mean) - count + mean) / LOG_10 if count > mean else 0.0


def quality_correction(squares: float, minutiae: int) -> float:
    """Return the factor that raises poor qualities, given their sum of squares, to usual ones."""
    least = LEAST_MEAN_SQUARE * minutiae
    return least / squares if 0.0 < squares < least else 1.0
