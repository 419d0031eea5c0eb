"""Global match: the pairs of two prints, the mesh that they span, and the transform they fit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching import _align_kernel as kernel
from fpmatch.matching.pair_mesh import PairMeshParameters
from fpmatch.matching.relaxation import RelaxationParameters

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class AlignmentParameters:
    """Set the global match; lengths in pixels at 500 dpi.

    Parameters
    ----------
    max_turn_deg : float
        Largest difference in direction within a pair.
    hypotheses : int
        Hypotheses of the relaxed local matches that are aligned, at most.
    coarse_rounds, rounds : int
        Rounds in which the mesh of pairs grows: in coarse alignment, and in all.
    reach_px, reach_per_px, reach_limit_px : float
        How far from its prediction a minutia may lie to be paired: beside another pair, its growth
        with the distance from the nearest other pair, and its limit.
    """

    max_turn_deg: float = 30.0
    hypotheses: int = 4
    coarse_rounds: int = 1
    rounds: int = 3
    reach_px: float = 10.0
    reach_per_px: float = 0.12
    reach_limit_px: float = 24.0

    @property
    def min_cosine(self) -> float:
        """Cosine of the largest difference in direction."""
        return math.cos(math.radians(self.max_turn_deg))


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Hold the alignment of print A with print B; minutiae are columns (x, y up, direction c, s).

    Parameters
    ----------
    transform : ndarray of float64, shape (4,)
        (s·cos θ, s·sin θ, tx, ty) at 500 dpi with y pointing up.
    partner : ndarray of int32, shape (N,)
        For each minutia of A its partner in B, or -1; one-to-one.
    weight : ndarray of float64, shape (N,)
        How well a pair fits, 0 to 1; 0 where there is none.
    predicted : ndarray of float64, shape (4, N)
        The minutiae of A where the mesh of pairs maps them in B.
    """

    transform: NDArray[np.float64]
    partner: NDArray[np.int32]
    weight: NDArray[np.float64]
    predicted: NDArray[np.float64]


def identity_alignment(a: NDArray[np.float64]) -> Alignment:
    """Return the alignment of a print, minutiae (4, N), with itself: each is its own partner."""
    n = a.shape[1]
    return Alignment(np.array([1.0, 0.0, 0.0, 0.0]), np.arange(n, dtype=np.int32), np.ones(n), a)


def make_aligner(
    size_a: int, size_b: int, parameters: AlignmentParameters | None = None
) -> kernel.Aligner:
    """Return an aligner for prints of up to so many minutiae, for one thread.

    Parameters
    ----------
    size_a, size_b : int
        Most minutiae of print A and of print B.
    parameters : AlignmentParameters, optional
        Hypotheses, rounds and reach.

    Returns
    -------
    Aligner
        Empty: `load_a` and `load_b` give it two prints.
    """
    return kernel.Aligner(
        size_a,
        size_b,
        parameters or AlignmentParameters(),
        RelaxationParameters(),
        PairMeshParameters(),
    )


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


def best_alignment(aligner: kernel.Aligner) -> Alignment:
    """Return the alignment that an aligner has saved as the best."""
    n = aligner.size_a
    found = Alignment(np.empty(4), np.empty(n, np.int32), np.empty(n), np.empty((4, n)))
    aligner.copy_best(found.transform, found.partner, found.weight, found.predicted)
    return found


def alignments(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    similarity: NDArray[np.float32],
    parameters: AlignmentParameters | None = None,
    *,
    coarse: bool = False,
) -> list[Alignment]:
    """Align print A with print B by each hypothesis of their relaxed local matches.

    Parameters
    ----------
    a, b : ndarray of float64, shapes (4, N) and (4, M)
        x and y in pixels at 500 dpi, y pointing up, and the unit vector of the direction.
    similarity : ndarray of float32, shape (N, M)
        Local similarity of their minutiae.
    parameters : AlignmentParameters, optional
        Hypotheses, rounds and reach.
    coarse : bool
        Whether to stop after coarse alignment.

    Returns
    -------
    list of Alignment
        Those under which anything is paired; that of the strongest local match first.
    """
    return hypotheses(aligner_of(a, b, parameters), similarity, coarse=coarse)


def hypotheses(
    aligner: kernel.Aligner, similarity: NDArray[np.float32], *, coarse: bool = False
) -> list[Alignment]:
    """Return what `alignments` does, of the two prints that an aligner holds."""
    aligner.relax(similarity)
    found = []
    for k in range(aligner.hypotheses):
        pairs = aligner.start_hypothesis(k)
        if coarse and pairs and aligner.save_best():
            found.append(best_alignment(aligner))
    for k in range(0 if coarse else aligner.hypotheses):
        if aligner.refine(k) and aligner.save_best():
            found.append(best_alignment(aligner))
    return found
