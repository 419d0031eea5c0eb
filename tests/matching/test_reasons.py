"""`UnitCircleMatcher.explain`: what the prefilter rejects is aligned all the same."""

import numpy as np
import pytest
from hypothesis import given, settings
from matching_prints import (
    COMPILED,
    assert_mirrored,
    seeds,
    spread_points,
    template_of,
)
from matching_weights import NEVER, scored_by, some_weights

from fpmatch.matching.matchers.unit_circle import MATCHER


@given(seeds)
@settings(max_examples=15 if COMPILED else 3)
def test_prints_that_the_prefilter_rejects_are_aligned_to_explain_it(seed):
    """Whichever of the two is the probe; the similarity is that of `compare` all the same."""
    rng = np.random.default_rng(seed)
    one, other = (MATCHER.prepare(template_of(spread_points(rng, 30))) for _ in range(2))
    with scored_by(some_weights(NEVER, prefilter=(1e9, 0.0, 1e9))):
        found, back = MATCHER.compare(one, other), MATCHER.compare(other, one)
        explained = MATCHER.explain(one, other, found)
        turned = MATCHER.explain(other, one, back)
    with scored_by(some_weights(NEVER)):
        aligned = MATCHER.compare(one, other)
    assert found.transform is None
    assert "too little in common" in found.reason
    assert (back.similarity, back.reason) == (found.similarity, found.reason)
    if aligned.transform is None:
        assert explained.reason == found.reason
        return
    assert explained.pairs.tolist() == aligned.pairs.tolist()
    assert explained.transform.matrix == pytest.approx(aligned.transform.matrix, abs=1e-9)
    assert explained.similarity == found.similarity
    assert "pairs among" in explained.reason
    assert turned.reason == explained.reason
    assert_mirrored(explained, turned)
