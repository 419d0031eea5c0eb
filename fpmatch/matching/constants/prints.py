"""Fixed numbers of prepared prints: areas, neighbourhoods, bit descriptors."""

from __future__ import annotations

from typing import Final

import numpy as np

ORIENTATIONS: Final = 255  # steps of ridge orientation in half a turn; one code is left

# Neighbourhoods
LEAST_WEIGHT: Final = 1e-9  # of all neighbours of a minutia together

# Bit descriptors. A word of a neighbour: its cell in the first grid; a bit that is set where this
# cell does not count; three bits for the step from there to the cell of the second grid; a bit that
# is set where that cell does not count. `_bits.pxd` has them for the C compiler, too.
NEIGHBOUR_WORDS: Final = 12  # of a minutia, for its neighbours
ORIENTATION_WORDS: Final = 12  # of a minutia, for the ridge orientation at places around it
MAX_ENCODED: Final = 64  # minutiae of a print; of more, those of best quality
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
