"""The score of a finger is honest for as many impressions as it has."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch import extract
from fpmatch.errors import MatcherError
from fpmatch.gallery.fingers.finger import (
    MOST_IMPRESSIONS,
    fused_score,
    fused_scores,
    verify_finger,
)
from fpmatch.matching.calibration import Calibration
from fpmatch.matching.result import INCONCLUSIVE, NO_MATCH
from fpmatch.matching.verify import verify
from tests.matching.matching_prints import fragment

scores_of_impressions = st.lists(st.floats(0, 100), min_size=1, max_size=30)


@given(scores_of_impressions)
def test_a_finger_has_the_harmonic_mean_of_the_rates_of_its_impressions(scores):
    rates = 10 ** (-np.array(scores) / 10)
    fused, best = fused_score(scores), max(scores)
    assert fused == pytest.approx(10 * np.log10(np.mean(1 / rates)), abs=1e-9)
    assert max(best - 10 * np.log10(len(scores)), 0) - 1e-9 <= fused <= best + 1e-9
    assert fused_score([best]) == best


@given(st.lists(scores_of_impressions, min_size=1, max_size=5))
def test_many_fingers_at_once_score_as_each_alone(fingers):
    scores = np.concatenate([np.array(one) for one in fingers])
    sizes = [len(one) for one in fingers]
    found = fused_scores(scores, np.repeat(np.arange(len(fingers)), sizes), sizes)
    assert found == pytest.approx([fused_score(one) for one in fingers])


@pytest.mark.parametrize("count", [2, 5, 10])
def test_the_stated_rate_holds_for_independent_impostors(count):
    rng = np.random.default_rng(count)
    single = -10 * np.log10(rng.uniform(size=(200_000, count)))
    finger = np.repeat(np.arange(len(single)), count)
    fused = fused_scores(single.ravel(), finger, np.full(len(single), count))
    for stated in (0.01, 0.001):
        measured = np.mean(fused >= -10 * np.log10(stated))
        assert 0.8 * stated < measured < 1.2 * stated


def test_verification_names_the_best_impression(template):
    half = type(template)(template.minutiae.take(np.arange(6)), template.width, template.height)
    found = verify_finger(template, [half, template, half])
    alone = [verify(template, one) for one in (half, template)]
    assert found.best == 1
    assert found.scores.tolist() == [one.score for one in (*alone, alone[0])]
    assert found.verification.match
    assert found.verification.score == fused_score(found.scores) < found.best_score
    assert found.verification.transform == alone[1].transform
    (one,) = verify_finger(template, [template]).scores
    assert one == alone[1].score


@pytest.mark.parametrize(("count", "threshold", "named"), [(0, 40, "without"), (1, 101, "thresh")])
def test_what_cannot_be_compared_is_refused(template, count, threshold, named):
    with pytest.raises(MatcherError, match=named):
        verify_finger(template, [template] * count, threshold=threshold)


def test_a_mismatch_says_why(template):
    curve = Calibration(((0.0, 0.0), (1e6, 1.0)), tail_scale=1e6)
    found = verify_finger(template, [template], calibration=curve).verification
    assert not found.match
    assert found.reason


def test_of_very_many_impressions_some_are_compared(template):
    few = type(template)(template.minutiae.take(np.arange(3)), template.width, template.height)
    prints = [few] * 150
    prints[70] = template
    found = verify_finger(template, prints)
    assert len(found.scores) == len(found.compared) == MOST_IMPRESSIONS
    assert found.best == 70
    assert found.best_score == max(found.scores)
    assert list(found.compared) == sorted(set(found.compared))
    assert np.diff([*found.compared, 150]).max() == 3


def test_a_finger_is_judged_by_its_best_impression(fingers):
    print_, impostor = (extract(image, dpi=500) for image in fingers)
    parts = [fragment(impostor, 2), impostor]
    assert verify_finger(print_, parts).verification.decision == NO_MATCH
    assert verify_finger(print_, parts[:1]).verification.decision == INCONCLUSIVE
    assert verify_finger(fragment(print_, 2), parts).verification.decision == INCONCLUSIVE
