from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from fpmatch.matching.matchers.unit_circle import MATCHER, index_neighbours, view_of
from fpmatch.matching.parameters import USUAL
from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from fpmatch.matching.pipeline.evidence import FEATURES, ScoreModel, ScoreWeights
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from research.training.score_fit import OF_RIDGES
from research.training.score_samples import (
    NO_PREFILTER,
    NO_QUANTILES,
    SampleParameters,
    sample_of,
    samples_of,
)
from tests.research.made_sets import extracted_set

N = len(FEATURES)
OF_MATCHES = USUAL.hypotheses
EVERY_PAIR = SampleParameters(every_impostor=1, every_window_impostor=1)


@pytest.fixture
def two_fingers():
    """Three impressions of two fingers with ridges."""
    rng = np.random.default_rng(5)
    pictures = rng.integers(0, 2**63, (12, 12), np.uint64)
    field = RidgeField(16.0, np.zeros((12, 12), np.float32), np.ones((12, 12), bool), pictures)
    made = {}
    for finger in (1, 2):
        x, y, angle = rng.uniform(20, 180, (3, 9))
        for number in (1, 2, 3):
            made[finger, number] = Template(Minutiae(x + number, y, angle), 192, 192, field=field)
    return extracted_set(made)


def of_templates(extracted, change):
    """Return a set whose templates are changed."""
    return replace(extracted, templates=tuple(map(change, extracted.templates)))


def without_field(template):
    return replace(template, field=None)


def ordered_pairs(extracted):
    """Return all pairs of prepared prints, each in the order of their content."""
    prints = [MATCHER.prepare(one) for one in extracted.templates]
    return [sorted(pair, key=lambda side: side.key) for pair in combinations(prints, 2)]


def tried(features):
    return features[~np.isnan(features[..., 0])]


@pytest.mark.parametrize(("every", "taken"), [(1, 9), (2, 4), (4, 2), (9, 1), (10, 0)])
def test_of_so_many_impostors_one_is_taken(two_fingers, every, taken):
    """And of the genuine comparisons all."""
    found = sample_of(two_fingers, SampleParameters(every_impostor=every))
    assert found.genuine.sum() + found.nothing[0] == 6
    assert (~found.genuine).sum() + found.nothing[1] == taken
    hypotheses = OF_MATCHES + USUAL.ridge_starts
    assert found.features.shape == (len(found.genuine), hypotheses, N)


def test_windows_are_compared_with_whole_prints(two_fingers):
    """The same windows each time; where one shows less, it is scored by what it shows."""
    parameters = replace(EVERY_PAIR, every_window_impostor=3, windows_px=(96, 140))
    whole, alone, windows = samples_of([two_fingers], parameters, workers=1)
    assert [len(part) for part in (whole, alone, windows)] == [1, 1, 2]
    for one in windows:
        assert one.genuine.sum() + one.nothing[0] == 6
        assert (~one.genuine).sum() + one.nothing[1] == 3
        assert (one.descriptors[:, 1] < 9).any()
    again = sample_of(two_fingers, parameters, window_px=96)
    np.testing.assert_array_equal(again.features, windows[0].features)


def test_ridges_are_compared_whatever_the_minutiae_are(two_fingers):
    """Otherwise nothing could be learned of them."""
    found = sample_of(two_fingers)
    ridges, area = (FEATURES.index(name) for name in ("ridges", "area of the ridges"))
    compared = tried(found.features)
    assert len(compared) >= len(found.features)
    assert (compared[:, ridges] > -1.0).all()
    assert (compared[:, area] > np.log(10)).all()
    assert not tried(found.coarse)[:, OF_RIDGES].any()


def test_without_ridges_none_are_compared(two_fingers):
    """The print area is then the hull of the minutiae, as of a template without a field."""
    found = sample_of(two_fingers, EVERY_PAIR, ridges=False)
    same = sample_of(of_templates(two_fingers, without_field), EVERY_PAIR)
    np.testing.assert_array_equal(found.features, same.features)
    assert not tried(found.features)[:, OF_RIDGES].any()
    shown = sample_of(two_fingers, EVERY_PAIR)
    assert shown.features[0, 0].tolist() != found.features[0, 0].tolist()


def some_weights(refine):
    """Return weights of two different models that reject nothing."""
    weight = np.arange(N) + 1.0, np.where(OF_RIDGES, 0.0, 2.0 - np.arange(N))
    limits = NO_PREFILTER, -1.0, refine, np.inf, np.array(NO_QUANTILES)
    first, second = (
        ScoreModel(np.stack([np.zeros(N), np.ones(N), one, np.zeros(N)]), 2.0, *limits)
        for one in weight
    )
    return ScoreWeights((first, second, second), {})


@pytest.mark.parametrize("ridges", [True, False])
@pytest.mark.parametrize("refine", [-np.inf, np.inf])
def test_features_are_those_that_the_matcher_weighs(two_fingers, ridges, refine):
    """Refined ones where all pass the refine threshold, those in coarse alignment where none do.

    What is found by the ridges is compared in either case.
    """
    found = sample_of(two_fingers, EVERY_PAIR, ridges=ridges)
    weights = some_weights(refine)
    shown = two_fingers if ridges else of_templates(two_fingers, without_field)
    pairs = ordered_pairs(shown)
    totals = []
    for a, b in pairs:
        pipeline = Pipeline(max(len(a), len(b)), USUAL, weights)
        pipeline.load(view_of(a))
        index_neighbours(pipeline, a)
        pipeline.match(view_of(b), False)
        totals += [pipeline.scorer.total] if pipeline.best >= 0 else []
    assert len(totals) > 6
    features = np.where(OF_RIDGES, 0.0, found.coarse) if refine == np.inf else found.features
    by_ridges = found.features[:, OF_MATCHES:]
    weight = weights.models[0 if ridges else 1].standard[2]
    sums = 2.0 + np.concatenate([features, by_ridges], axis=1) @ weight
    assert sorted(np.nanmax(sums, axis=1)) == pytest.approx(sorted(totals))
