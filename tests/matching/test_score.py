"""Score: features, sum and similarity against plain twins, the models, and the thresholds."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from kernel_cases import aligner_of, impose
from matching_prints import spread_points, striped_field, template_of
from matching_weights import (
    ALWAYS,
    NEVER,
    NO_PREFILTER,
    OF_RIDGES,
    all_with,
    some_model,
    some_weights,
    weights_of,
)
from scipy.stats import poisson
from score_cases import (
    ENTRIES,
    NOT_SHOWN,
    SHOWN,
    overlay,
    scorer_of,
    some_case,
    total_of,
    with_itself,
)

from fpmatch.matching.constants.comparison import SMALL_AREA_PX2
from fpmatch.matching.pipeline._kernels._amount_kernel import decades_beyond_chance
from fpmatch.matching.pipeline.evidence import load_weights
from fpmatch.matching.pipeline.parameters import ScoreParameters
from fpmatch.matching.pipeline.score_model import FEATURES, ScoreWeights
from fpmatch.matching.prints.prepare import prepare
from fpmatch.matching.reference.evidence import _features

N = len(FEATURES)
EVERYONE = np.arange(20, dtype=np.int32)


def features_of(weights, /, **entries):
    """Return the features of evidence of which all that is not given is 0."""
    scorer = scorer_of(weights, **entries)
    scorer.describe()
    return np.asarray(scorer.feature)


def most_decades_twin(evidence):
    """Return the most that pairs and ridges can count, as the docstring of `score` defines it."""
    decades = 1.2 * max(evidence.pairs - 1, 0)
    mean = evidence.chance * float(np.clip((evidence.chance - 3) / 2, 0, 1))
    if mean > 0:
        n = max(evidence.pairs, mean)
        decades = min(decades, (n * math.log(n / mean) - n + mean) / math.log(10))
    agreeing = float(np.clip((evidence.ridges - 0.2) / 0.2, 0, 1))
    return decades + agreeing * evidence.cells / 12


@given(
    st.fixed_dictionaries(
        {
            **{name: st.floats(0, 50) for name in ENTRIES},
            "pairs": st.integers(0, 80),
            "ridges": st.floats(-1, 1),
            "cells": st.integers(0, 900),
        }
    ),
    st.booleans(),
)
def test_features_agree_with_the_reference(entries, shown):
    weights = some_weights()
    entries["cells"] *= shown
    found = features_of(weights, shown=shown, **entries)
    assert found == pytest.approx(
        _features(weights.models[0 if shown else 1], entries, ScoreParameters()), rel=1e-12
    )


@pytest.mark.parametrize("bias", [-800.0, -40.0, -1.0, 0.0, 1.0, 40.0, 800.0])
def test_similarity_is_the_logarithm_of_one_and_the_ratio(bias):
    print_ = prepare(template_of(spread_points(np.random.default_rng(1), 9)))
    standard = np.array([[0.0], [1.0], [0.0], [0.0]]).repeat(N, axis=1)
    found = with_itself(print_, weights=weights_of(standard, bias, NEVER))
    assert found.total == bias
    decades = min(2 + bias, most_decades_twin(found))  # NO_QUANTILES
    assert found.minus_log_fmr == pytest.approx(decades * math.log(10))
    assert found.similarity == pytest.approx(np.logaddexp(0.0, found.minus_log_fmr), rel=1e-12)
    assert found.similarity > 0 or bias == -800.0


def test_pairs_of_dense_prints_are_bounded_by_what_chance_gives():
    """Up to 3 of them are as usual."""
    some = overlay(*some_case(1))
    bounds = []
    for chance, cells in ((0.0, 0), (3.0, 0), (5.0, 0), (8.0, 0), (40.0, 0), (40.0, 24)):
        entries = {"pairs": 10, "chance": chance, "cells": cells, "ridges": 0.3}
        scorer = scorer_of(some_weights(), shown=False, **entries)
        bounds.append(scorer.condition(1e9) / math.log(10))
        assert bounds[-1] == pytest.approx(most_decades_twin(replace(some, **entries)))
        chances = np.exp([poisson.logsf(9, chance)])[0] if chance > 4 and not cells else 0.0
        assert chances <= 10 ** -bounds[-1] * (1 + 1e-9)
    assert bounds[:2] == pytest.approx([10.8, 10.8])
    assert bounds[2] > bounds[3] > 0
    assert bounds[-2:] == pytest.approx([0.0, 1.0])


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


@given(st.integers(0, 2**32 - 1), st.floats(-5, 60))
def test_an_estimate_is_lowered_to_20_at_most(seed, estimate):
    """Higher ones are not left lower."""
    rng = np.random.default_rng(seed)
    a, b = (prepare(template_of(spread_points(rng, 20, size=150.0))) for _ in range(2))
    pairs, identity = rng.permutation(20).astype(np.int32), (1.0, 0.0, 0.0, 0.0)
    aligner = impose(aligner_of(a.points, b.points), pairs, identity)
    aligner.keep(0)
    scorer = scorer_of(some_weights(), pairs=20)
    sides = a.for_kernels(), b.for_kernels()
    one, other = (scorer.beyond_chance(*sides, aligner, 0, x) for x in (estimate, estimate + 1.0))
    least = 2.0 * math.log(10)
    assert min(estimate, least) <= one <= min(estimate, max(other, least))


@pytest.mark.parametrize("shown", [True, False])
def test_the_same_sum_is_worth_less_where_less_was_compared(shown):
    """By the weights of the package: less of both minutiae and area."""

    def worth(minutiae, area):
        entries = {"fewest": minutiae, "common": 2 * minutiae, "area": area}
        return scorer_of(load_weights(), shown=shown, **entries).condition(8.0)

    found = [worth(*part) for part in ((4, 5000.0), (6, 8000.0), (8, 12000.0), (12, 25000.0))]
    assert found == sorted(found)
    assert worth(60, 90000.0) == pytest.approx(worth(200, 120000.0), rel=0.02)


USUAL = {
    **{"pairs": 20, "local": 9.0, "unpaired": 6.0, "common": 52, "overlap": 0.7, "relaxed": 0.6},
    **{"places": 18.0, "weights": 15.0, "fullness": 14.0},
    **{"fewest": 30, "ridges": 0.45, "cells": 130},
}
LOWERING = ("unpaired", "fewest")


@given(
    st.sampled_from(sorted({*ENTRIES} - {"pairs", "common", "area", "chance"})),
    st.floats(0.01, 1),
    st.floats(0.01, 1),
)
def test_what_agrees_raises_the_sum_and_what_does_not_lowers_it(name, low, more):
    scale = 100 if name == "cells" else 1
    less, greater = (
        total_of(some_model(), features_of(some_weights(), **{**USUAL, name: scale * value}))
        for value in (low, low + more)
    )
    assert (less > greater) if name in LOWERING else (less < greater)


@given(st.floats(0.5, 1), st.floats(0, 1), st.integers(2, 40))
def test_a_good_pair_that_is_lost_lowers_the_sum(each, quality, pairs):
    sums = []
    for n, unpaired in ((pairs, 3.0), (pairs - 1, 3.0 + 2 * quality**2)):
        agreeing = dict.fromkeys(("local", "relaxed", "places", "weights", "fullness"), n * each)
        features = features_of(some_weights(), pairs=n, unpaired=unpaired, overlap=0.7, **agreeing)
        sums.append(total_of(some_model(), features))
    assert sums[1] < sums[0]


def with_fields(*fields):
    """Return prints of the same minutiae, with these fields."""
    points = spread_points(np.random.default_rng(6), 20)
    return [prepare(template_of(points, field=field)) for field in fields]


@pytest.mark.parametrize("refine", [ALWAYS, NEVER])
@pytest.mark.parametrize("first", [SHOWN, NOT_SHOWN, None])
@pytest.mark.parametrize("second", [SHOWN, NOT_SHOWN, None])
def test_the_model_is_that_of_the_pictures_that_both_prints_have(first, second, refine):
    a, b = with_fields(first, second)
    weights = some_weights(refine, apart=100.0)
    found = overlay(a, b, EVERYONE, weights=weights)
    model = weights.models[0 if first is second is SHOWN else 1]
    assert weights.model_of(a, b) is model
    assert found.total == pytest.approx(total_of(model, found.features))
    compared = first is second is SHOWN and refine == ALWAYS
    assert found.cells == (625 if compared else 0)
    if not compared:
        assert found.ridges == 0.0
        assert found.features[OF_RIDGES].tolist() == model.standard[3, OF_RIDGES].tolist()


def test_above_the_refine_threshold_ridges_are_compared():
    (shown,) = with_fields(SHOWN)
    on_minutiae = with_itself(shown, weights=some_weights(NEVER)).total
    for above, compared in ((-1e-9, True), (0.0, False), (1.0, False)):
        found = with_itself(shown, weights=some_weights(on_minutiae + above))
        assert (found.cells == 625) is compared
        assert found.total > on_minutiae if compared else found.total == on_minutiae


def test_the_sum_without_ridges_is_held_against_the_refine_threshold():
    """Ridges that disagree may take the sum back below it."""
    a, b = with_fields(SHOWN, striped_field(side=25, orientation=0.6 + math.pi / 2))
    standard = some_model().standard.copy()
    standard[3, OF_RIDGES[0]] = 0.8  # so that any ridges agree less than those of impostors

    def evidence(refine):
        return overlay(a, b, EVERYONE, weights=all_with(some_weights(refine), standard=standard))

    refine = evidence(NEVER).total - 1e-6
    found = evidence(refine)
    assert found.cells > 0
    assert found.total < refine


finite = st.floats(-1e4, 1e4)


@given(
    st.lists(st.tuples(finite, finite, finite), min_size=3, max_size=3),
    st.integers(0, 4000),
    st.integers(3, 200),
)
def test_the_prefilter_shortfall_is_that_of_the_model(prefilters, score, smaller):
    everything_passes = scorer_of(some_weights(prefilter=NO_PREFILTER))
    assert everything_passes.prefilter_shortfall(0, smaller) <= 0
    models = tuple(some_model(prefilter=one) for one in prefilters)
    weights = ScoreWeights(models, {})
    scorer = scorer_of(weights)
    areas = (SMALL_AREA_PX2, SMALL_AREA_PX2 + 0.1)
    for ridges_a, ridges_b, area in product((True, False), (True, False), areas):
        model = (1, 1, 2 if area <= SMALL_AREA_PX2 else 0)[ridges_a + ridges_b]
        assert scorer.choose_model(ridges_a, ridges_b, area) == model
        base, growth, limit = prefilters[model]
        shortfall = scorer.prefilter_shortfall(score, smaller)
        assert shortfall == pytest.approx(min(base + growth * smaller, limit) - score)
        rejected = scorer.prefilter_rejected(abs(shortfall))
        assert rejected == pytest.approx(-5.0 - abs(shortfall) / 4)
        assert scorer.prefilter_rejected(abs(shortfall) + 1.0) < rejected
