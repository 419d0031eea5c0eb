import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.lab.evaluation.rates.bootstrap import (
    BOOTSTRAPPED,
    bootstrap_rates,
    draw_fingers,
)
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.evaluation.rates.scores import Trials, unnamed_set


def trials(fingers, impressions, seed, levels=None):
    """All pairs of some prints, genuine ones higher; equal scores where there are few levels."""
    rng = np.random.default_rng(seed)
    finger = np.repeat(np.arange(fingers), impressions)
    i, j = np.triu_indices(finger.size, k=1)
    probe, reference = finger[i], finger[j]
    similarity = rng.standard_normal(i.size) + 1.5 * (probe == reference)
    if levels is not None:
        similarity = np.floor(levels * similarity)
    return Trials(similarity, probe, reference, fingers)


def slow_rates(trial_sets, counts):
    """Repeat every comparison as often as it counts, and count errors."""
    genuine, impostor = [], []
    for t, drawn in zip(trial_sets, counts, strict=True):
        for s, a, b in zip(t.similarity, t.probe, t.reference, strict=True):
            if a == b:
                genuine += [s] * drawn[a]
            else:
                impostor += [s] * (drawn[a] * drawn[b])
    if not genuine or not impostor:
        return [np.nan] * len(BOOTSTRAPPED)
    rates = error_rates(genuine, impostor)
    every = [getattr(rates, name) for name in BOOTSTRAPPED]
    return [rates.zero_fmr if rate is None else rate for rate in every]


@settings(max_examples=25)
@given(st.integers(2, 6), st.integers(2, 3), st.integers(0, 2**32), st.sampled_from([None, 1, 3]))
def test_agrees_with_repeating_the_comparisons(fingers, impressions, seed, levels):
    given_trials = [trials(fingers, impressions, seed, levels), trials(3, 2, seed + 1, levels)]
    sets, pooled = bootstrap_rates(given_trials, 6, seed)
    counts = [draw_fingers(t.fingers, 6, seed, k) for k, t in enumerate(given_trials)]
    for b in range(6):
        expected = slow_rates(given_trials, [c[b] for c in counts])
        np.testing.assert_allclose(pooled[b], expected, rtol=1e-12)
        for k, t in enumerate(given_trials):
            alone = slow_rates([t], [counts[k][b]])
            np.testing.assert_allclose(sets[k, b], alone, rtol=1e-12)


def test_a_larger_database_with_fmr1000_and_fmr10000():
    many = trials(60, 3, 3)
    drawn = draw_fingers(60, 3, 5)
    ((found,), _) = bootstrap_rates([many], 3, 5)
    for b in range(3):
        np.testing.assert_allclose(found[b], slow_rates([many], [drawn[b]]), rtol=1e-12)


def test_draws_take_as_many_fingers_as_there_are():
    drawn = draw_fingers(7, 50, seed=3)
    assert drawn.shape == (50, 7)
    assert (drawn.sum(axis=1) == 7).all()
    assert not (drawn == draw_fingers(7, 50, seed=3, set_index=1)).all()


@pytest.mark.parametrize("fingers", [1, 2])
def test_a_draw_without_impostors_has_no_rates(fingers):
    _, pooled = bootstrap_rates([trials(fingers, 2, 0)], 40, 0)
    drawn = draw_fingers(fingers, 40, 0)
    alone = (drawn > 0).sum(axis=1) == 1
    assert (np.isnan(pooled).all(axis=1) == alone).all()


def test_there_are_no_rates_where_fingers_are_not_known():
    scores = unnamed_set(np.ones(40), np.zeros(40)).trials
    sets, pooled = bootstrap_rates([trials(5, 2, 0), scores], 20, 0)
    assert np.isnan(sets).all()
    assert np.isnan(pooled).all()
