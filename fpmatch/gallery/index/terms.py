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
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.base.parsing import parse_json
from fpmatch.gallery.index.embedding import turned_embeddings
from fpmatch.matching.constants import ORIENTATIONS
from fpmatch.pointset.delaunay.triangulate import triangulate_checked

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate

MODEL_FILE: Final = Path(__file__).with_name("index_data") / "index.json"
TURN: Final = 2 * np.pi
LENGTHS: Final = 14  # cells of an edge's length; longer edges are in the last
SECTORS: Final = 24  # of a direction relative to an edge
CURVATURES: Final = 7  # cells of the curvature across an edge; the last is that of unknown ones
TERMS: Final = LENGTHS * SECTORS * SECTORS * CURVATURES
# A length has an error of LENGTH_ERROR_PX, and GROWTH of itself more; its cells are WIDTH errors.
LENGTH_ERROR_PX: Final = 2.5
GROWTH: Final = 0.03
WIDTH: Final = 2.5
CURVATURE_BORDERS: Final = np.radians([-90.0, -35.0, -15.0, 0.0, 15.0, 35.0, 90.0])  # of cells
UNKNOWN: Final = 4.0  # greater than any curvature
SIDE_PX: Final = 28.0  # from the middle of an edge to either side of it
LEAST_KNOWN: Final = 0.25  # square of the length of a mean orientation
ROTATIONS: Final = 64  # steps of an edge's own direction
PLACES: Final = 32  # steps of a place along x and y, after which they repeat
PER_PX: Final = 0.125  # steps of a place

LEAST_SHARE: Final = 1e-7  # of all edges that have a term, taken for one never seen
ANGLE_ERROR: Final = np.radians(7.0)  # of a direction relative to an edge
CURVATURE_ERROR: Final = np.radians(5.0)
UNKNOWN_SHARE: Final = 0.12  # of the edges with known curvature that have none in another print
WRONG_SHARE: Final = 0.05  # of the others that are in any cell
LOGISTIC: Final = 1.702  # makes the logistic function nearly the normal distribution
REACH: Final = 1  # cells to either side of the probe's own that are looked up
KEPT: Final = 0.3  # share of the edges of a print that another print of the finger has
LEAST_GAIN: Final = 3.0  # times as likely in a print of the finger as in another
MOST_WEIGHT: Final = 4
WEIGHT_SCALE: Final = 0.5  # of the logarithm of the gain
BUDGET: Final = 0.45  # postings a print of the gallery, for each minutia of the probe
_ANGLE: Final = TURN / ORIENTATIONS * (np.arange(ORIENTATIONS + 1) - 1.0)
_FLOW: Final = np.stack([np.cos(_ANGLE), np.sin(_ANGLE)]) * (np.arange(ORIENTATIONS + 1) > 0)
"""Unit vectors at twice the angle of all codes of orientation; 0 for code 0."""


@dataclass(frozen=True, eq=False)
class IndexModel:
    """The statistics of edges that ``python -m research train index`` learns on synthetic prints.

    The lengths of edges are nearly independent of what else a term consists of, so that the share
    of all edges that have a term is the product of two.
    """

    lengths: NDArray[np.float64]  # (LENGTHS,): share of all edges
    directions: NDArray[np.float64]
    """Share of all edges, (SECTORS, SECTORS, CURVATURES), by the directions of both ends."""
    edges: float  # of a print

    @cached_property
    def share(self) -> NDArray[np.float64]:
        """Share of all edges that have each term, shape (TERMS,)."""
        both = np.multiply.outer(self.lengths, self.directions)
        shares: NDArray[np.float64] = np.maximum(both.ravel(), LEAST_SHARE)
        return shares


@cache
def index_model() -> IndexModel:
    """Return the model of the package."""
    document = parse_json(MODEL_FILE.read_bytes())
    lengths, directions = (np.array(document[name]) for name in ("lengths", "directions"))
    return IndexModel(lengths, directions, document["edges"])


class _Edges(NamedTuple):
    """The edges (E, 2) of the mesh of a print's minutiae, measured from their first ends."""

    length: NDArray[np.float64]  # in cells
    along: NDArray[np.float64]  # direction, in radians
    first: NDArray[np.float64]  # direction of the minutia relative to the edge, in sectors
    second: NDArray[np.float64]
    middle: NDArray[np.float64]  # (2, E), in steps of a place


def _measured(print_: PreparedTemplate, edges: NDArray[np.int32]) -> _Edges:
    x, y, c, s = print_.points
    first, second = edges.T
    dx, dy, theta = x[second] - x[first], y[second] - y[first], np.arctan2(s, c)
    along = np.arctan2(dy, dx)
    return _Edges(
        length=np.log1p(GROWTH / LENGTH_ERROR_PX * np.hypot(dx, dy)) / GROWTH / WIDTH,
        along=along,
        first=_share(theta[first] - along) * SECTORS,
        second=_share(theta[second] - along) * SECTORS,
        middle=0.5 * PER_PX * np.stack([x[first] + x[second], y[first] + y[second]]),
    )


def edges_of(print_: PreparedTemplate) -> NDArray[np.int32]:
    """Return the edges (E, 2) of the Delaunay mesh of a print's minutiae."""
    return triangulate_checked(print_.points[:2].T.copy()).edges.reshape(-1, 2)


