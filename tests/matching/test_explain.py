"""`fpmatch.matching.explain`: the reasons of a no, each on a pair that is made to have it."""

from __future__ import annotations

import numpy as np
import pytest
from matching_prints import jittered, moved, spread_points, template_of

from fpmatch import Template, verify
from fpmatch.matching.matchers import get_matcher
from fpmatch.matching.result import Explaining

CERTAIN = 100.0  # a threshold that few pairs reach


def reason(probe: Template, reference: Template) -> str:
    found = verify(probe, reference, threshold=CERTAIN)
    return found.reason if not found.match else ""


def doubled(rng: np.random.Generator) -> tuple[Template, Template]:
    """Return a print, and one that holds it twice, turned and a little wrong."""
    points = spread_points(rng, 12, size=130.0)
    there = jittered(rng, moved(points, 1.0, 260 + 10j), 0.5, 0.02)
    both = np.ascontiguousarray(np.hstack([jittered(rng, points, 0.5, 0.02), there]))
    return template_of(points), template_of(both, size=500)


def test_a_competing_transform_is_told(rng: np.random.Generator) -> None:
    probe, reference = doubled(rng)
    told = reason(probe, reference)
    assert "; a quite different transform pairs 1" in told
    assert told.endswith(": neither stands out")
    assert "a quite different transform" in reason(reference, probe)


def test_a_transform_without_rival_is_not_doubted(rng: np.random.Generator) -> None:
    points = spread_points(rng, 12, size=200.0)
    worn = template_of(jittered(rng, moved(points, 0.4, 5 + 3j), 2.0, 0.05))
    assert "quite different" not in verify(template_of(points), worn, threshold=100).reason


@pytest.mark.parametrize("side", ["probe", "reference"])
def test_poor_minutiae_are_told_of_their_side(rng: np.random.Generator, side: str) -> None:
    one, other = spread_points(rng, 20), spread_points(rng, 20)
    poor = template_of(one, quality=np.full(20, 20))
    good = template_of(other, quality=np.full(20, 80))
    pair = (poor, good) if side == "probe" else (good, poor)
    told = reason(*pair)
    assert told.endswith(f"; the minutiae of the {side} are poor (mean quality 20)")
    assert told.count("poor") == 1


def test_unknown_quality_is_not_poor(rng: np.random.Generator) -> None:
    told = reason(template_of(spread_points(rng, 20)), template_of(spread_points(rng, 20)))
    assert told
    assert "poor" not in told


def test_a_comparison_alone_tells_the_main_reason(rng: np.random.Generator) -> None:
    matcher = get_matcher("unit-circle")
    assert isinstance(matcher, Explaining)
    probe, reference = map(matcher.prepare, doubled(rng))
    told, found = matcher.explain(probe, reference), matcher.compare(probe, reference)
    assert found.transform is not None
    assert told.reason.startswith(found.reason)
    assert told.similarity == found.similarity
    assert told.transform == found.transform
    assert told.pairs.tolist() == found.pairs.tolist()


def test_what_is_dismissed_at_a_glance_is_laid_to_explain_it(rng: np.random.Generator) -> None:
    """Whichever of the two is the probe."""
    matcher = get_matcher("unit-circle")
    assert isinstance(matcher, Explaining)
    one, other = (matcher.prepare(template_of(spread_points(rng, 40))) for _ in range(2))
    found, told = matcher.compare(one, other), matcher.explain(one, other)
    assert found.transform is None
    assert "too little in common" in found.reason
    assert told.transform is not None
    assert len(told.pairs) > 0
    assert told.similarity == found.similarity > 0
    assert "pairs among" in told.reason
    turned = matcher.explain(other, one)
    assert turned.pairs[:, ::-1].tolist() == sorted(told.pairs.tolist(), key=lambda row: row[1])
    assert turned.transform is not None
    inverse = turned.transform.inverse()
    assert inverse.matrix == pytest.approx(told.transform.matrix, abs=1e-9)


def test_what_cannot_be_laid_is_explained_as_compared(rng: np.random.Generator) -> None:
    matcher = get_matcher("unit-circle")
    assert isinstance(matcher, Explaining)
    one, few = template_of(spread_points(rng, 20)), template_of(spread_points(rng, 2))
    pair = matcher.prepare(one), matcher.prepare(few)
    assert matcher.explain(*pair).reason == matcher.compare(*pair).reason != ""
