"""Consolidated templates: impressions of one finger that match, put together into a larger print.

Impressions that match are linked. In each group of linked impressions the poses, rotation and
shift, start along the tree of the strongest links. They are then fitted to all pairs of minutiae
that agree with them: each impression in turn to where the others have its partners.
`fpmatch.matching.merge` makes one template of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from fpmatch.matching.merge import MergeParameters, merge_templates, points_at_500_dpi
from fpmatch.pointset.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
    from fpmatch.minutiae import Template

    Points = NDArray[np.float64]
    Poses = dict[int, Similarity]


@dataclass(frozen=True, slots=True)
class ConsolidationParameters:
    """Set how impressions are put together.

    Parameters
    ----------
    link_score : float
        Score from which two impressions are linked.
    link_pairs : int
        Pairs of minutiae that a link needs.
    link_residual_px : float
        A link is not used for the fit where its pairs lie farther apart than this, rms, in the
        poses along the tree; pixels at 500 dpi.
    rounds : int
        How often every impression is fitted to the others.
    merge : MergeParameters
        How they are merged.
    """

    link_score: float = 35.0
    link_pairs: int = 4
    link_residual_px: float = 15.0
    rounds: int = 8
    merge: MergeParameters = field(default_factory=MergeParameters)


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """Hold that two impressions match.

    Parameters
    ----------
    a, b : int
        The impressions, `a` less than `b`.
    score : float
        The score of their comparison.
    pairs : ndarray of int32, shape (K, 2)
        Their paired minutiae.
    """

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
    """Hold a template made of several impressions.

    Parameters
    ----------
    template : Template
        Their minutiae and ridge field together, at 500 dpi.
    poses : mapping of int to Similarity
        By impression, what maps its pixels to those of the template.
    """

    template: Template
    poses: Poses


def link_impressions(
    prepared: Sequence[Any],
    matcher: Matcher,
    calibration: Calibration,
    parameters: ConsolidationParameters | None = None,
    among: Collection[int] | None = None,
) -> list[Link]:
    """Compare the impressions of a finger with each other, and link those that match.

    Parameters
    ----------
    prepared : sequence
        What the matcher's `prepare` returned of each impression.
    matcher : Matcher
        The matcher.
    calibration : Calibration
        Turns similarities into scores.
    parameters : ConsolidationParameters, optional
        What a link needs.
    among : collection of int, optional
        Only pairs of which one impression is among these are compared (default: all).

    Returns
    -------
    list of Link
        The links, by impressions.
    """
    p = parameters or ConsolidationParameters()
    links = []
    for a in range(len(prepared)):
        for b in range(a + 1, len(prepared)):
            if among is not None and a not in among and b not in among:
                continue
            found = matcher.compare(prepared[a], prepared[b])
            score = calibration.score(found.similarity)
            if score >= p.link_score and len(found.pairs) >= p.link_pairs:
                links.append(Link(a, b, score, found.pairs))
    return links


def linked_groups(count: int, links: Sequence[Link]) -> list[list[int]]:
    """Return the groups of `count` impressions that links connect, the largest group first.

    Examples
    --------
    >>> pairs = np.empty((0, 2), np.int32)
    >>> linked_groups(4, [Link(1, 3, 50.0, pairs), Link(2, 3, 40.0, pairs)])
    [[1, 2, 3], [0]]
    """
    _, label = connected_components(_graph(count, links), directed=False)
    groups = [np.flatnonzero(label == k).tolist() for k in range(int(label.max(initial=-1)) + 1)]
    return sorted(groups, key=lambda group: (-len(group), group[0]))


def consolidate(
    templates: Sequence[Template],
    links: Sequence[Link],
    parameters: ConsolidationParameters | None = None,
) -> list[Consolidated]:
    """Put linked impressions together.

    Parameters
    ----------
    templates : sequence of Template
        The impressions, of any resolutions.
    links : sequence of Link
        From `link_impressions`.
    parameters : ConsolidationParameters, optional
        Thresholds and rounds.

    Returns
    -------
    list of Consolidated
        One for each group of at least two linked impressions, the largest first.
    """
    p = parameters or ConsolidationParameters()
    points = [points_at_500_dpi(template) for template in templates]
    found = []
    for group in linked_groups(len(templates), links):
        if len(group) > 1:
            poses = _fitted(_tree_poses(group, points, links), points, links, p)
            template, moved = merge_templates(
                [templates[k] for k in poses], poses.values(), p.merge
            )
            found.append(Consolidated(template, dict(zip(poses, moved, strict=True))))
    return found


def _graph(count: int, links: Sequence[Link]) -> Any:
    """Return the links as a sparse graph, the shorter the stronger."""
    lengths = np.array([1.0 / link.score for link in links])
    a = np.array([link.a for link in links], np.int32)
    b = np.array([link.b for link in links], np.int32)
    return coo_array((lengths, (a, b)), (count, count)).tocsr()


def _tree_poses(group: Sequence[int], points: Sequence[Points], links: Sequence[Link]) -> Poses:
    """Return poses along the tree of the strongest links, from where most of them meet."""
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


def _fitted(
    poses: Poses, points: Sequence[Points], links: Sequence[Link], p: ConsolidationParameters
) -> Poses:
    """Return the poses fitted to all pairs of the links that agree with them; the first stays."""
    seen: dict[int, list[tuple[NDArray[np.int32], int, NDArray[np.int32]]]] = {k: [] for k in poses}
    for link in links:
        if link.a in poses and _residual(link, points, poses) <= p.link_residual_px:
            for end in (link.a, link.b):
                seen[end].append(link.from_side(end))
    fitted = dict(poses)
    for _ in range(p.rounds):
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
