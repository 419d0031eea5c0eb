"""Fixed numbers of the default matcher: kernels and reference read them from here.

Those that are arguments of the matcher are in `fpmatch.matching.parameters`. Lengths are
in pixels at 500 dpi.
"""

from __future__ import annotations

import math
from importlib.util import find_spec
from typing import Final

import numpy as np

_KERNEL: Final = find_spec("fpmatch.matching.pipeline._kernels._pipeline_kernel")
COMPILED: Final = _KERNEL is not None and not str(_KERNEL.origin).endswith(".py")

# Prepared prints
ORIENTATIONS: Final = 255  # steps of ridge orientation in half a turn; one code is left

# Neighbourhoods
LEAST_WEIGHT: Final = 1e-9  # of all neighbours of a minutia together

# Bit descriptors. A word of a neighbour: its cell in the first grid; a bit that is set where this
# cell does not count; three bits for the step from there to the cell of the second grid; a bit that
# is set where that cell does not count. `_bits.pxd` has them for the C compiler, too.
NEIGHBOUR_WORDS: Final = 12  # of a minutia, for its neighbours
ORIENTATION_WORDS: Final = 12  # of a minutia, for the ridge orientation at places around it
MAX_ENCODED: Final = 64  # minutiae of a print; of more, the best by quality
TURNS: Final = 256  # steps of a minutia's direction in a turn
CELLS_ALONG: Final = 16  # of a grid, with the minutia in its middle
SECTORS: Final = 8  # of relative direction, in a turn
APART: Final = 0.25  # of a turn, where sectors begin: neighbours are rarely at right angles
CELL: Final = 0x07FF
NOT_FIRST: Final = 0x0800
NOT_SECOND: Final = 0x8000
NOWHERE: Final = 0x8800
STEPS: Final = 12  # bits to the right of the step
SECOND: Final = 4096  # where the second grid begins in the tables
ORIENTATION_BINS: Final = 24  # in half a turn
UNKNOWN_BIN: Final = 31  # the greatest word of an orientation: that of an unknown one
# A pair of minutiae that agrees in n words of neighbours and f of orientations weighs 3 n + f - 8.
OF_NEIGHBOUR: Final = 3
TOO_LITTLE: Final = 8
USUAL_ORIENTATIONS: Final = 6  # taken to agree where they are unknown
MOST_WEIGHT: Final = 18
# Places of ridge orientation in a minutia's own frame, (2, 12): 4 at 24 px, 8 at 42 px
_RADIUS: Final = np.repeat([24.0, 42.0], [4, 8])
_ANGLE: Final = np.radians(np.concatenate([45.0 + 90.0 * np.arange(4), 22.5 + 45.0 * np.arange(8)]))
FLOW_PLACES: Final = np.stack([_RADIUS * np.cos(_ANGLE), _RADIUS * np.sin(_ANGLE)])

# Comparisons
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
LEAST_SPREAD: Final = 0.5  # between the two quantiles
LEAST_MEAN_SQUARE: Final = 0.25  # of the qualities of a print's minutiae
# Beyond about these amounts, more evidence does not change the quantiles of impostor comparisons.
ENOUGH_MINUTIAE: Final = 12.0
ENOUGH_AREA: Final = 30_000.0
LEAST_AREA: Final = 256.0
UNIT_AREA: Final = 10_000.0

# Greatest decades of the FMR that pairs and ridges justify
DECADES_PER_PAIR: Final = 1.2
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
