"""Terms of a print: the edges of its Delaunay mesh, by which an index finds it.

The paper takes the neighbours of a point from the Delaunay triangulation, because it changes only
locally where points are missing or spurious: an edge between two minutiae of one print is mostly an
edge in another print of the finger. The length of an edge, and the directions of the minutiae at
its two ends relative to it, do not change when a print is moved or turned. Quantised, they are a
*term*. An index lists for each term the prints that have it, each with its *pose*: the place of the
edge in the print, and which way it points. A print's edge that is the same as one of the probe's
indicates how the probe has to be moved and turned; where many indicate the same, the two prints are
likely of one finger.

A term has the curvature of the ridges across the edge, too, where the ridge orientation is known:
the difference of the orientations on both sides of it. That of a print of the same finger is mostly
in the same cell or the next one; without it, lists would be several times as long.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.gallery.index._term_kernel import describe_edges, measure_curvatures
from fpmatch.gallery.index.embedding import embeddings
from fpmatch.gallery.index.model import CURVATURES, LEAST_SHARE, LENGTHS, SECTORS, index_model
from fpmatch.matching.constants.prints import ORIENTATIONS
from fpmatch.pointset.delaunay.triangulate import triangulate_checked

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.gallery.index.model import IndexModel
    from fpmatch.matching.prints.prepared import PreparedTemplate

TURN: Final = 2 * np.pi
# The numbers of `_term_kernel`.
LENGTH_ERROR_PX: Final = 2.5
GROWTH: Final = 0.03  # of the error, by the length
WIDTH: Final = 2.5  # of a cell of length, in errors
UNKNOWN: Final = 4.0  # greater than any curvature
ROTATIONS: Final = 64  # steps of an edge's own direction
PLACES: Final = 32  # steps of a place along x and y, after which they repeat
PER_PX: Final = 0.125  # steps of a place

ANGLE_ERROR: Final = np.radians(7.0)  # of a direction relative to an edge
CURVATURE_ERROR: Final = np.radians(5.0)
CURVATURE_BORDERS: Final = np.radians([-90.0, -35.0, -15.0, 0.0, 15.0, 35.0, 90.0])  # of cells
UNKNOWN_SHARE: Final = 0.12  # of the edges with known curvature that have none in another print
WRONG_SHARE: Final = 0.05  # of the others that are in any cell
LOGISTIC: Final = 1.702  # makes the logistic function nearly the normal distribution
REACH: Final = 1  # cells to either side of the probe's own that are looked up
KEPT: Final = 0.3  # share of the edges of a print that another print of the finger has
LEAST_GAIN: Final = 3.0  # times as likely in a print of the finger as in another
MOST_WEIGHT: Final = 4
WEIGHT_SCALE: Final = 0.5  # of the logarithm of the gain
BUDGET: Final = 0.45  # postings a print of the gallery, for each minutia of the probe


def edges_of(print_: PreparedTemplate) -> NDArray[np.int32]:
    """Return the edges (E, 2) of the Delaunay mesh of a print's minutiae."""
    return triangulate_checked(print_.points[:2].T.copy()).edges


def print_terms(print_: PreparedTemplate) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """Return the terms of a print, and their poses, both of shape (E,): one an edge of the mesh."""
    edges = np.ascontiguousarray(edges_of(print_), np.int32).reshape(-1, 2)
    term, pose = np.empty((2, len(edges)), np.uint16)
    points = np.ascontiguousarray(print_.points)
    describe_edges(points, edges, curvatures(print_, edges), term, pose)
    return term, pose


