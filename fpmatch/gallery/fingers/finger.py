"""Comparison with a finger: the evidence of all its impressions in one score.

The best score of n impressions is too high: the chance that one of them matches another finger by
accident grows almost n-fold. The score of a finger is therefore that of the harmonic mean of the
false match rates of its impressions. If one impression of n matches, this costs ``10·log10(n)``,
like the bound n·FMR; if several match, it costs less.

References
----------
Wilson, "The harmonic mean p-value for combining dependent tests", PNAS 116 (2019).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.plugins import call_matcher
from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import MAX_SCORE
from fpmatch.matching.decision import DEFAULT_THRESHOLD, Rule
from fpmatch.matching.registry import DEFAULT_MATCHER
from fpmatch.matching.result import compare_prepared
from fpmatch.matching.verify import decide

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
    from fpmatch.matching.verify import Verification
    from fpmatch.templates.minutiae import Template

MOST_IMPRESSIONS: Final = 64  # of a finger that a probe is compared with


def choose_impressions(count: int) -> list[int]:
    """Return the numbers of the impressions to compare with: of very many, some spread over all.

    Examples
    --------
    >>> choose_impressions(3), choose_impressions(128)[:3]
    ([0, 1, 2], [0, 2, 4])
    """
    some = min(count, MOST_IMPRESSIONS)
    return [k * count // some for k in range(some)]


@dataclass(frozen=True, slots=True, eq=False)
class FingerVerification:
    """The decision on a probe and a finger.

    Transform, pairs and reference of the verification are those of the most similar impression.
    """

    verification: Verification
    scores: NDArray[np.float64]  # of the impressions compared with, each by itself, shape (N,)
    compared: tuple[int, ...]  # which of the impressions given these are
    best: int  # the most similar of the impressions given

    @property
    def best_score(self) -> float:
        """The score of the most similar impression by itself."""
        return float(self.scores[self.compared.index(self.best)])


def verify_finger(
    probe: Template,
    references: Sequence[Template],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    threshold: float = DEFAULT_THRESHOLD,
    calibration: Calibration | None = None,
    allowance: float = 0.0,
) -> FingerVerification:
    """Decide whether a probe comes from the finger that impressions of any resolutions show.

    Matcher, threshold and calibration are those of `fpmatch.verify`, whose errors are raised, and
    MatcherError if there are no impressions. Scores are lowered by `allowance`, for one of several
    tries.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> empty = Template(Minutiae.empty(), width=300, height=300)
    >>> result = verify_finger(empty, [empty, empty])
    >>> result.verification.match, result.scores.tolist()
    (False, [0.0, 0.0])
    """
    rule = Rule.of(matcher, threshold, calibration)
    assert rule.calibration is not None  # a threshold is a score
    if not references:
        raise MatcherError("a finger without impressions cannot be compared")
    chosen = tuple(choose_impressions(len(references)))
    ours = probe, call_matcher(rule.matcher, "prepare", probe)
    sides = [(references[k], call_matcher(rule.matcher, "prepare", references[k])) for k in chosen]
    comparisons = [compare_prepared(rule.matcher, ours[1], prepared) for _, prepared in sides]
    similarities = [comparison.similarity for comparison in comparisons]
    scores = rule.calibration.scores(similarities)
    best = int(np.argmax(similarities))
    score = max(0.0, fused_score(scores) - allowance)
    verification = decide(
        rule, ours, sides[best], comparisons[best], score, impressions=tuple(sides)
    )
    alone = np.maximum(scores - allowance, 0.0)
    return FingerVerification(verification, alone, chosen, chosen[best])


def fused_score(scores: ArrayLike) -> float:
    """Return the score of a finger from those of all its impressions, at least one.

    It is ``-10·log10`` of the harmonic mean of their false match rates.

    Examples
    --------
    >>> fused_score([40.0])
    40.0
    >>> round(fused_score([40.0, 0.0]), 2), round(fused_score([40.0, 40.0]), 2)
    (36.99, 40.0)
    """
    values = np.asarray(scores, np.float64)
    return float(fused_scores(values, np.zeros(len(values), np.intp), [len(values)])[0])


def fused_scores(
    scores: NDArray[np.float64], finger: NDArray[np.intp], impressions: Sequence[int] | ArrayLike
) -> NDArray[np.float64]:
    """Return the scores of fingers from those of their impressions, as `fused_score` does.

    ``scores[k]`` is that of an impression of number ``finger[k]``; ``impressions[f]`` is how many
    finger f has. Those without a score, because the probe was not compared with them, count as if
    they scored 0. A finger of n impressions has at most the best score, and at least that less
    ``10·log10(n)``.

    Examples
    --------
    >>> fused_scores(np.array([40.0, 20.0]), np.array([0, 1]), [1, 100]).round(2).tolist()
    [40.0, 2.99]
    """
    count = np.asarray(impressions, np.float64)
    best = np.zeros(len(count))
    np.maximum.at(best, finger, scores)
    left = count - np.bincount(finger, minlength=len(count))
    relative = left * 10.0 ** (-best / 10.0)
    relative += np.bincount(finger, 10.0 ** ((scores - best[finger]) / 10.0), len(count))
    fused: NDArray[np.float64] = np.clip(best + 10.0 * np.log10(relative / count), 0.0, MAX_SCORE)
    return fused
