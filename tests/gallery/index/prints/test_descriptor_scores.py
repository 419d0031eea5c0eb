"""Scores of bit descriptors: the mate comes first, and prints of any size are ranked."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import COMPILED, jittered, moved, spread_points, template_of, templates

from fpmatch.gallery.index.prints.descriptor_scores import (
    LEAST_PRINTS,
    SIZE_OFFSET,
    SizeNormalization,
    prefilter_scores,
    size_normalized,
)
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.matching.prints.prepare import prefilter_of, prepare, score_descriptors

EXAMPLES = 6 if COMPILED else 3


@given(templates(), st.lists(templates(), max_size=3))
@settings(max_examples=EXAMPLES)
def test_weights_are_those_of_each_alone(probe, references):
    prints = [prepare(template) for template in [*references, probe]]
    weights = prefilter_scores(prints[-1], PreparedPrints.pack(prints))
    tables = prefilter_of(prints[-1].bit_descriptors)
    assert weights.tolist() == [score_descriptors(tables, one.bit_descriptors) for one in prints]


def test_the_mate_is_first_and_parts_are_as_the_whole():
    rng = np.random.default_rng(7)
    finger = spread_points(rng, 30)
    others = [template_of(spread_points(rng, 30)) for _ in range(40)]
    mate = template_of(jittered(rng, moved(finger[:, 4:], 1.0, 20 - 9j), 2.0, 0.08))
    many = PreparedPrints.pack(map(prepare, [*others, mate]))
    probe = prepare(template_of(finger))
    whole = prefilter_scores(probe, many)
    assert np.argmax(whole) == 40
    assert whole[40] > 2 * whole[:40].max()
    parts = [prefilter_scores(probe, many, 0, 13), prefilter_scores(probe, many, 13)]
    assert np.concatenate(parts).tolist() == whole.tolist()
    assert prefilter_scores(probe, many, 30, 20).size == 0
    sizes = np.diff(many.minutiae_start)
    assert np.argmax(size_normalized(whole, sizes, len(probe))) == 40


@pytest.mark.parametrize("n", [0, 1, 2, 65, 200, 255])
def test_prints_of_any_size(n):
    rng = np.random.default_rng(n)
    sizes = [n, 30, 0] if COMPILED else [min(n, 70), 12, 0]
    prints = [prepare(template_of(spread_points(rng, k, 9.0, 400.0), size=500)) for k in sizes]
    weights = [prefilter_scores(one, PreparedPrints.pack(prints)) for one in prints]
    assert all(found.shape == (3,) and found[2] == 0 for found in weights)
    if n >= 65:
        assert weights[0].argmax() == 0
        assert weights[0][0] > 0
    nobody = PreparedPrints.pack([])
    scores = prefilter_scores(prints[0], nobody)
    assert scores.size == size_normalized(scores, scores, 30).size == 0


def scores_of_sizes(sizes, rng):
    """Scores whose mean and deviation, divided by the smaller size, grow with the size."""
    slope = np.log(sizes + SIZE_OFFSET)
    share = 0.2 * slope + 0.1 * slope * rng.standard_normal(len(sizes))
    return np.rint(share * (np.minimum(sizes, 30) + SIZE_OFFSET)).astype(np.int32)


def test_scores_of_many_prints_are_normalized_by_their_sizes():
    rng = np.random.default_rng(11)
    sizes = rng.integers(6, 90, 20_000)
    scores = scores_of_sizes(sizes, rng)
    found = size_normalized(scores, sizes, 30)
    for some in (sizes < 15, (sizes > 30) & (sizes < 45), sizes > 75):
        assert abs(found[some].mean()) < 0.06
        assert found[some].std() == pytest.approx(1, rel=0.08)
    assert abs(np.corrcoef(found, sizes)[0, 1]) < 0.02


@given(st.integers(0, 2**32 - 1), st.integers(LEAST_PRINTS, 900), st.integers(0, 300))
@settings(max_examples=20)
def test_normalization_does_not_depend_on_the_order_of_the_prints(seed, count, probe_size):
    rng = np.random.default_rng(seed)
    sizes, scores = rng.integers(0, 400, count), rng.integers(0, 288, count)
    order = rng.permutation(count)
    whole, mixed = (
        SizeNormalization.fit(scores[of], sizes[of], probe_size) for of in (np.arange(count), order)
    )
    assert whole.of(scores, sizes)[order].tolist() == mixed.of(scores[order], sizes[order]).tolist()
    assert np.isfinite(whole.of(scores, sizes)).all()
