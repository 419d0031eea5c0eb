"""Verification: two templates become a decision, with all that explains it."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.calibration import allowance as allowance_of
from fpmatch.matching.calibration import score_to_fmr
from fpmatch.matching.decision import (
    DEFAULT_THRESHOLD,
    Rule,
    find_reachable,
    find_shortage,
)
from fpmatch.matching.registry import DEFAULT_MATCHER
from fpmatch.matching.result import (
    UNKNOWN_RESOLUTION,
    Shortage,
    call_matcher,
    check_repeats,
    compare_prepared,
    prepare_print,
)
from fpmatch.matching.scale import find_scale, measure_scale
from fpmatch.matching.verification import Verification
from fpmatch.templates.bounds import have_same_minutiae

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison, Identity, Matcher, Side
    from fpmatch.templates.minutiae import Template

__all__ = ["DEFAULT_THRESHOLD", "Rule", "decide", "verify"]

MIRRORED_SHARE: Final = 0.5  # of the false match rate, for the tries of a mirrored probe
MIRRORED: Final = (
    "mirrored, the probe matches, with a score of {:.1f}: is one of the images mirrored? "
    "(--mirror flips the probe)"
)


def verify(
    probe: Template,
    reference: Template,
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    threshold: float | None = None,
    calibration: Calibration | None = None,
    images: Sequence[NDArray[np.uint8] | None] = (None, None),
    allowance: float = 0.0,
    dpi_assumed: tuple[str, ...] = (),
) -> Verification:
    """Decide whether two templates come from the same finger; see `fpmatch.verify`.

    The one function that does so: `fpmatch.verify`, the commands and the web interface call it.
    A matcher that wants them is given the `images`. A score that decides is lowered by `allowance`,
    for one of several tries. The resolutions of the sides `dpi_assumed` are not stated anywhere.
    """
    rule = Rule.of(matcher, threshold, calibration)
    sides = zip((probe, reference), images, strict=True)
    ours, theirs = (prepare_print(rule.matcher, *side) for side in sides)
    comparison = compare_prepared(rule.matcher, ours, theirs)
    check_repeats(rule.matcher, ours, theirs, comparison.similarity)
    score = rule.score(comparison.similarity)
    if allowance and rule.rho is None:
        score = max(0.0, score - allowance)
    return decide(
        rule,
        (probe, ours),
        (reference, theirs),
        comparison,
        score,
        images=images,
        dpi_assumed=dpi_assumed,
    )


def decide(
    rule: Rule,
    probe: Side,
    reference: Side,
    comparison: Comparison,
    score: float,
    *,
    impressions: Sequence[Side] = (),
    images: Sequence[NDArray[np.uint8] | None] = (None, None),
    dpi_assumed: tuple[str, ...] = (),
) -> Verification:
    """Return the decision on two prints, or on a probe and a finger, that have this score.

    Of a finger all `impressions` are given; `reference` is the most similar of them. `images` are
    the pixels of probe and reference.
    """
    matcher, curve = rule.matcher, rule.calibration
    match = rule.is_match(comparison, score)
    both = probe[1], reference[1]
    evidence = comparison if match else call_matcher(matcher, "explain", *both, comparison)
    compared = None if impressions else call_matcher(matcher, "compared", *both, evidence)
    references = impressions or [reference]
    shortage, reason = None, ""
    if match:
        scale = measure_scale(probe[0], reference[0], evidence.pairs)
    else:
        scale = find_scale(rule, probe, reference)
        shortage = find_shortage(matcher, curve, probe, references, rule.threshold)
        if dpi_assumed and scale is not None:
            sides = " and ".join(f"the {side}" for side in dpi_assumed)
            message = f"the resolution of {sides} is unknown, and at another one the prints match"
            shortage = Shortage(UNKNOWN_RESOLUTION, message)
        by_rule = (
            "the score is below the threshold" if rule.rho is None else "too few minutiae agree"
        )
        reason = (evidence.reason or by_rule) if shortage is None else shortage.message
        if (mirrored := _mirrored_score(rule, probe[0], references)) is not None:
            reason += f"; {MIRRORED.format(mirrored)}"
    identical: Identity | None = None
    ours, theirs = images
    if ours is not None and theirs is not None and np.array_equal(ours, theirs):
        identical = "pixels"
    elif have_same_minutiae(probe[0], reference[0]):
        identical = "template"
    return Verification(
        match=match,
        score=score,
        fmr=math.nan if curve is None else score_to_fmr(score),
        threshold=rule.threshold,
        matcher=matcher.name,
        probe=probe[0],
        reference=reference[0],
        similarity=comparison.similarity,
        transform=evidence.transform,
        pairs=evidence.pairs,
        rms_px=evidence.rms_px,
        agreement=evidence.agreement,
        overlap=evidence.overlap,
        compared=compared,
        reason=reason,
        shortage=shortage,
        scale=scale,
        smallest_measured_fmr=0.0 if curve is None else score_to_fmr(curve.knots[-1][1]),
        rho=rule.rho,
        dpi_assumed=dpi_assumed,
        identical=identical,
        images=tuple(images),
        map_ridges=partial(call_matcher, matcher, "ridge_map", *both, evidence),
        find_reachable=partial(find_reachable, matcher, curve, probe, references),
    )


def _mirrored_score(rule: Rule, probe: Template, references: Sequence[Side]) -> float | None:
    """Return the score of the mirrored probe, less what its tries cost; None for no match."""
    if rule.rho is not None or rule.matcher.wants_image:
        return None
    mirrored = prepare_print(rule.matcher, probe.mirrored(), None)
    tried = [compare_prepared(rule.matcher, one, mirrored) for _, one in references]
    most = max((one.similarity for one in tried if one.transform is not None), default=0.0)
    score = rule.score(most) - allowance_of(MIRRORED_SHARE, len(tried))
    return score if score >= rule.threshold else None
