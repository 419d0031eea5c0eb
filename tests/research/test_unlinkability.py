"""`d_sys`: 0 for equal distributions, 1 for disjoint ones, the known value between."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from research.attacks.unlinkability import d_sys

VALUES = st.lists(st.floats(-10, 10), min_size=1, max_size=60)


@given(VALUES, VALUES)
def test_it_lies_between_0_and_1(mated, non_mated):
    assert 0 <= d_sys(mated, non_mated) <= 1


@given(VALUES)
def test_equal_samples_are_not_linked(values):
    assert d_sys(values, values) == 0


def test_disjoint_samples_are_always_linked(rng):
    assert d_sys(rng.uniform(0, 1, 500), rng.uniform(2, 3, 900)) == 1


def test_uniform_distributions_that_overlap_by_half(rng):
    # where both occur the ratio is 1; the other half of the mated values is linked surely
    found = d_sys(rng.uniform(0, 2, 20_000), rng.uniform(1, 3, 20_000))
    assert found == pytest.approx(0.5, abs=0.03)


def test_independent_samples_of_one_distribution_are_hardly_linked(rng):
    assert d_sys(rng.normal(size=20_000), rng.normal(size=20_000)) < 0.06


def test_the_prior_ratio_counts():
    mated, non_mated = [0.0] * 30 + [1.0] * 10, [0.0] * 10 + [1.0] * 30
    assert d_sys(mated, non_mated) == pytest.approx(0.75 * (2 * 3 / 4 - 1))
    assert d_sys(mated, non_mated, omega=1 / 3) == 0
