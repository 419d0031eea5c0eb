"""Local match, how similar the neighbourhoods of minutiae are; global match, how they are paired.

The global match yields pairs of minutiae, the mesh that they span, and the transform they fit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.pipeline._kernels import _alignment_kernel as kernel
from fpmatch.matching.pipeline._kernels._local_kernel import NeighbourIndex, normalize_by_size
from fpmatch.matching.pipeline.parameters import USUAL

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.pipeline.parameters import MatchParameters
    from fpmatch.matching.prints.prepared import Neighbourhoods

CELL_PX: Final = 20.0  # side of the cells in which neighbours are looked up
HALF: Final = 7  # such cells from the middle to each border; both set the time it takes, no more


def local_similarity(
    a: Neighbourhoods, b: Neighbourhoods, parameters: MatchParameters = USUAL
) -> NDArray[np.float32]:
    """Compare every neighbourhood of A, N of them, with every neighbourhood of B, M of them.

    Returns
    -------
    ndarray of float32, shape (N, M)
        Weighted share of neighbours that have a counterpart: 0 for none, about 1 for all.
    """
    p = parameters.local
    similarity = np.empty((len(a.count), len(b.count)), np.float32)
    index_neighbours(a, parameters).to_prints_after(
        b.count, b.frame, len(b.count), p.min_cosine, similarity
    )
    normalize_by_size(similarity, a.count, len(a.count), b.count, len(b.count), p.fewest_neighbours)
    return similarity


def index_neighbours(
    neighbourhoods: Neighbourhoods, parameters: MatchParameters = USUAL
) -> NeighbourIndex:
    """Sort the neighbours of one print's minutiae so that similar ones are found at once.

    The prints that it is compared with have the tolerances of the parameters.
    """
    turn = math.radians(parameters.local.neighbour_turn_deg)
    slack = 1.0 / (1.0 - parameters.neighbourhood.tolerance_per_px)
    of = neighbourhoods.count, neighbourhoods.frame
    cells = CELL_PX, HALF, turn, slack, of[1].shape[2]
    index: NeighbourIndex = NeighbourIndex(*of, *cells)
    return index


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """The alignment of print A, of N minutiae, with print B."""

    transform: NDArray[np.float64]  # (s·cos θ, s·sin θ, tx, ty) at 500 dpi with y pointing up
    partner: NDArray[np.int32]  # (N,): the partner in B, or -1; one-to-one
    weight: NDArray[np.float64]  # (N,): how well a pair fits, 0 to 1; 0 where there is none
    predicted: NDArray[np.float64]  # (4, N): the minutiae where the mesh of pairs maps them in B


def identity_alignment(a: NDArray[np.float64]) -> Alignment:
    """Return the alignment of a print, minutiae (4, N), with itself: each is its own partner."""
    n = a.shape[1]
    return Alignment(np.array([1.0, 0.0, 0.0, 0.0]), np.arange(n, dtype=np.int32), np.ones(n), a)


def make_aligner(size_a: int, size_b: int, parameters: MatchParameters = USUAL) -> kernel.Aligner:
    """Return an empty aligner for prints of up to so many minutiae, for one thread."""
    p = parameters
    return kernel.Aligner(size_a, size_b, p.alignment, p.relaxation, p.mesh)


def aligner_of(
    a: NDArray[np.float64], b: NDArray[np.float64], parameters: MatchParameters = USUAL
) -> kernel.Aligner:
    """Return an aligner that holds print A and print B, minutiae of shapes (4, N) and (4, M)."""
    aligner = make_aligner(a.shape[1], b.shape[1], parameters)
    aligner.load_a(a, a.shape[1])
    aligner.load_b(b, b.shape[1])
    return aligner


def kept_alignment(aligner: kernel.Aligner, row: int) -> Alignment:
    """Return the alignment that an aligner keeps in a row."""
    n = aligner.size_a
    alignment = Alignment(np.empty(4), np.empty(n, np.int32), np.empty(n), np.empty((4, n)))
    arrays = alignment.transform, alignment.partner, alignment.weight, alignment.predicted
    aligner.copy_kept(row, *arrays)
    return alignment


def hypotheses(
    aligner: kernel.Aligner, similarity: NDArray[np.float32], *, coarse: bool = False
) -> list[Alignment]:
    """Align the two prints that an aligner holds by each hypothesis of their local matches.

    `similarity` (N, M) is the local similarity of their minutiae. With `coarse`, the pairs do not
    grow to the end. The result has the alignments under which anything is paired, that of the
    strongest local match first.
    """
    aligner.relax(similarity)
    rows = range(aligner.hypotheses)
    pairs = [aligner.start_hypothesis(k) for k in rows]
    if not coarse:
        pairs = [aligner.refine(k) for k in rows]
    return [kept_alignment(aligner, k) for k in rows if pairs[k]]