def curvatures(print_: PreparedTemplate, edges: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the curvature of the ridges across edges (E, 2), in radians, as the kernel does.

    It is by how much the ridge orientation on the left of an edge, seen from its first end, differs
    from that on the right; `UNKNOWN` where one of them is not known.
    """
    region = print_.region
    code = region.code if region.has_flow else _NO_CODES
    measured = np.empty(len(edges))
    measure_curvatures(
        np.ascontiguousarray(print_.points),
        np.ascontiguousarray(edges, np.int32),
        np.ascontiguousarray(code),
        _DOUBLED,
        region.step,
        region.first_row,
        region.first_column,
        measured,
    )
    return measured


def _doubled() -> NDArray[np.float64]:
    """Return the unit vectors at twice the angle of all codes of orientation; 0 for code 0."""
    angle = TURN / ORIENTATIONS * (np.arange(ORIENTATIONS + 1) - 1.0)
    return np.stack([np.cos(angle), np.sin(angle)]) * (np.arange(ORIENTATIONS + 1) > 0)


_DOUBLED: Final = _doubled()
_NO_CODES: Final = np.empty((0, 0), np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class ProbeTerms:
    """The terms that a probe looks up, ascending, for `Segment.votes`.

    Each edge of the probe is read from both ends. A reading looks up its own term and those that
    errors of its length and directions turn it into.
    """

    term: NDArray[np.int32]  # (T,)
    weight: NDArray[np.uint8]  # (T,)
    reading: NDArray[np.int32]  # (T,)
    shift: NDArray[np.uint16]  # (R, ROTATIONS): place and rotation, by a print's direction
    minutiae: int  # of the probe
    embedding: NDArray[np.int16]  # (128,)


def probe_terms(
    probe: PreparedTemplate,
    budget: float = BUDGET,
    model: IndexModel | None = None,
    unoriented: float = 0.0,
) -> ProbeTerms:
    """Return the terms that a probe looks up.

    Those are taken that most favour a print of the finger, up to a budget of postings: so many a
    print of the gallery for each minutia of the probe. It grows, up to twice that, where no ridge
    orientation of the probe is known, or with the share `unoriented` of the prints of the gallery
    of which none is: as many mates are found by terms without curvature.
    """
    model = model or index_model()
    edges = edges_of(probe).reshape(-1, 2)
    first, second = np.concatenate([edges, edges[:, ::-1]]).T
    x, y, c, s = probe.points
    dx, dy, theta = x[second] - x[first], y[second] - y[first], np.arctan2(s, c)
    along = np.arctan2(dy, dx)
    growth = GROWTH / LENGTH_ERROR_PX
    length = np.log1p(growth * np.hypot(dx, dy)) / GROWTH / WIDTH
    own = [_share(theta[end] - along) * SECTORS for end in (first, second)]
    error = ANGLE_ERROR / TURN * SECTORS
    at_length, p_length = _near(np.minimum(length, LENGTHS - 0.5), 1 / WIDTH)
    within = (at_length >= 0) & (at_length < LENGTHS)
    p_length, at_length = p_length * within, np.clip(at_length, 0, LENGTHS - 1)
    (at_first, p_first), (at_second, p_second) = (_near(angle, error) for angle in own)
    cell = at_length[:, :, None, None] * SECTORS + (at_first % SECTORS)[:, None, :, None]
    cell = cell * SECTORS + (at_second % SECTORS)[:, None, None, :]
    cell = cell[..., None] * CURVATURES + np.arange(CURVATURES)
    likely = p_length[:, :, None, None] * p_first[:, None, :, None] * p_second[:, None, None, :]
    share = _share_of(model)[cell]
    across = curvatures(probe, edges)
    known = across < UNKNOWN
    likely = likely[..., None] * _share_by_curvature(across, share)
    likely, share = (_with_unoriented(each, unoriented) for each in (likely, share))
    gain = (0.5 * KEPT * likely / np.maximum(share, LEAST_SHARE)).ravel()
    kept = np.flatnonzero(gain > LEAST_GAIN)
    kept = kept[_order(-gain[kept].astype(np.float32).view(np.int32))]
    cost = np.cumsum(share.ravel()[kept]) * model.edges
    budget *= 1.0 + (unoriented if known.any() else 1.0)
    kept = kept[: np.searchsorted(cost, budget * len(probe), "right")]
    kept = kept[_order(cell.ravel()[kept])]
    weight = np.clip(np.rint(WEIGHT_SCALE * np.log(gain[kept])), 1, MOST_WEIGHT)
    middle = 0.5 * np.stack([x[first] + x[second], y[first] + y[second]])
    return ProbeTerms(
        term=cell.ravel()[kept].astype(np.int32),
        weight=weight.astype(np.uint8),
        reading=(kept // ((2 * REACH + 1) ** 3 * CURVATURES)).astype(np.int32),
        shift=_turned(middle, np.rint(_share(along) * ROTATIONS).astype(np.int64)),
        minutiae=len(probe),
        embedding=embeddings([probe])[0].astype(np.int16),
    )


def _order(keys: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return a stable order of keys of 32 bits, ascending: `numpy.argsort` takes longer for it."""
    numbered = np.sort((keys.astype(np.int64) << 32) + np.arange(len(keys)))  # no two are equal
    order: NDArray[np.int64] = numbered & 0xFFFFFFFF
    return order


@cache
def _share_of(model: IndexModel) -> NDArray[np.float64]:
    return model.share


def _share(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return angles as shares of a turn, 0 to 1."""
    share: NDArray[np.float64] = angle / TURN
    return share - np.floor(share)


def _near(
    value: NDArray[np.float64], error: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the cells around values (N,), and how likely another print has them: (N, 3) both."""
    cell = np.floor(value).astype(np.int64)[:, None] + np.arange(-REACH, REACH + 1)
    off = LOGISTIC / error * (cell - value[:, None])
    likely = 1.0 / (1.0 + np.exp(-off - LOGISTIC / error)) - 1.0 / (1.0 + np.exp(-off))
    return cell, likely


def _share_by_curvature(
    across: NDArray[np.float64], share: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how likely another print has each curvature, (R, 3, 3, 3, C), by both readings.

    `across` are the probe's. Where one is not known, another print has it as often as others, by
    their `share` of edges.
    """
    known = np.tile(across < UNKNOWN, 2)
    across = np.concatenate([across, -across])[:, None]  # sides change places
    turns = np.pi * np.arange(-1, 2)[:, None, None]
    off = LOGISTIC / CURVATURE_ERROR * (CURVATURE_BORDERS - across + turns)
    near = np.diff(1.0 / (1.0 + np.exp(-off))).sum(0)
    near = (1.0 - UNKNOWN_SHARE) * ((1.0 - WRONG_SHARE) * near + WRONG_SHARE / near.shape[1])
    likely: NDArray[np.float64] = share / share.sum(-1, keepdims=True)
    likely[known, ..., :-1] = near[known, None, None, None]
    likely[known, ..., -1] = UNKNOWN_SHARE
    return likely


def _with_unoriented(share: NDArray[np.float64], unoriented: float) -> NDArray[np.float64]:
    """Return shares (..., C) of curvatures, where those of some prints are all unknown."""
    if not unoriented:
        return share
    mixed = (1.0 - unoriented) * share
    mixed[..., -1] += unoriented * share.sum(-1)
    return mixed


def _turned(middle: NDArray[np.float64], rotation: NDArray[np.int64]) -> NDArray[np.uint16]:
    """Return where edges of the probe are moved by the rotation onto a print's edge, (R, 64).

    The place is quantised as poses are; above it stands the cell of rotations, of four each. The
    direction of the print's edge is the place in a row, that of the probe's edge is given.
    """
    turn = TURN / ROTATIONS * np.arange(ROTATIONS)
    c, s = np.cos(turn), np.sin(turn)
    x, y = middle[..., None] * PER_PX
    column = np.rint(c * x - s * y).astype(np.int64) & (PLACES - 1)
    row = np.rint(s * x + c * y).astype(np.int64) & (PLACES - 1)
    place = (np.arange(ROTATIONS) // 4 * PLACES + column) * PLACES + row
    turned = (np.arange(ROTATIONS) - rotation[:, None]) % ROTATIONS
    moved: NDArray[np.uint16] = np.take_along_axis(place, turned, 1).astype(np.uint16)
    return moved
