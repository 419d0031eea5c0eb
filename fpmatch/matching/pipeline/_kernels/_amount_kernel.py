# mypy: ignore-errors
"""Kernel: the amount of evidence in a comparison, and the bound that it sets for the FMR."""

import cython
from cython.cimports.libc.math import exp, log, log1p, sqrt

from fpmatch.matching.constants import comparison

LOG_10 = cython.declare(cython.double, comparison.LOG_10)
ENOUGH_MINUTIAE = cython.declare(cython.double, comparison.ENOUGH_MINUTIAE)
ENOUGH_AREA = cython.declare(cython.double, comparison.ENOUGH_AREA)
LEAST_AREA = cython.declare(cython.double, comparison.LEAST_AREA)
UNIT_AREA = cython.declare(cython.double, comparison.UNIT_AREA)
DECADES_PER_PAIR = cython.declare(cython.double, comparison.DECADES_PER_PAIR)
USUAL_CHANCE = cython.declare(cython.double, comparison.USUAL_CHANCE)
DENSER = cython.declare(cython.double, comparison.DENSER)
FULL_AGREEMENT = cython.declare(cython.double, comparison.FULL_AGREEMENT)
CELLS_PER_DECADE = cython.declare(cython.double, comparison.CELLS_PER_DECADE)
LEAST_BY_CHANCE = cython.declare(cython.double, comparison.LEAST_BY_CHANCE)
ALIGNED = cython.declare(cython.double, comparison.ALIGNED)
FULLY_ALIGNED = cython.declare(cython.double, comparison.FULLY_ALIGNED)
FULL_CELLS = cython.declare(cython.double, comparison.FULL_CELLS)
LEAST_MEAN_SQUARE = cython.declare(cython.double, comparison.LEAST_MEAN_SQUARE)


def smaller_area(a, b):
    """Return the area of the smaller of two prints, in square pixels at 500 dpi."""
    return min(a.inside * (a.step * a.step), b.inside * (b.step * b.step))


@cython.locals(columns=cython.double, rows=cython.double)
def common_cells(a, b, c, s, x, y):
    """Return how many cells of A fall into the region of B."""
    place = a.cell_at
    # of cells of B: a step of A to the right, and the middle of the first cell of a row
    right = c * a.step * b.per_px
    down = s * a.step * b.per_px
    columns, rows = b.columns, b.rows
    cells: cython.int = 0
    for row in range(a.rows):
        first_x = x * b.per_px + right * (a.first_column + 0.5) - b.first_column
        first_x += down * (a.first_row + row + 0.5)
        first_y = right * (a.first_row + row + 0.5) - b.first_row
        first_y -= y * b.per_px + down * (a.first_column + 0.5)
        for column in range(a.columns):
            if a.cell[place] != 0:
                bx = first_x + column * right
                by = first_y - column * down
                if 0.0 <= bx < columns and 0.0 <= by < rows:
                    at_row: cython.Py_ssize_t = int(by)
                    at_column: cython.Py_ssize_t = int(bx)
                    cells += b.cell[b.cell_at + at_row * b.columns + at_column] != 0
            place += 1
    return cells


def describe_amount(minutiae, area, term):
    """Fill the terms of an amount of evidence; see `fpmatch.matching.pipeline.evidence`."""
    x = 1.0 / (saturated(minutiae, ENOUGH_MINUTIAE) + 1.0)
    y = log(max(saturated(area, ENOUGH_AREA), LEAST_AREA) / UNIT_AREA)
    term[0], term[1], term[2], term[3], term[4] = 1.0, x, x * x, y, x * y
    return 0


def most_decades(pairs, chance, ridges, cells):
    """Return the greatest -log10 of the FMR that so many pairs and cells of ridges justify.

    `chance` is the number of pairs expected by chance, `ridges` the ridge correlation less that of
    different fingers. A search finds the commonest arrangement of a few minutiae, which matches
    more prints than one drawn by chance: each pair after the first counts 1.2 decades. Of dense
    minutiae many pairs agree under any transform: there, a Poisson distribution bounds the FMR.
    """
    decades = DECADES_PER_PAIR * max(pairs - 1.0, 0.0)
    if chance > USUAL_CHANCE:
        chance *= min((chance - USUAL_CHANCE) / DENSER, 1.0)
        decades = min(decades, poisson_decades(pairs, chance))
    ridges = min(max(ridges / FULL_AGREEMENT, 0.0), 1.0)
    return decades + ridges * cells / CELLS_PER_DECADE


def decades_beyond_chance(pairs, by_chance, nearness, ridges, cells):
    """Return about how many decades of the FMR pairs and ridges justify under the best transform.

    `by_chance` is the number of pairs expected of the minutiae around, `nearness` the decades by
    which the pairs lie nearer to their predictions, in place and direction, than those would;
    half of them count, since the mesh fits the pairs. `ridges` is the ridge correlation less that
    of different fingers.
    """
    decades = poisson_decades(pairs, max(by_chance, LEAST_BY_CHANCE)) + 0.5 * nearness
    ridges = min(max((ridges - ALIGNED) / FULLY_ALIGNED, 0.0), 1.0)
    return decades + ridges * (cells - 0.75 * max(cells - FULL_CELLS, 0.0)) / CELLS_PER_DECADE


def poisson_decades(count, mean):
    """Return Chernoff's bound of -log10 of the probability of `count` or more Poisson events."""
    if mean <= 0.0:
        return 1e9
    if count <= mean:
        return 0.0
    return (count * log(count / mean) - count + mean) / LOG_10


def quality_correction(squares, minutiae):
    """Return the factor that raises poor qualities, given their sum of squares, to usual ones."""
    least = LEAST_MEAN_SQUARE * minutiae
    return least / squares if 0.0 < squares < least else 1.0


def saturated(amount, enough):
    """Return about the amount where it is much less than `enough`, else about `enough`."""
    share = amount / enough
    share = share * share
    return amount / sqrt(sqrt(1.0 + share * share))


def as_similarity(total):
    """Return ``log(1 + e^total)``: positive, and for more than a few the sum itself."""
    if total > 0.0:
        return total + log1p(exp(-total))
    return log1p(exp(total))
