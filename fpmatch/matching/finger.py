"""Comparison with a finger: the evidence of all its impressions in one score.

Of n impressions the best alone says too much: the chance that one of them matches another finger
by accident grows almost n-fold. The score of a finger is therefore that of the harmonic mean of the
false match rates of its impressions. One impression that matches among n costs ``10·log10(n)``, as
the bound n·FMR does; impressions that match together lose less; several that match a little say
more than the best of them. A finger of one impression has the score of that impression.

References
----------
Wilson, "The harmonic mean p-value for combining dependent tests", PNAS 116 (2019).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import MAX_SCORE, load_calibration, score_to_fmr
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.result import Explaining, Verification
from fpmatch.matching.verify import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison, Matcher
    from fpmatch.minutiae import Template


@dataclass(frozen=True, slots=True, eq=False)
class FingerComparison:
    """Hold what the comparison of a probe with a finger yields.

    Parameters
    ----------
    score : float
        The score of the finger, ``-10·log10`` of the rate at which other fingers with as many
        impressions reach it.
    scores : ndarray of float64, shape (N,)
        The scores of its impressions, each by itself.
    best : int
        The impression of the highest score; of equals, the first.
    comparison : Comparison
        The comparison with that impression.
    """

    score: float
    scores: NDArray[np.float64]
    best: int
    comparison: Comparison

    @property
    def fmr(self) -> float:
        """The false match rate that the score stands for."""
        return score_to_fmr(self.score)


@dataclass(frozen=True, slots=True, eq=False)
class Finger:
    """Hold the impressions of one finger, prepared for a matcher.

    Parameters
    ----------
    matcher : Matcher
        The matcher.
    impressions : tuple
        What its `prepare` returned of each impression.
    """

    matcher: Matcher
    impressions: tuple[Any, ...]

    @classmethod
    def of(cls, templates: Iterable[Template], matcher: Matcher) -> Finger:
        """Prepare the impressions of a finger.

        Raises
        ------
        MatcherError
            If there is none.
        """
        prepared = tuple(matcher.prepare(template) for template in templates)
        if not prepared:
            raise MatcherError("a finger without impressions cannot be compared")
        return cls(matcher, prepared)

    def compare(self, probe: Any, calibration: Calibration) -> FingerComparison:
        """Compare a probe with the finger.

        Parameters
        ----------
        probe : object
            What the matcher's `prepare` returned of the probe.
        calibration : Calibration
            Turns the similarity to an impression into a score.

        Returns
        -------
        FingerComparison
            The score of the finger, and those of its impressions.
        """
        found = [self.matcher.compare(probe, one) for one in self.impressions]
        scores = calibration.scores([one.similarity for one in found])
        best = int(np.argmax([one.similarity for one in found]))
        return FingerComparison(fused_score(scores), scores, best, found[best])


@dataclass(frozen=True, slots=True, eq=False)
class FingerVerification:
    """Hold the decision on a probe and a finger.

    Parameters
    ----------
    verification : Verification
        Decision, score and FMR of the finger; transform, pairs and reference are those of its most
        similar impression.
    scores : ndarray of float64, shape (N,)
        The scores of its impressions, each by itself.
    best : int
        The most similar impression.
    """

    verification: Verification
    scores: NDArray[np.float64]
    best: int


def verify_finger(
    probe: Template,
    references: Sequence[Template],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    threshold: float = DEFAULT_THRESHOLD,
    calibration: Calibration | None = None,
) -> FingerVerification:
    """Decide whether a probe comes from the finger that some impressions show.

    Parameters
    ----------
    probe : Template
        The probe.
    references : sequence of Template
        The impressions of the finger, at least one; of any resolutions.
    matcher : str or Matcher
        The matcher, or its name.
    threshold : float
        Score from which on the answer is yes.
    calibration : Calibration, optional
        What the matcher's similarities are worth (default: as measured by the package).

    Returns
    -------
    FingerVerification
        Decision, score and evidence.

    Raises
    ------
    MatcherError
        If the matcher is unknown or not calibrated, the threshold is not in 0..100, or there are
        no impressions.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> empty = Template(Minutiae.empty(), width=300, height=300)
    >>> found = verify_finger(empty, [empty, empty])
    >>> found.verification.match, found.scores.tolist()
    (False, [0.0, 0.0])
    """
    if not 0 <= threshold <= MAX_SCORE:
        raise MatcherError(f"threshold must lie in 0..100, not {threshold:g}")
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    curve = load_calibration(chosen.name) if calibration is None else calibration
    finger, prepared = Finger.of(references, chosen), chosen.prepare(probe)
    found = finger.compare(prepared, curve)
    comparison = found.comparison
    match = comparison.transform is not None and found.score >= threshold
    if not match and isinstance(chosen, Explaining):
        comparison = chosen.explain(prepared, finger.impressions[found.best])
    verification = Verification(
        match=match,
        score=found.score,
        fmr=found.fmr,
        threshold=float(threshold),
        matcher=chosen.name,
        transform=comparison.transform,
        pairs=comparison.pairs,
        rms_px=comparison.rms_px,
        agreement=comparison.agreement,
        overlap=comparison.overlap,
        reason="" if match else comparison.reason or "too few minutiae agree",
        probe=probe,
        reference=references[found.best],
        fmr_reach=score_to_fmr(curve.reach),
    )
    return FingerVerification(verification, found.scores, found.best)


def fused_score(scores: ArrayLike) -> float:
    """Return the score of a finger from those of all its impressions, at least one.

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
    """Return the scores of fingers from those of their impressions.

    Parameters
    ----------
    scores : ndarray of float64, shape (K,)
        Scores of single impressions, 0 to 100.
    finger : ndarray of intp, shape (K,)
        The finger of each, from 0 on.
    impressions : array_like of int, shape (F,)
        How many impressions each finger has. Those without a score, because the probe was not
        compared with them, count as if they scored 0.

    Returns
    -------
    ndarray of float64, shape (F,)
        ``-10·log10`` of the harmonic mean of the false match rates of each finger's impressions.
        It is at most the best score, and at least that less ``10·log10(n)`` for n impressions.

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
