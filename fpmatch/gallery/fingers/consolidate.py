"""Consolidated templates: impressions of one finger that match, put together into a larger print.

Impressions that match are linked. In each group of linked impressions the poses, rotation and
shift, start along the tree of the strongest links. They are then fitted to all pairs of minutiae
that agree with them: each impression in turn to where the others have its partners.
`fpmatch.gallery.fingers.merge` makes one template of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.fingers.merge import merge_templates, points_at_500_dpi
from fpmatch.matching.result import compare_prepared
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

    Points = NDArray[np.float64]
    Poses = dict[int, Similarity]


LINK_SCORE: Final = 35.0  # from which two impressions are linked
LINK_PAIRS: Final = 4  # of minutiae that a link needs
LINK_RESIDUAL_PX: Final = 15.0  # rms at 500 dpi along the tree, above which a link does not fit
ROUNDS: Final = 8  # in which every impression is fitted to the others


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """Two impressions `a` and `b`, a < b, that match, and their paired minutiae, shape (K, 2)."""

    a: int
    b: int
    score: float
    pairs: NDArray[np.int32]

    def from_side(self, impression: int) -> tuple[NDArray[np.int32], int, NDArray[np.int32]]:
        """Return the paired minutiae of one of the two, the other, and its minutiae."""
        mine, theirs = self.pairs[:, 0], self.pairs[:, 1]
        return (mine, self.b, theirs) if impression == self.a else (theirs, self.a, mine)


@dataclass(frozen=True, slots=True, eq=False)
class Consolidated:
    """A template made of several impressions, at 500 dpi.

    By impression, `poses` map its pixels to those of the template.
    """

    template: Template
    poses: Poses


def link_impressions(
    prepared: Sequence[Any],
    matcher: Matcher,
    calibration: Calibration,
    *,
    least_score: float = LINK_SCORE,
    least_pairs: int = LINK_PAIRS,
    among: Collection[int] | None = None,
) -> list[Link]:
    """Compare the impressions of a finger with each other, and link those that match.

    `prepared` has what the matcher's `prepare` returned of each. If `among` is given, only pairs of
    which one impression is among these are compared.
    """
    links = []
    for a in range(len(prepared)):
        for b in range(a + 1, len(prepared)):
            if among is not None and a not in among and b not in among:
                continue
            comparison = compare_prepared(matcher, prepared[a], prepared[b])
            score = calibration.score(comparison.similarity)
            if score >= least_score and len(comparison.pairs) >= least_pairs:
                links.append(Link(a, b, score, comparison.pairs))
    return links


def linked_groups(count: int, links: Sequence[Link]) -> list[list[int]]:
    """Return the groups of `count` impressions that links connect, the largest group first.

    Examples
    --------
    >>> pairs = np.empty((0, 2), np.int32)
    >>> linked_groups(4, [Link(1, 3, 50.0, pairs), Link(2, 3, 40.0, pairs)])
    [[1, 2, 3], [0]]
    """
    # Imported where it is used, as in `merge`: commands that compare no fingers start sooner.
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    _, label = connected_components(_graph(count, links), directed=False)
    groups = [np.flatnonzero(label == k).tolist() for k in range(int(label.max(initial=-1)) + 1)]
    return sorted(groups, key=lambda group: (-len(group), group[0]))


def consolidate(templates: Sequence[Template], links: Sequence[Link]) -> list[Consolidated]:
    """Put linked impressions, of any resolutions, together: each group of two at least."""
    points = [points_at_500_dpi(template) for template in templates]
    consolidated = []
    for group in linked_groups(len(templates), links):
        if len(group) > 1:
            poses = _fitted(_tree_poses(group, points, links), points, links)
            template, moved = merge_templates([templates[k] for k in poses], poses.values())
            consolidated.append(Consolidated(template, dict(zip(poses, moved, strict=True))))
    return consolidated


def _graph(count: int, links: Sequence[Link]) -> Any:
    """Return the links as a sparse graph, the shorter the stronger."""
    from scipy.sparse import coo_array  # noqa: PLC0415

    lengths = np.array([1.0 / link.score for link in links])
    a = np.array([link.a for link in links], np.int32)
    b = np.array([link.b for link in links], np.int32)
    return coo_array((lengths, (a, b)), (count, count)).tocsr()


def _tree_poses(group: Sequence[int], points: Sequence[Points], links: Sequence[Link]) -> Poses:
    """Return poses along the tree of the strongest links, from where most of them meet."""
    from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree  # noqa: PLC0415

    by_ends = {(link.a, link.b): link for link in links}
    strength = np.zeros(len(points))
    for link in links:
        strength[[link.a, link.b]] += link.score
    root = max(group, key=lambda k: (strength[k], -k))
    tree = minimum_spanning_tree(_graph(len(points), links))
    order, before = breadth_first_order(tree, root, directed=False)
    poses = {root: Similarity()}
    for k in order[1:].tolist():
        j = int(before[k])
        mine, _, theirs = by_ends[min(j, k), max(j, k)].from_side(k)
        step = Similarity.fit(points[k][mine], points[j][theirs], with_scale=False)
        poses[k] = poses[j].after(step)
    return poses


def _fitted(poses: Poses, points: Sequence[Points], links: Sequence[Link]) -> Poses:
    """Return the poses fitted to all pairs of the links that agree with them; the first stays."""
    seen: dict[int, list[tuple[NDArray[np.int32], int, NDArray[np.int32]]]] = {k: [] for k in poses}
    for link in links:
        if link.a in poses and _residual(link, points, poses) <= LINK_RESIDUAL_PX:
            for end in (link.a, link.b):
                seen[end].append(link.from_side(end))
    fitted = dict(poses)
    for _ in range(ROUNDS):
        for k in list(poses)[1:]:
            if seen[k]:
                mine = np.concatenate([points[k][which] for which, _, _ in seen[k]])
                there = [fitted[j].apply(points[j][which]) for _, j, which in seen[k]]
                fitted[k] = Similarity.fit(mine, np.concatenate(there), with_scale=False)
    return fitted


def _residual(link: Link, points: Sequence[Points], poses: Poses) -> float:
    one = poses[link.a].apply(points[link.a][link.pairs[:, 0]])
    other = poses[link.b].apply(points[link.b][link.pairs[:, 1]])
    return float(np.sqrt(((one - other) ** 2).sum(axis=1).mean()))
