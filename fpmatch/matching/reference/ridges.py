"""Ridges: how well those of A, moved by the mesh of pairs, agree with those of B."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from fpmatch.matching import constants as fixed
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.prints.prepared import codes_at
from fpmatch.matching.reference.pair_mesh import cross

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate, PrintArea
    from fpmatch.matching.reference.alignment import Pairing
    from fpmatch.matching.reference.pair_mesh import Floats, Move, Numbers, PairMesh, Plane

    Bits = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class RidgeMap:
    """The agreement of the ridges of two prints, cell by cell.

    The K cells are squares of one of the prints, of about two ridge periods. Each is compared, with
    the cells that touch it, where the mesh of pairs maps it, shifted by up to half a ridge period.
    Its correlation is 2·p - 1, where p is the share of samples that are ridge in both prints or
    valley in both: 1 where the ridges coincide, on average `IMPOSTOR_RIDGES` (of
    `fpmatch.matching.constants`) for different fingers.
    """

    correlation: Floats  # (K,): -1 to 1
    xy: Floats  # (K, 2): centres of the cells, in pixels of the reference
    cell_px: float  # side of a cell, in pixels of the reference
    rotation_deg: float  # of the rows of cells in the reference, clockwise on screen

    @property
    def mean(self) -> float:
        """Mean correlation, which the score is made of."""
        return float(self.correlation.mean())


def drift_of(region: PrintArea, mesh: PairMesh, predicted: Plane, move: Move) -> Plane:
    """Return how far from the transform the mesh moves each block of two by two cells.

    Each triangle of the mesh is mapped affinely, and each block moves as its middle does. To reduce
    noise, a pair lies halfway between its partner and the prediction of its ring.
    """
    image = mesh.image.copy()
    image[fixed.FRAME :] = 0.5 * (image[fixed.FRAME :] + predicted[mesh.owner[fixed.FRAME :]])
    row, column = np.indices([(size + 1) // 2 for size in region.code.shape])
    side = 2.0 * region.step
    middle = (region.first_column + 1.0) * region.step + column * side
    middle = middle - 1j * ((region.first_row + 1.0) * region.step + row * side)
    p, q, r = mesh.vertex[mesh.triangles.T, None]
    at_q = cross(middle.ravel() - p, r - p)
    at_r = cross(q - p, middle.ravel() - p)
    area = cross(q - p, r - p)
    inside = (at_q >= 0.0) & (at_r >= 0.0) & (at_q + at_r <= area)
    t, block = inside.argmax(axis=0), np.arange(middle.size)
    share_q, share_r = (at[t, block] / area[t, 0] for at in (at_q, at_r))
    p, q, r = image[mesh.triangles[t].T]
    moved = p + share_q * (q - p) + share_r * (r - p) - (move[1] + move[0] * middle.ravel())
    return np.where(inside.any(axis=0), moved, 0.0).reshape(middle.shape)


def compare_ridges(
    a: PrintArea, b: PrintArea, move: Move, drift: Plane | None = None
) -> tuple[float, int]:
    """Return the mean correlation of the ridges of the cells compared, and how many these are."""
    _, _, value = compared_cells(a, b, move, drift)
    return (float(value.mean()), len(value)) if len(value) else (0.0, 0)


def compared_cells(
    a: PrintArea, b: PrintArea, move: Move, drift: Plane | None = None
) -> tuple[tuple[Numbers, Numbers], Plane, Floats]:
    """Return rows and columns of the K cells of A compared, their middles in B, and correlations.

    Eight bits of a cell of A, 32 where the smaller print is small, are compared with B at 5 by 5
    shifts. The shift counts at which most bits of the cell and its neighbours agree.
    """
    rows, columns = a.code.shape
    too_large = (rows + 2) * (columns + 2) > fixed.MOST_CELLS
    too_large |= (b.code.shape[0] + 4) * (b.code.shape[1] + 4) > fixed.MOST_CELLS
    if a.ridges is None or b.ridges is None or too_large:
        nothing = np.empty(0, np.intp)
        return (nothing, nothing), nothing.astype(complex), nothing.astype(float)
    row, column = np.nonzero(a.code)
    half = 0.5 * a.step - 0.5  # a pixel's middle has whole coordinates
    at = (a.first_column + column) * a.step + half - 1j * ((a.first_row + row) * a.step + half)
    at = move[0] * at + move[1] + (0.0 if drift is None else drift[row // 2, column // 2])
    common = codes_at(b, at) > 0
    row, column, at = row[common], column[common], at[common]
    small = min(a.area, b.area) <= fixed.SMALL_AREA_PX2
    sample_row, sample_column = np.array(fixed.SAMPLES if small else fixed.FEW_SAMPLES).T
    offset = move[0] * ((sample_column - 3.5) - 1j * (sample_row - 3.5)) * (a.step / b.step)
    per_bit = fixed.BITS_ALONG / b.step
    u = (at.real + 0.5) * per_bit - fixed.BITS_ALONG * (b.first_column - 2.0) - fixed.REACH
    v = (0.5 - at.imag) * per_bit - fixed.BITS_ALONG * (b.first_row - 2.0) - fixed.REACH
    u, v = u[:, None] + offset.real, v[:, None] - offset.imag
    own_row = fixed.BITS_ALONG * row[:, None] + sample_row
    own_column = fixed.BITS_ALONG * column[:, None] + sample_column
    ours = bits_of(a.ridges)[own_row, own_column]
    both = np.zeros((max(rows, 1) + 2, max(columns, 1) + 2), np.uint8)
    both[row + 1, column + 1] = 1
    agreeing = np.zeros((*both.shape, fixed.SHIFTS, fixed.SHIFTS), np.uint16)
    agreeing[row + 1, column + 1] = count_agreeing(ours, bits_of(b.ridges), u, v)
    around = sliding_window_view(both, (3, 3))[row, column]
    cells = np.maximum(around.sum(axis=(1, 2)), 1)
    windows = sliding_window_view(agreeing, (3, 3), axis=(0, 1))[row, column]
    best = windows.sum(axis=(3, 4)).reshape(-1, fixed.SHIFTS**2).max(axis=1, initial=0)
    value = 2.0 * best / (len(sample_row) * cells) - 1.0
    known = cells >= fixed.FEWEST_AROUND
    return (row[known], column[known]), at[known], value[known]


def ridge_map(
    a: PreparedTemplate, b: PreparedTemplate, pairing: Pairing, *, swapped: bool
) -> RidgeMap | None:
    """Return how the ridges of prints A and B agree under a pairing; None if nowhere compared.

    The reference is B, or A where `swapped`.
    """
    region, reference, linear = a.region, a if swapped else b, pairing.move[0]
    drift = drift_of(region, *pairing.mesh[:2], pairing.move)
    (row, column), at, correlation = compared_cells(region, b.region, pairing.move, drift)
    if not len(row):
        return None
    side, rotation = region.step, 0.0
    if swapped:
        at = (region.first_column + column + 0.5) - 1j * (region.first_row + row + 0.5)
        at = at * side + (0.5j - 0.5) * a.to_500dpi
    else:
        side, rotation = side * abs(linear), 0.0 - math.degrees(cmath.phase(linear))
    zoom = 1.0 / reference.to_500dpi
    xy = np.column_stack([at.real * zoom, -at.imag * zoom])
    return RidgeMap(correlation, xy, side * zoom, rotation)


def bits_of(ridges: NDArray[np.uint64]) -> Bits:
    """Return the ridge images of cells (rows, columns) as one, 8 by 8 bits a cell."""
    rows, columns = ridges.shape
    bits = np.unpackbits(ridges.astype("<u8").view(np.uint8), bitorder="little")
    cells = bits.reshape(rows, columns, fixed.BITS_ALONG, fixed.BITS_ALONG).transpose(0, 2, 1, 3)
    return cells.reshape(fixed.BITS_ALONG * rows, fixed.BITS_ALONG * columns).astype(bool)


def count_agreeing(ours: Bits, picture: Bits, u: Floats, v: Floats) -> NDArray[np.uint16]:
    """Return how many samples (K, S) of each cell agree with B at each shift, (K, 5, 5).

    They lie in column u and row v of B's picture with an edge of two cells, less `REACH`; beyond
    it, as wherever B has no cell, there is a valley.
    """
    rows, columns = picture.shape
    bits, edge = fixed.BITS_ALONG, 2 * fixed.BITS_ALONG
    padded = np.zeros((rows + 2 * edge, columns + 2 * edge), bool)
    padded[edge:-edge, edge:-edge] = picture
    windows = sliding_window_view(padded, (fixed.SHIFTS, fixed.SHIFTS))
    u, v = np.clip(u, 0.0, columns + 3.0 * bits), np.clip(v, 0.0, rows + 3.0 * bits)
    theirs = windows[v.astype(np.intp), u.astype(np.intp)]
    agreeing = np.sum(theirs == ours[:, :, None, None], axis=1, dtype=np.uint16)
    return np.asarray(agreeing)


def search_by_ridges(
    a: PreparedTemplate,
    b: PreparedTemplate,
    pairs: tuple[Numbers, Numbers] | None,
    p: MatchParameters = USUAL,
) -> list[tuple[int, int]]:
    """Return pairs of minutiae under whose transforms the ridges correlate best, the best first.

    Of all minutiae of two prints, the smaller of which is small, or of the `pairs` given.
    """
    if b.region.area < a.region.area:
        swapped = search_by_ridges(b, a, None if pairs is None else pairs[::-1], p)
        return [(j, i) for i, j in swapped]
    if pairs is None:
        i, j = np.indices((len(a), len(b))).reshape(2, -1)
        trials, most, least_flow, least_value = p.ridge_trials, p.ridge_starts, p.least_flow, 0.0
    else:
        i, j = pairs
        trials, most = p.ridge_candidates, 1
        least_flow, least_value = p.candidate_flow, p.candidate_value
    linear = (b.points[2, j] + 1j * b.points[3, j]) * (a.points[2, i] - 1j * a.points[3, i])
    shift = b.points[0, j] + 1j * b.points[1, j] - linear * (a.points[0, i] + 1j * a.points[1, i])
    flow, middle = _flow_agreement(a.region, b.region, linear, shift, p.least_common)
    best = np.argsort(-flow, kind="stable")[:trials]
    best = best[flow[best] >= least_flow]
    i, j, linear, shift = i[best], j[best], linear[best], shift[best]
    moves = zip(linear.tolist(), shift.tolist(), strict=True)
    compared = np.array([compare_ridges(a.region, b.region, move) for move in moves])
    correlation, cells = compared.reshape(-1, 2).T
    value, at = (correlation - p.usual_correlation) * np.sqrt(cells), shift + linear * middle
    chosen: list[tuple[int, int]] = []
    while len(chosen) < most and value.max(initial=least_value) > least_value:
        k = int(value.argmax())
        chosen.append((int(i[k]), int(j[k])))
        near = abs(at - at[k]) ** 2 < p.apart_px**2
        near &= (linear * linear[k].conj()).real > p.apart_cosine
        value[near] = least_value
    return chosen


def _flow_agreement(
    small: PrintArea, large: PrintArea, linear: Plane, shift: Plane, least_common: float
) -> tuple[NDArray[np.float64], complex]:
    """Return the mean cosine of twice the difference of orientation under transforms, -1 to 1.

    It is -2 where the prints have too little in common. Also return the middle of the samples.
    """
    row, column = np.nonzero(small.code)
    passed = -(-np.arange(fixed.FLOW_SAMPLES) * len(row) // fixed.FLOW_SAMPLES)
    row, column = (of[np.unique(passed[passed < len(row)])] for of in (row, column))
    at = (small.first_column + column + 0.5) * small.step
    at = at - 1j * ((small.first_row + row + 0.5) * small.step)
    codes = codes_at(large, shift[:, None] + linear[:, None] * at)
    ours, theirs = (_flow(of) for of in (small.code[row, column], codes))
    agreement = (linear[:, None] ** 2 * ours * theirs.conj()).real
    common = (codes > 0).sum(axis=1)
    enough = (common > 0) & (common >= least_common * len(at))
    total = np.where(codes > 0, agreement, 0.0).sum(axis=1)
    middle = complex(at.mean()) if len(at) else 0j
    return np.where(enough, total / np.maximum(common, 1), -2.0), middle


def _flow(codes: NDArray[np.uint8]) -> Plane:
    """Return the unit vectors of twice the orientation that codes state."""
    return np.asarray(np.exp(2j * np.pi * (codes.astype(np.float64) - 1.0) / fixed.ORIENTATIONS))
