"""Evidence and score of an alignment: the kernel against the reference, bounds, and weights."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from kernel_cases import overlay
from matching_prints import (
    even_field,
    jittered,
    moved,
    seeds,
    spread_points,
    striped_field,
    template_of,
)
from matching_weights import all_with, scored_by, some_weights
from scipy.stats import poisson

from fpmatch.matching.pipeline.evidence import (
    MODELS,
    Evidence,
    amount_terms,
    load_weights,
)
from fpmatch.matching.prints.prepare import prepare
from fpmatch.matching.reference.alignment import Pairing
from fpmatch.matching.reference.evidence import (
    decades_beyond_chance,
    most_decades,
    poisson_decades,
    weigh,
)
from fpmatch.matching.reference.neighbourhood import local_similarity
from fpmatch.matching.reference.relaxation import relax

SHOWN = striped_field(side=25)


def with_itself(print_, unpaired=0):
    """Return the evidence of a print aligned with itself, all minutiae paired but the first."""
    partner = np.arange(len(print_), dtype=np.int32)
    partner[:unpaired] = -1
    return overlay(print_, print_, partner)


def some_case(seed):
    """Return two prints, pairs of their minutiae, and a transform; some are dense."""
    rng = np.random.default_rng(seed)
    count, spacing, size = (60, 5.0, 100.0) if seed % 5 == 0 else (rng.integers(0, 14), 14.0, 150.0)
    points = spread_points(rng, int(count), spacing, size)
    n = points.shape[1]
    turn, scale = rng.uniform(-0.5, 0.5), rng.uniform(0.94, 1.06)
    shift = complex(*rng.uniform(-30, 30, 2))
    sides = []
    for side in (points, jittered(rng, moved(points, turn, shift, scale), 3.0, 0.1)):
        field = striped_field(side=int(rng.integers(2, 10)), step=rng.choice([12.0, 16.0, 21.7]))
        mask = rng.random(field.mask.shape) < rng.choice([0.6, 0.9, 1.0])
        ridges = field.ridges if rng.random() < 0.7 else None
        quality = rng.integers(0, 101, n)
        chosen = replace(field, mask=mask, ridges=ridges) if rng.random() < 0.85 else None
        sides.append(prepare(template_of(side, quality=quality, field=chosen)))
    likely = np.arange(n) if rng.random() < 0.5 else rng.permutation(n)
    partner = np.where(rng.random(n) < 0.7, likely, -1).astype(np.int32)
    linear = scale * np.exp(1j * turn)
    return *sides, partner, (linear.real, linear.imag, shift.real, shift.imag)


@given(seeds, st.floats(-20, 20), st.floats(-4, 4))
@settings(max_examples=100)
def test_evidence_and_score_agree_with_the_reference(seed, bias, level):
    a, b, partner, transform = some_case(seed)
    assume(len(a))
    weights = some_weights(bias=bias, apart=5.0)
    quantiles = weights.models[0].quantiles + np.array([[level], [1.5 * level]])
    weights = all_with(weights, quantiles=quantiles)
    found = overlay(a, b, partner, transform, weights=weights)
    move = complex(*transform[:2]), complex(*transform[2:])
    pairing = Pairing(a.points, b.points, partner, (partner >= 0).astype(float), move)
    candidates = relax(a.points, b.points, local_similarity(a.neighbourhoods, b.neighbourhoods))
    with scored_by(weights):
        _, expected = weigh(a, b, candidates, pairing)
    for name in Evidence._fields:
        value = pytest.approx(getattr(expected, name), rel=1e-6, abs=1e-5)
        assert getattr(found, name) == value, name
    assert found.similarity == pytest.approx(np.logaddexp(0.0, found.minus_log_fmr), rel=1e-9)


def test_a_print_aligned_with_itself_and_with_one_beside_it():
    points = spread_points(np.random.default_rng(6), 25, spacing=20.0)
    print_ = prepare(template_of(points, field=SHOWN))
    found = with_itself(print_)
    assert (found.pairs, found.common, found.unpaired, found.cells) == (25, 50, 0, 625)
    assert (found.agreement, found.overlap, found.ridges) == (1.0, 1.0, 1.0)
    assert found.local >= 25 - 1e-3
    assert found.relaxed > 0
    found = overlay(print_, print_, np.full(25, -1, np.int32), (1.0, 0.0, 900.0, 0.0))
    assert found._replace(fewest=0)[:-2] == (0,) * (len(found) - 2)
    assert found.agreement == 0.0


@pytest.mark.parametrize(
    ("quality", "unpaired"),
    [
        ([100, 50, 0, 30] + [80] * 8, 1 + 0.25 + 0.09),
        # a template made to match must not gain by stating that its minutiae are worth nothing
        ([1] * 12, 4 * 0.25),
        ([20] * 12, 4 * 0.25),
        ([50] * 12, 4 * 0.25),
    ],
)
def test_unpaired_minutiae_count_by_the_square_of_their_quality(quality, unpaired):
    points = spread_points(np.random.default_rng(6), 12)
    points[:2] += [[50], [-50]]
    print_ = prepare(template_of(points, quality=np.array(quality), field=even_field()))
    found = with_itself(print_, unpaired=4)
    assert found.unpaired == pytest.approx(2 * unpaired)
    assert (found.pairs, found.common) == (8, 24)


@given(st.integers(0, 80), st.floats(-1, 1), st.integers(0, 900))
def test_pairs_and_ridges_bound_the_rarity(pairs, unusual, cells):
    decades = 1.2 * max(pairs - 1, 0) + float(np.clip(unusual / 0.2, 0, 1)) * cells / 12
    assert most_decades(pairs, unusual, cells) == pytest.approx(decades, abs=1e-9)


@given(st.integers(0, 80), st.floats(0.05, 60))
def test_decades_by_a_poisson_distribution_are_a_bound(pairs, mean):
    exact = poisson.logsf(pairs - 1, mean) / math.log(10)
    assert exact <= -poisson_decades(pairs, mean) + 1e-9


@given(
    st.integers(0, 80), st.floats(0, 60), st.floats(-20, 30), st.floats(-1, 1), st.floats(0, 900)
)
def test_decades_beyond_chance(pairs, by_chance, nearness, ridges, cells):
    mean = max(by_chance, 0.05)
    decades = 0.5 * nearness
    if pairs > mean:
        decades += (pairs * math.log(pairs / mean) - pairs + mean) / math.log(10)
    agreeing = float(np.clip((ridges - 0.115) / 0.2, 0, 1))
    decades += agreeing * (min(cells, 24) / 12 + max(cells - 24, 0) / 48)
    measured = decades_beyond_chance(pairs, by_chance, nearness, ridges, cells)
    assert measured == pytest.approx(decades, abs=1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_the_same_sum_is_worth_less_where_less_was_compared(name):
    """By the weights of the package: less of both minutiae and area."""
    model = load_weights().models[MODELS.index(name)]

    def worth(minutiae, area):
        low, high = model.quantiles @ amount_terms(minutiae, area)
        return (8.0 - low) / (high - low)

    found = [worth(*part) for part in ((4, 5000.0), (6, 8000.0), (8, 12000.0), (12, 25000.0))]
    assert found == sorted(found)
    assert worth(60, 90000.0) == pytest.approx(worth(200, 120000.0), rel=0.02)
