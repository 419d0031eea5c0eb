"""Comparisons of all templates with one another by the default matcher."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.gallery.index.compare import PreparedPrints, similarities
from fpmatch.lab.evaluation.rates.scores import Trials
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.databases import prints_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
    from fpmatch.templates.minutiae import Template


def compare_all_pairs(
    templates: Sequence[Template],
    *,
    workers: int | None = None,
    matcher: UnitCircleMatcher = MATCHER,
) -> NDArray[np.float64]:
    """Compare each template with every later one, by a matcher's 1:N comparison."""
    prints = [matcher.prepare(template) for template in templates]
    many = PreparedPrints(prints)

    def with_later_ones(k: int) -> NDArray[np.float64]:
        return similarities(matcher, prints[k], many.take(range(k + 1, len(prints))))

    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        return np.concatenate([np.empty(0), *pool.map(with_later_ones, range(len(prints)))])


def impostors_among(
    sets: Sequence[Dataset],
    name: str,
    workers: int | None = None,
    matcher: UnitCircleMatcher = MATCHER,
) -> Trials:
    """Return the impostor comparisons among all impressions of all databases.

    Fingers of different databases count as different, so that a few databases make very many
    comparisons. The default matcher compares, in `workers` threads (default: one a core).
    """
    templates, shown = [], []
    for number, one in enumerate(sets):
        for impression, template in prints_of(one):
            templates.append(template)
            shown.append((number, impression.finger))
    # without impressions the list has no rows
    fingers, finger = np.unique(np.array(shown, int).reshape(-1, 2), axis=0, return_inverse=True)
    finger = finger.ravel()
    similarity = compare_all_pairs(templates, matcher=matcher, workers=workers)
    probe, reference = (finger[side] for side in np.triu_indices(len(templates), 1))
    impostor = probe != reference
    return Trials(similarity[impostor], probe[impostor], reference[impostor], len(fingers), name)
