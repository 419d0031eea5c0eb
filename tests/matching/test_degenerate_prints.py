import math
from dataclasses import replace

import numpy as np
import pytest
from extreme_prints import DEGENERATE, FIELDS, USUAL
from matching_prints import COMPILED, assert_mirrored
from matching_weights import scored_by, some_weights

from fpmatch.matching.matchers.unit_circle import MATCHER


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("name", DEGENERATE)
def test_any_degenerate_print_has_an_answer_or_a_reason(name, field):
    """Against each other one and itself, both ways."""
    one = MATCHER.prepare(replace(DEGENERATE[name], field=field))
    every = 1 if COMPILED else 11
    others = [MATCHER.prepare(other) for other in [*DEGENERATE.values()][::every]]
    others += [one, MATCHER.prepare(replace(USUAL, field=field))]
    found = []
    with scored_by(some_weights()):
        for other in others:
            forth, back = MATCHER.compare(one, other), MATCHER.compare(other, one)
            assert_mirrored(forth, back)
            explained = MATCHER.explain(one, other, MATCHER.compare(one, other))
            assert explained.similarity == forth.similarity
            for result in (forth, explained):
                assert 0 <= result.similarity < math.inf
                assert (result.transform is None) == (len(result.pairs) == 0)
                assert result.transform is None or np.isfinite(result.transform.matrix).all()
                assert math.isfinite(result.rms_px)
                assert 0 <= result.agreement <= 1
                assert 0 <= result.overlap <= 1
                assert result.reason
            found.append(forth.similarity)
    if len(one) == 0:
        assert not any(found)
    elif len(one) >= 3:
        assert found[-2] > 0
