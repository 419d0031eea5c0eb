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
from fpmatch.matching.prints.neighbourhood import NeighbourhoodParameters

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.neighbourhood import Neighbourhoods

CELL_PX: Final = 20.0  # side of the cells in which neighbours are looked up
HALF: Final = 7  # such cells from the middle to each border; both set the time it takes, no more

# Of the transform in pixels: fewer pairs do not determine its scale, and beyond this factor, which
# neither skin nor a wrong resolution reaches, the pairs are too close together.
MIN_PAIRS_FOR_SCALE: Final = 6
MAX_STRETCH: Final = 1.25


@dataclass(frozen=True, slots=True)
class LocalParameters:
    """Set the local match."""

    max_turn_deg: float = 30.0  # between the relative directions of a neighbour and its counterpart
    fewest_neighbours: int = 4  # fewer count as this many, so that few do not agree easily

    @property
    def min_cosine(self) -> float:
        """Cosine of the largest difference in direction."""
        return math.cos(math.radians(self.max_turn_deg))


def local_similarity(
    a: Neighbourhoods, b: Neighbourhoods, parameters: LocalParameters | None = None
) -> NDArray[np.float32]:
    """Compare every neighbourhood of A, N of them, with every neighbourhood of B, M of them.

    Returns
    -------
    ndarray of float32, shape (N, M)
        Weighted share of neighbours that have a counterpart: 0 for none, about 1 for all.
    """
    p = parameters or LocalParameters()
    similarity = np.empty((len(a.count), len(b.count)), np.float32)
    index_neighbours(a, p).to_prints_after(b.count, b.frame, len(b.count), p.min_cosine, similarity)
    normalize_by_size(similarity, a.count, len(a.count), b.count, len(b.count), p.fewest_neighbours)
    return similarity


def index_neighbours(
    neighbourhoods: Neighbourhoods, parameters: LocalParameters | None = None
) -> NeighbourIndex:
    """Sort the neighbours of one print's minutiae so that similar ones are found at once.

    The prints that it is compared with have the usual tolerances.
    """
    turn = math.radians((parameters or LocalParameters()).max_turn_deg)
    slack = 1.0 / (1.0 - NeighbourhoodParameters().tolerance_per_px)
    of = neighbourhoods.count, neighbourhoods.frame
    cells = CELL_PX, HALF, turn, slack, of[1].shape[2]
    index: NeighbourIndex = NeighbourIndex(*of, *cells)
    return index


@dataclass(frozen=True, slots=True)
class RelaxationParameters:
    """Set the relaxation of local matches (`_relaxation_kernel`); lengths in px at 500 dpi.

    Two candidates support each other if the distances between their minutiae differ by at most
    `distance_px` and `distance_per_px` of the distance in the two prints, as skin stretches. A
    candidate is the seed of a hypothesis, or one of its pairs, from a share of the relaxed
    similarity of the strongest candidate on.
    """

    candidates: int = 32  # local matches that take part, at most; each minutia is in one of them
    distance_px: float = 6.0
    distance_per_px: float = 0.08
    max_rotation_deg: float = 25.0  # between the rotations of two candidates
    max_angle_deg: float = 30.0  # between the directions from one minutia to the other
    rounds: int = 5
    inertia: float = 0.5  # share of its value that a candidate keeps in a round
    least_seed_share: float = 0.5
    least_share: float = 0.25

    @property
    def min_rotation_cosine(self) -> float:
        """Cosine of the largest difference of rotations."""
        return math.cos(math.radians(self.max_rotation_deg))

    @property
    def min_angle_cosine(self) -> float:
        """Cosine of the largest difference of directions."""
        return math.cos(math.radians(self.max_angle_deg))


@dataclass(frozen=True, slots=True)
class PairMeshParameters:
    """Set the mesh of pairs (`_pair_mesh_kernel`); lengths in px at 500 dpi.

    The standard deviation of the distance from the prediction is `residual_px`, and
    `residual_per_px` of the mean radius of the ring.
    """

    frame_margin_px: float = 60.0  # of the frame points from the circle round the bounding box
    place_tolerance: float = 0.3  # standard deviation of places on the unit circle, in radians
    residual_px: float = 3.0
    residual_per_px: float = 0.08


@dataclass(frozen=True, slots=True)
class AlignmentParameters:
    """Set the global match; lengths in px at 500 dpi.

    A minutia is paired within its reach of where it is predicted: `reach_px` beside another pair,
    growing by `reach_per_px` with the distance from the nearest other pair to `reach_limit_px`.
    """

    max_turn_deg: float = 30.0  # largest difference in direction within a pair
    hypotheses: int = 4  # of the relaxed local matches, aligned at most
    coarse_rounds: int = 1  # in which the mesh of pairs grows, in coarse alignment
    rounds: int = 3  # in all
    reach_px: float = 10.0
    reach_per_px: float = 0.12
    reach_limit_px: float = 24.0

    @property
    def min_cosine(self) -> float:
        """Cosine of the largest difference in direction."""
        return math.cos(math.radians(self.max_turn_deg))


@dataclass(frozen=True, slots=True)
class RidgeSearchParameters:
    """Set the search for alignments by the ridges (`_ridge_search_kernel`); px at 500 dpi.

    The agreement of the orientation is the mean cosine of twice the difference, -1 to 1.
    """

    compared: int = 64  # pairs of minutiae whose ridges are compared, of a small print; 1 to 128
    found: int = 4  # pairs by which a small print is aligned; 1 to 8
    candidates: int = 3  # local matches whose ridges are compared, of larger prints; 1 to 128
    candidate_flow: float = 0.9  # least agreement of their orientation
    candidate_value: float = 3.0  # least surplus of their correlation, times the root of the cells
    least_common: float = 0.25  # share of the smaller print that must lie in the larger
    least_flow: float = 0.8  # least agreement of the orientation, for a small print
    usual_correlation: float = 0.2  # of the ridges of different fingers
    apart_px: float = 12.0  # between the images of a print's middle under different transforms,
    apart_deg: float = 12.0  # or between their rotations

    @property
    def apart_cosine(self) -> float:
        """Cosine of `apart_deg`."""
        return math.cos(math.radians(self.apart_deg))


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


def make_aligner(
    size_a: int, size_b: int, parameters: AlignmentParameters | None = None
) -> kernel.Aligner:
    """Return an empty aligner for prints of up to so many minutiae, for one thread."""
    used = parameters or AlignmentParameters()
    return kernel.Aligner(size_a, size_b, used, RelaxationParameters(), PairMeshParameters())


def aligner_of(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    parameters: AlignmentParameters | None = None,
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
