"""The affine matcher: local triangles propose, a growing neighbourhood decides.

The triangle matcher for similarities looks up triangles of like shape; under an affine transform
every triangle has every shape, and a Delaunay triangulation does not survive either. So:

1. *Normalization*. Both sets are widened until they have the second moments of a circle. Where most
   points have partners, a rotation is left between them; where many points or a part of the plane
   are missing, a modest stretch, too.
2. *Proposals*. Triangles of a point and two of its neighbours in the triangulation of the widened
   set, the most informative of P first, are compared with all triangles of Q. The linear map
   between two, in the widened frames, must neither stretch one direction much more than another nor
   change the density of points beyond reason.
3. *Sequential test*, *refinement* and *decision* are as for similarities, except that the transform
   is fitted to three pairs and refitted as it grows. A match is accepted only where so many pairs,
   three of which determine the transform, are not expected by chance among as many pairs of
   triangles (a contrario). The pairs are the optimal one-to-one pairing.

Distances are in the units of Q as given. All else is the same after any affine map of the sets.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.lab.points.affine import _affine_kernel as kernel
from fpmatch.lab.points.triangles import _overlay_kernel as overlay
from fpmatch.lab.points.triangles._partner_fit_kernel import fit_partners
from fpmatch.lab.points.triangles.descriptors import density_of, ring_triangles
from fpmatch.lab.points.triangles.given_set import GivenSet, Target, check_tolerance, match_given
from fpmatch.lab.points.triangles.pairing import optimal_pairs
from fpmatch.lab.points.triangles.search import MAX_ROUNDS, Proposals, Screening, SearchParameters
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.geometry.affine_transform import AffineTransform
from fpmatch.pointset.geometry.point_match import PointMatch, rms_distance, too_few

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

MIN_POINTS_TO_MATCH: Final = 5
"""Three pairs determine the transform; smaller sets match too many others by chance."""

DETERMINED: Final = 3

_FLAT: Final = 1e-6  # ratio of extents under which a set is taken for points on a line
_POLISH: Final = 4.0  # area, in squared tolerances, in which an accepted match seeks more pairs
_STAY: Final = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True)
class AffineParameters(SearchParameters):
    """Set the affine matcher."""

    extra_proposals: int = 200_000
    """Pairs of triangles that are tested after a match of fewer points."""
    max_visits: int = 100_000_000
    """Points tested and overlaid, and triangles compared, at most."""
    max_anisotropy: float = 6.0
    """Most by which a transform between the widened sets stretches one direction more than
    another."""
    max_crowding: float = 4.0
    """Most times as dense as Q that a transform may make P."""
    max_thinning: float = 16.0
    """Most times as sparse as Q that a transform may make P."""
    least_height: float = 0.5
    """Least height of a triangle, in mean spacings of a widened set: jitter destroys flat ones."""
    proposals: int = 2_000_000
    """Pairs of triangles that are tested, at most, where the sets are small."""


_DEFAULT: Final = AffineParameters()


def match_affine(
    p: ArrayLike,
    q: ArrayLike,
    *,
    tolerance: float | None = None,
    parameters: AffineParameters | None = None,
) -> PointMatch:
    """Match as `fpmatch.match_points` does for ``model="affine"``, with parameters."""
    check_tolerance(tolerance)
    p_set, q_set = GivenSet("p", p), GivenSet("q", q)
    match = partial(_match, tolerance=tolerance, parameters=parameters or _DEFAULT)
    matched = match_given(p_set, q_set, tolerance, match)
    if matched.transform is None:
        return matched
    rows_p, rows_q = matched.pairs.T
    rms = rms_distance(matched.transform.apply(p_set.given[rows_p]), q_set.given[rows_q])
    return replace(matched, rms=rms)


def _match(
    p: GivenSet, q: GivenSet, tolerance: float | None, parameters: AffineParameters
) -> PointMatch:
    """Match two sets of which no points coincide; the rms distance is left at 0."""
    wide_p, wide_q = _Widened(p), _Widened(q)
    if min(len(p), len(q)) < MIN_POINTS_TO_MATCH:
        return PointMatch.none(reason=too_few(MIN_POINTS_TO_MATCH))
    search = _Search(wide_p, wide_q, Target.of(q, tolerance), parameters)
    if not search.run():
        return PointMatch.none(search.proposals.passed, search.proposals.reason)
    pairs = search.pair()
    widen = AffineTransform.of_matrix(wide_p.matrix).after(p.frame.as_similarity())
    from_frame = AffineTransform.of_matrix(q.frame.as_similarity().inverse().matrix)
    return PointMatch(
        transform=from_frame.after(AffineTransform(*search.move.tolist())).after(widen),
        pairs=pairs,
        matched_share=len(pairs) / min(len(p), len(q)),
        rms=0.0,
        local_matches=search.proposals.passed,
        chance=math.exp(search.log_chance),
    )


class _Widened:
    """A set mapped by a symmetric matrix so that its second moments are those of a circle."""

    def __init__(self, given: GivenSet) -> None:
        points = given.mesh.points
        middle = points.mean(axis=0)
        _, extent, axes = np.linalg.svd(points - middle, full_matrices=False)
        if extent[1] <= _FLAT * extent[0]:
            raise PointSetError(f"{given.name}: all points lie nearly on one line")
        linear = axes.T @ (axes * (math.sqrt(len(points)) / extent)[:, None])
        self.matrix = np.column_stack([linear, -linear @ middle])  # from the set's frame
        wide = (points - middle) @ linear
        self.mesh = triangulate_checked(wide)
        self.points = np.array(wide.T, order="C")
        self.density = density_of(self.mesh, self.points)

    def triangles(self, least_height: float) -> Ints:
        """Return all triangles (T, 3) of a point and two neighbours, without flat ones."""
        triangles = ring_triangles(self.mesh, self.points)
        area, sides2 = self._measure(triangles)
        least = least_height / math.sqrt(self.density)
        return np.ascontiguousarray(triangles[2 * area >= least * np.sqrt(sides2.max(axis=0))])

    def most_informative_first(self, triangles: Ints, share: float) -> NDArray[np.intp]:
        """Return the order of triangles by area times the chance that no outlier splits them.

        An outlier does so in the circumcircle; a share of the points has partners.
        """
        area, sides2 = self._measure(triangles)
        circle = math.pi * sides2.prod(axis=0) / (16 * area * area)
        value = area * np.exp((share - 1.0) * self.density * circle)
        return np.asarray((-value).argsort(kind="stable"))

    def _measure(self, triangles: Ints) -> tuple[Floats, Floats]:
        """Return the areas of triangles (T,), and their squared sides (3, T)."""
        a, b, c = (self.points[:, corner] for corner in triangles.T)
        u, v, w = b - a, c - a, c - b
        return (u[0] * v[1] - u[1] * v[0]) / 2, np.stack([(x * x).sum(axis=0) for x in (u, v, w)])


class _Search:
    """A search for a transform and its state; the move maps the widened P onto Q's frame."""

    def __init__(
        self, p: _Widened, q: _Widened, target: Target, parameters: AffineParameters
    ) -> None:
        self.p, self.q, self.target, self.given = p, q, target, parameters
        self.move = np.empty(6)
        self.log_chance = math.inf
        m, n = len(p.mesh), len(q.mesh)
        self.proposals = Proposals(parameters, m, n)
        self.screening = Screening(p.points, target, self.proposals)
        self._partner, self._owner = np.full(m, -1, np.int32), np.full(n, -1, np.int32)
        self._distance2 = np.zeros(m)  # unpaired points keep a finite one

    def run(self) -> bool:
        """Search until a proposal is accepted; return whether one was."""
        given, m = self.given, len(self.p.mesh)
        of_p, of_q = (side.triangles(given.least_height) for side in (self.p, self.q))
        fit = np.empty(12)
        test, *corners = self._arguments(of_p, of_q, fit)
        order = self.p.most_informative_first(of_p, given.share)
        log_tests = math.log(max(1, 3 * len(of_p) * len(of_q)))
        log_max = math.log(given.max_chance)
        sufficient = given.sufficient_share * min(m, len(self.q.mesh))
        move, t2 = np.empty(6), self.target.tolerance**2

        def continued(order: NDArray[np.intp], *limits: Any) -> bool:
            return bool(kernel.propose(test, self.p.points, order, *corners, *limits))

        for _ in self.proposals.passing(continued, order, 3 * len(of_q)):
            kernel.move_of(fit, move)
            if self.screening.rejects(move, log_max - log_tests):
                continue
            if not self._improve(move, t2, log_tests) or self.log_chance >= log_max:
                continue
            self._refine(move, _POLISH * t2)
            self._improve(move, t2, log_tests)
            if np.count_nonzero(self._partner >= 0) >= sufficient:
                return True
            self.proposals.end_after(given.extra_proposals)
        return self.log_chance < log_max

    def pair(self) -> Ints:
        """Refit the move to its optimal pairs; return these (K, 2)."""
        a, b, tx, c, d, ty = self.move.tolist()
        moved = np.array([[a, b], [c, d]]) @ self.p.points + [[tx], [ty]]
        target = self.target
        partner = optimal_pairs(moved, target.grid, _STAY, target.pairing_tolerance)
        fit_partners(self.p.points, target.grid, partner, self.move)
        rows = (partner >= 0).nonzero()[0]
        of_q = np.asarray(target.grid.order)[partner[rows]]
        return np.column_stack([rows, of_q]).astype(np.int32)

    def _improve(self, move: Floats, t2: float, log_tests: float) -> bool:
        """Refine a move in place, and keep it if it is the least expected by chance so far."""
        inside = self._refine(move, t2)
        if inside < 0 or not self._is_plausible(move):
            return False
        pairs = np.count_nonzero(self._partner >= 0)
        # a fit of so many parameters to few pairs leaves less than their true distances
        distance2 = self._distance2 * (pairs / (pairs - DETERMINED))
        chance = log_tests + overlay.log_chance(
            self._partner, distance2, inside, t2, self.target.rate, DETERMINED
        )
        if chance < math.log(self.given.max_chance):
            chance -= self.screening.crowding(move)
        if chance >= self.log_chance:
            return False
        self.log_chance, self.move = chance, move.copy()
        return True

    def _refine(self, move: Floats, t2: float) -> int:
        """Refine a move in place; return the number of points inside the grid, or -1."""
        return int(
            overlay.refine(
                self.p.points, self.target.grid, t2, MAX_ROUNDS, self._owner, self._partner,
                self._distance2, self.proposals.visits, move,
            )
        )  # fmt: skip

    def _is_plausible(self, move: Floats) -> bool:
        """Return whether a move is not mirrored and does not squeeze P beyond reason."""
        linear = self.q.matrix[:, :2] @ move.reshape(2, 3)[:, :2]
        area = linear[0, 0] * linear[1, 1] - linear[0, 1] * linear[1, 0]
        limit = self.given.max_anisotropy + 1 / self.given.max_anisotropy
        return bool((linear * linear).sum() <= limit * area)

    def _arguments(self, of_p: Ints, of_q: Ints, fit: Floats) -> tuple[Any, ...]:
        """Return the test of `propose`, and its arguments from the triangles of P on."""
        given, p, q, target = self.given, self.p, self.q, self.target
        thin = p.density / q.density
        test = kernel.AffineTest(
            *(p.points, of_p, p.mesh.ring_start, p.mesh.ring, target.points, target.grid),
            *(*given.of_test(target, len(p.mesh)), fit, self.proposals.visits),
        )
        return (
            *(test, of_p, of_q, q.points),
            *(given.max_anisotropy, thin / given.max_crowding, thin * given.max_thinning),
        )