def print_terms(print_: PreparedTemplate) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """Return the terms of a print, and their poses, both of shape (E,): one an edge of the mesh.

    A term is the cell of the length of an edge, of the directions of both minutiae relative to it,
    and of the curvature across it. A pose is which way the edge points, and where its middle lies.
    """
    edges = edges_of(print_)
    of, curvature = _measured(print_, edges), curvatures(print_, edges)
    term = np.minimum(of.length.astype(np.int64), LENGTHS - 1)
    for direction in (of.first, of.second):
        term = term * SECTORS + direction.astype(np.int64) % SECTORS
    term = term * CURVATURES + np.searchsorted(CURVATURE_BORDERS[1:-1], curvature)
    term += curvature >= UNKNOWN
    pose = np.rint(_share(of.along) * ROTATIONS).astype(np.int64) % ROTATIONS
    for place in np.floor(of.middle).astype(np.int64):
        pose = pose * PLACES + place % PLACES
    return term.astype(np.uint16), pose.astype(np.uint16)


def curvatures(print_: PreparedTemplate, edges: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the curvature of the ridges across edges (E, 2), in radians.

    It is by how much the ridge orientation on the left of an edge, seen from its first end, differs
    from that on the right; `UNKNOWN` where one of them is not known.
    """
    region = print_.region
    if not region.has_flow:
        return np.full(len(edges), UNKNOWN)
    (x, other_x), (y, other_y) = (row[edges].T for row in print_.points[:2])
    dx, dy = other_x - x, other_y - y
    length = np.hypot(dx, dy)
    to_side = np.array([[1.0], [-1.0]]) * SIDE_PX / np.maximum(length, 1e-9)
    column = (0.5 * (x + other_x) - to_side * dy) / region.step - region.first_column - 0.5
    row = -(0.5 * (y + other_y) + to_side * dx) / region.step - region.first_row - 0.5
    (c, other_c), (s, other_s) = _flow_at(region.code, column, row)
    known = (length > 0) & (c * c + s * s > LEAST_KNOWN)
    known &= other_c * other_c + other_s * other_s > LEAST_KNOWN
    across = 0.5 * np.arctan2(s * other_c - c * other_s, c * other_c + s * other_s)
    return np.where(known, across, UNKNOWN)


def _flow_at(
    code: NDArray[np.uint8], column: NDArray[np.float64], row: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the orientation at places between cells, (2, ...): unit vectors, interpolated."""
    rows, columns = code.shape
    around = np.zeros((rows + 4, columns + 4), np.uint8)
    around[2:-2, 2:-2] = code
    top, left = np.floor(row), np.floor(column)
    lower, right = row - top, column - left
    first_row = np.clip(top, -2, rows).astype(np.intp) + 2
    first_column = np.clip(left, -2, columns).astype(np.intp) + 2
    place = first_row * (columns + 4) + first_column
    corners = np.array([[0, 1], [columns + 4, columns + 5]])[..., None, None]
    share = np.stack([1.0 - lower, lower])[:, None] * np.stack([1.0 - right, right])
    flow: NDArray[np.float64] = (share * _FLOW[:, around.ravel()[place + corners]]).sum((1, 2))
    return flow


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
    embedding: NDArray[np.int16]  # (4, 128): as given, and turned by quarters


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
    edges = edges_of(probe)
    both = np.concatenate([edges, edges[:, ::-1]])
    of = _measured(probe, both)
    error = ANGLE_ERROR / TURN * SECTORS
    at_length, p_length = _near(np.minimum(of.length, LENGTHS - 0.5), 1 / WIDTH)
    within = (at_length >= 0) & (at_length < LENGTHS)
    p_length, at_length = p_length * within, np.clip(at_length, 0, LENGTHS - 1)
    (at_first, p_first), (at_second, p_second) = (
        _near(end, error) for end in (of.first, of.second)
    )
    cell = at_length[:, :, None, None] * SECTORS + (at_first % SECTORS)[:, None, :, None]
    cell = cell * SECTORS + (at_second % SECTORS)[:, None, None, :]
    cell = cell[..., None] * CURVATURES + np.arange(CURVATURES)
    likely = p_length[:, :, None, None] * p_first[:, None, :, None] * p_second[:, None, None, :]
    share = model.share[cell]
    across = curvatures(probe, both)
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
    return ProbeTerms(
        term=cell.ravel()[kept].astype(np.int32),
        weight=weight.astype(np.uint8),
        reading=(kept // ((2 * REACH + 1) ** 3 * CURVATURES)).astype(np.int32),
        shift=_turned(of.middle, np.rint(_share(of.along) * ROTATIONS).astype(np.int64)),
        embedding=turned_embeddings(probe).astype(np.int16),
    )


def _order(keys: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return a stable order of keys of 32 bits, ascending: `numpy.argsort` takes longer for it."""
    numbered = np.sort((keys.astype(np.int64) << 32) + np.arange(len(keys)))  # no two are equal
    order: NDArray[np.int64] = numbered & 0xFFFFFFFF
    return order


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
    """Return how likely another print has each curvature, (R, 3, 3, 3, C), by reading.

    `across` are the probe's (R,). Where one is not known, another print has it as often as others,
    by their `share` of edges.
    """
    known = across < UNKNOWN
    turns = np.pi * np.arange(-1, 2)[:, None, None]
    off = LOGISTIC / CURVATURE_ERROR * (CURVATURE_BORDERS - across[:, None] + turns)
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
    x, y = middle[..., None]
    column = np.rint(c * x - s * y).astype(np.int64) & (PLACES - 1)
    row = np.rint(s * x + c * y).astype(np.int64) & (PLACES - 1)
    place = (np.arange(ROTATIONS) // 4 * PLACES + column) * PLACES + row
    turned = (np.arange(ROTATIONS) - rotation[:, None]) % ROTATIONS
    moved: NDArray[np.uint16] = np.take_along_axis(place, turned, 1).astype(np.uint16)
    return moved
