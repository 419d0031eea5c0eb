import math
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.rates.error_rates import Rates, error_curves, error_rates

few_scores = st.lists(st.integers(0, 9), min_size=1, max_size=30)


def fmr(impostor, threshold):
    return Fraction(sum(s >= threshold for s in impostor), len(impostor))


def fnmr(genuine, threshold):
    return Fraction(sum(s < threshold for s in genuine), len(genuine))


def slow_thresholds(genuine, impostor):
    return [*sorted({*genuine, *impostor}), math.inf]


def slow_eer(genuine, impostor):
    """Walk up the thresholds to where FNMR first reaches FMR; cross the diagonal on the way."""
    points = [(fmr(impostor, t), fnmr(genuine, t)) for t in slow_thresholds(genuine, impostor)]
    (x0, y0), (x1, y1) = next(pair for pair in pairwise(points) if pair[1][1] >= pair[1][0])
    return x0 + (x0 - y0) / ((x0 - y0) + (y1 - x1)) * (x1 - x0)


def slow_fnmr_at(genuine, impostor, limit):
    thresholds = slow_thresholds(genuine, impostor)
    return fnmr(genuine, next(t for t in thresholds if fmr(impostor, t) <= limit))


def slow_fmr_without_misses(genuine, impostor):
    kept = [t for t in slow_thresholds(genuine, impostor) if not fnmr(genuine, t)]
    return fmr(impostor, kept[-1]) if kept else Fraction(1)


@given(few_scores, few_scores)
def test_eer_and_zero_fmr_agree_with_the_definition(genuine, impostor):
    rates = error_rates(genuine, impostor)
    assert rates.eer == pytest.approx(float(slow_eer(genuine, impostor)), abs=1e-12)
    assert rates.zero_fmr == float(slow_fnmr_at(genuine, impostor, 0))
    assert rates.zero_fnmr == float(slow_fmr_without_misses(genuine, impostor))


@given(few_scores, st.integers(0, 2**32 - 1), st.integers(1000, 1100), st.integers(4, 12))
def test_fmr100_and_fmr1000_agree_with_the_definition(genuine, seed, count, highest):
    skewed = np.random.default_rng(seed).exponential(1.5, count)
    impostor = np.minimum(skewed.astype(int), highest).tolist()
    rates = error_rates(genuine, impostor)
    assert rates.fmr100 == float(slow_fnmr_at(genuine, impostor, Fraction(1, 100)))
    assert rates.fmr1000 == float(slow_fnmr_at(genuine, impostor, Fraction(1, 1000)))


@given(few_scores, few_scores)
def test_rates_depend_on_the_order_alone(genuine, impostor):
    stretched = error_rates(np.exp(genuine), np.exp(impostor))
    as_given = error_rates(genuine[::-1], impostor[::-1])
    assert replace(stretched, d_prime=None) == replace(as_given, d_prime=None)


@pytest.mark.parametrize("impostors", [99, 100, 999, 1000, 9999, 10_000])
def test_rates_that_the_pairs_do_not_allow_are_none(impostors):
    rates = error_rates([1], [0] * impostors)
    allowed = [0 if impostors >= least else None for least in (100, 1000, 10_000)]
    assert [rates.fmr100, rates.fmr1000, rates.fmr10000] == allowed
    assert (rates.eer, rates.zero_fmr, rates.zero_fnmr) == (0, 0, 0)


@pytest.mark.parametrize(("genuine", "impostor"), [([], [1.0]), ([1.0], []), ([], [])])
def test_one_sided_scores_have_no_rates(genuine, impostor):
    assert error_rates(genuine, impostor) == Rates(*[None] * 6)
    with pytest.raises(DatasetError, match="at least one genuine and one impostor"):
        error_curves(genuine, impostor)


def test_scores_must_be_finite():
    for bad in (math.nan, math.inf):
        with pytest.raises(DatasetError, match="impostor scores must be finite"):
            error_rates([1.0], [bad])
