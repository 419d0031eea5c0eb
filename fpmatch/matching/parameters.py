"""The parameters of the default matcher, and its other numbers, which are no arguments.

Kernels and reference read them from here: a change of one compiles nothing. Weights and thresholds
of the score are learned, see `fpmatch.matching.pipeline.evidence`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from fpmatch.base.parameters import Ranged, parameter


@dataclass(frozen=True, slots=True, eq=False)
class MatchParameters(Ranged):
    """All of them, in the order of the steps; compared by identity, which costs nothing.

    Those with a meaning and a range are arguments of the matcher. Lengths are in pixels at 500 dpi.

    Raises
    ------
    MatcherError
        If an argument is out of range.
    """

    # Preparation; without a ridge field, the cells of the minutiae's hull stand for the print
    max_minutiae: int = 200  # minutiae that take part; of more, the ones of best quality
    hull_step_px: float = 16.0  # side of a cell of the hull
    max_hull_cells: int = 512  # along a side; larger cells where the minutiae reach farther
    usual_quality: float = 0.7  # quality where a template gives none: all are 100, or all 0

    # Neighbourhoods of the minutiae, with the shape-preserving weights of eq. (4)
    neighbours: int = parameter(
        12, "neighbours of a minutia, nearest first, from its first and second ring", 1, 32
    )
    tolerance_px: float = 9.0  # how far a neighbour may lie from its counterpart
    tolerance_per_px: float = 0.08  # growth of this distance per px of the neighbour's distance
    second_ring_weight: float = 0.5  # beyond the one-ring, and the least in it; the mean is 1

    # Prefilter: bit descriptors of minutiae, and pairs of them that agree in one transform; two
    # pairs d apart agree within sqrt(near_px² + (near_per_px·d)²)
    cell_px: float = 16.0  # side of the cells in which neighbours lie
    most_pairs: int = 16  # pairs compared with each other: those that share most words
    near_px: float = 12.0  # distance within which two pairs agree
    near_per_px: float = 0.1  # growth of this distance per px between them, added as squares
    pair_turn_deg: float = 15.0  # largest difference of the rotations of two pairs

    # Local match of the neighbourhoods
    # largest difference in relative direction of a neighbour and its counterpart
    neighbour_cosine: float = math.cos(math.radians(30.0))
    fewest_neighbours: int = 4  # fewer count as this many, so that few do not agree easily

    # Relaxation of the local matches, the candidates. Two support each other if the distances
    # between their minutiae in the two prints differ by at most distance_px and distance_per_px of
    # the distance
    candidates: int = 32  # local matches that take part, at most; each minutia is in one of them
    distance_px: float = 6.0
    distance_per_px: float = 0.08
    # largest difference of the rotations of two, and of the directions from one to the other
    min_rotation_cosine: float = math.cos(math.radians(25.0))
    min_angle_cosine: float = math.cos(math.radians(30.0))
    relaxation_rounds: int = parameter(5, "rounds in which candidates support each other", 0, 100)
    inertia: float = 0.5  # share of its value that a candidate keeps in a round
    least_seed_share: float = 0.5  # least value of a seed, as a share of the strongest candidate's
    least_share: float = 0.25  # and of other pairs of a hypothesis, as a share of its seed's

    # Mesh of pairs, its unit circles and predictions, eq. (3) and (4)
    frame_margin_px: float = 60.0  # of the frame points from the circle round the bounding box
    place_tolerance: float = parameter(
        0.3, "standard deviation of places on the unit circle", 0.001, 10, "radians"
    )
    residual_px: float = 3.0  # standard deviation of the distance from the prediction
    residual_per_px: float = 0.08  # growth of it per px of the mean radius of the ring

    # Global match: pairs grow over their mesh; a minutia is paired within its reach of where it is
    # predicted
    min_cosine: float = math.cos(math.radians(30.0))  # directions in a pair differ less
    hypotheses: int = 4  # hypotheses of the relaxed local matches, at most
    coarse_rounds: int = 1  # rounds in which pairs grow over their mesh before they are weighed
    rounds: int = parameter(3, "rounds in which pairs grow over their mesh, in all", 1, 20)
    reach_px: float = parameter(
        10.0, "distance from its prediction within which a minutia is paired", 0.1, 100
    )
    reach_per_px: float = parameter(
        0.12, "growth of this distance per px to the nearest other pair", 0, 1
    )
    reach_limit_px: float = 24.0  # largest such distance

    # Search for alignments by the ridges; the agreement of the orientation is the mean cosine of
    # twice the difference, -1 to 1
    ridge_trials: int = 64  # pairs of minutiae whose ridges are compared, of a small print
    ridge_starts: int = 4  # pairs by which a small print is aligned
    ridge_candidates: int = 3  # local matches whose ridges are compared, of larger prints
    candidate_flow: float = 0.9  # least agreement of their orientation
    candidate_value: float = 3.0  # least surplus of their correlation, times the root of the cells
    least_common: float = 0.25  # share of the smaller print that must lie in the larger
    least_flow: float = 0.8  # least agreement of the orientation, for a small print
    usual_correlation: float = 0.2  # of the ridges of different fingers, in search and score
    apart_px: float = 12.0  # between a print's middles under transforms that count as two
    apart_cosine: float = math.cos(math.radians(12.0))  # or the difference of their rotations

    # Score: how evidence is turned into features
    # how far inside the other print a minutia lies that counts as unpaired; in the hull of the
    # minutiae anywhere, since a print reaches farther
    margin_px: float = 20.0
    doubt_pairs: float = 2.0  # added to the number of pairs, so that little evidence counts less
    doubt_minutiae: float = 5.0  # added to the number of minutiae
    doubt_cells: float = 10.0  # added to the number of cells of ridges

    # Evidence beyond chance, in decades of the FMR
    beyond_from: float = 2.0  # rarity from which pairs are compared with those by chance
    beyond_less: float = 1.0  # how much chance makes of the best transform
    beyond_few: float = 0.4  # how much more where a print has few minutiae
    beyond_share: float = parameter(
        0.8, "share of the rarity beyond chance that does not count", 0, 1
    )


USUAL: Final = MatchParameters()
