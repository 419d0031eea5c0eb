"""Fixed numbers of comparisons: alignment, mesh of pairs, ridges, evidence."""

from __future__ import annotations

import math
from typing import Final

MIN_MINUTIAE: Final = 1  # the fewest that a print is compared by
LOG_10: Final = math.log(10.0)
SMALL_AREA_PX2: Final = 30_000.0  # up to which the smaller print is small: 77 mm²

# What stands for -ln(FMR) of prints that the prefilter rejects, below that of nearly all that are
# aligned, and what a unit of their shortfall takes off
REJECTED: Final = -5.0
SHORTFALL: Final = 0.25

# Relaxation and alignment
COINCIDENT: Final = 1e-6  # minutiae nearer than this coincide
DIRECTION_ARM2: Final = 900.0  # px²: directions count as positions do at 30 px from the middle
LEAST_SCALE: Final = 0.94
MOST_SCALE: Final = 1.06
FEWEST_FOR_SCALE: Final = 4
# Of the transform in pixels: fewer pairs do not determine its scale, and beyond this factor, which
# neither skin nor a wrong resolution reaches, the pairs are too close together.
MIN_PAIRS_FOR_SCALE: Final = 6
MAX_STRETCH: Final = 1.25

# Mesh of pairs
FRAME: Final = 8  # frame points: the first vertices
ROUNDING: Final = 1e-9  # px²: a minutia this near a circle lies on it
FAR_AWAY: Final = 1e6  # farther than any minutia
NEAR2: Final = 1e-3  # px²: keeps the weight of a coincident vertex finite

# Ridges. The samples of a cell are rows and columns: every other row, of which every fourth bit, by
# turns; where a print is small, also the others of every other bit, by turns.
BITS_ALONG: Final = 8  # of a cell
REACH: Final = 2  # bits by which ridges may lie off, along either axis
SHIFTS: Final = 2 * REACH + 1
FEWEST_AROUND: Final = 4  # cells of 3 by 3 that must be in both prints
MOST_CELLS: Final = 16_384  # of a print area with its border; of larger ones none are compared
FEW_SAMPLES: Final = ((1, 1), (1, 5), (3, 3), (3, 7), (5, 1), (5, 5), (7, 3), (7, 7))
_EVERY_OTHER: Final = [(row, column) for row in range(8) for column in range(row % 2, 8, 2)]
SAMPLES: Final = (*FEW_SAMPLES, *(one for one in _EVERY_OTHER if one not in FEW_SAMPLES))
IMPOSTOR_RIDGES: Final = 0.27  # mean correlation of different fingers under their best transform
FLOW_SAMPLES: Final = 24  # cells whose orientation is compared in a search by ridges

# Evidence
LEAST_RELAXED: Final = 0.01  # added before the logarithm is taken
PAIR_AREA: Final = 75.0  # px²: within 12 px and 30° of a minutia
LEAST_SPREAD: Final = 0.5  # between the two quantiles
LEAST_MEAN_SQUARE: Final = 0.25  # of the qualities of a print's minutiae
# Beyond about these amounts, more evidence does not change the quantiles of impostor comparisons.
ENOUGH_MINUTIAE: Final = 12.0
ENOUGH_AREA: Final = 30_000.0
LEAST_AREA: Final = 256.0
UNIT_AREA: Final = 10_000.0

# Greatest decades of the FMR that pairs and ridges justify
DECADES_PER_PAIR: Final = 1.2
USUAL_CHANCE: Final = 3.0  # pairs expected by chance in two usual prints
DENSER: Final = 2.0  # with so many more, prints are dense
FULL_AGREEMENT: Final = 0.2  # ridge correlation above the usual: counts wholly
CELLS_PER_DECADE: Final = 12.0

# Decades of the FMR beyond chance under the best transform
AROUND2: Final = 3600.0  # px²: minutiae nearer than 60 px to a prediction,
BESIDE2: Final = 144.0  # and those within 12 px by their square distance,
LEAST_COSINE: Final = math.cos(math.radians(30.0))  # in about its direction, count
PER_AROUND: Final = 0.1255  # pairs within 12 px and 30° for what counts
PLACE2: Final = 25.0  # σ² of genuine pairs' distance from the prediction,
TURN2: Final = math.radians(10.0) ** 2  # and of their directions
DENSER_PLACE: Final = 3.0513  # of genuine pairs at a prediction, by chance 1;
DENSER_TURN: Final = 2.3937  # likewise of directions
FAR_SHARE: Final = 0.05  # of that by chance, which genuine pairs have too
LEAST_BY_CHANCE: Final = 0.05  # pairs
ALIGNED: Final = 0.115  # ridge correlation above the usual: counts from there on,
FULLY_ALIGNED: Final = 0.2  # wholly from so much more on
FULL_CELLS: Final = 24.0  # beyond these, a cell counts a quarter
FEW_TO_HOLD: Final = 20.0  # minutiae of the smaller print: the commonest arrangement
ENOUGH_TO_HOLD: Final = 28.0  # of so many is not more common
