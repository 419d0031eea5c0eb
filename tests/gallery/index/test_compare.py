"""One-to-many comparison: to the last bit what `compare` finds, in any order and any part."""

from dataclasses import replace

import numpy as np
import pytest
from extreme_prints import DEGENERATE, FIELDS, USUAL, extreme_templates
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    along,
    impressions_of_a_finger,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
)
from matching_weights import (
    ALWAYS,
    NEVER,
    NO_PREFILTER,
    REJECTING,
    scored_by,
    some_weights,
)

from fpmatch.gallery.index.compare import PreparedPrints, packs, similarities
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.prints.prepare import prepare
from fpmatch.matching.registry import get_matcher

FIELD_SIDE = 20

refine_thresholds = st.sampled_from([ALWAYS, NEVER, -6.0, 4.0])
"""Thresholds that all, no, or some comparisons pass."""

prefilters = st.sampled_from([NO_PREFILTER, REJECTING])
"""Prefilter thresholds that all, or some, comparisons pass."""

KINDS = (0, 1, 2)
"""All prints have pictures of their ridges; some have, some no field; some a field alone."""


@pytest.fixture(autouse=True)
def weights_by_hand():
    with scored_by(some_weights()):
        yield


def one_by_one(probe, prints):
    return [MATCHER.compare(probe, print_).similarity for print_ in prints]


def at_once(probe, prints):
    return similarities(MATCHER, probe, PreparedPrints(prints)).tolist()


def some_field(rng, k):
    """Return no field, one that does not show its ridges, or one that does, but for a few bits."""
    step = 320.0 / FIELD_SIDE  # that of few cells, too, reaches as far as the minutiae
    field = striped_field(period=0.625 * step, side=FIELD_SIDE, step=step)
    worn = field.ridges ^ (np.uint64(1) << rng.integers(0, 64, field.ridges.shape, np.uint64))
    return [replace(field, ridges=worn), None, replace(field, ridges=None)][k % 3]


def impressions(seed, kinds=0):
    """Return impressions of one finger and of others, with and without ridges, and of nothing.

    Of an odd seed, their minutiae lie along the ridges.
    """
    rng = np.random.default_rng(seed)
    found = []
    for k, side in enumerate(impressions_of_a_finger(seed, 30)):
        quality = rng.integers(0, 101, side.shape[1])
        field = some_field(rng, kinds * k)
        points = along(side) if seed % 2 else side
        found.append(prepare(template_of(points, (500.0, 569.0)[k % 2], quality, field)))
    return found


@given(
    seeds,
    refine_thresholds,
    st.sampled_from(KINDS),
    prefilters,
    st.sampled_from([-2.0, 1.0, NEVER]),
    st.sampled_from([-1.0, 0.02, NEVER]),
)
def test_similarities_are_those_of_compare_to_the_last_bit(
    seed, refine, kinds, prefilter, confident, relaxation
):
    """Whichever model scores; some rejected, some refined alone, some of weak local matches."""
    prints = impressions(seed, kinds)
    with scored_by(some_weights(refine, 0.4, prefilter, confident, relaxation, apart=3.0)):
        for probe in prints:
            assert at_once(probe, prints) == one_by_one(probe, prints)


@given(templates(), st.lists(templates(), max_size=4), refine_thresholds)
def test_any_templates_compare_as_one_by_one(probe, references, refine):
    prints = [prepare(template) for template in [*references, probe]]
    with scored_by(some_weights(refine)):
        assert at_once(prints[-1], prints) == one_by_one(prints[-1], prints)


def test_a_part_of_them_is_that_part_of_the_whole():
    prints = impressions(3)[:7]
    many = PreparedPrints(prints)
    whole = similarities(MATCHER, prints[0], many).tolist()
    assert similarities(MATCHER, prints[0], many.take([4, 1])).tolist() == [whole[4], whole[1]]
    assert at_once(prints[0], []) == []


@pytest.mark.parametrize("size", [0, 1, 2])
def test_few_minutiae_are_like_next_to_nothing(size):
    few = prepare(template_of(spread_points(np.random.default_rng(1), size)))
    prints = [few, impressions(2)[0]]
    for probe in prints:
        found = at_once(probe, prints)
        assert found == one_by_one(probe, prints)
        # a pair counts for nothing, two for at most 1.2 tenfold falls of the FMR
        assert found[0] <= np.logaddexp(0.0, 1.2 * np.log(10) * max(size - 1, 0))
    assert (size == 0) == (at_once(few, prints)[0] == 0.0)


@pytest.mark.parametrize("field", FIELDS)
def test_degenerate_prints_compare_as_one_by_one(field):
    prints = [prepare(replace(one, field=field)) for one in [*DEGENERATE.values(), USUAL][::3]]
    for probe in prints:
        assert at_once(probe, prints) == one_by_one(probe, prints)


def test_a_matcher_that_compares_in_its_own_way_does_so_with_many():
    prints = impressions(3)[:4]
    many = PreparedPrints(prints)
    reference = get_matcher("reference")
    alone = [reference.compare(prints[0], other).similarity for other in prints[1:]]
    assert similarities(reference, prints[0], many.take([1, 2, 3])).tolist() == alone
    assert packs(MATCHER)
    assert packs(reference)
    assert packs(get_matcher("unit-circle:rounds=3"))
    assert not packs(get_matcher("unit-circle:rounds=4"))
    assert not packs(get_matcher("paper"))


@given(extreme_templates())
def test_what_is_within_the_bounds_can_be_kept_and_compared(template):
    """So nothing that passes at enrolment can make a later search fail."""
    prepared = MATCHER.prepare(unpack_template(pack_template(template)))
    found = at_once(prepared, [prepared])
    assert np.isfinite(found).all()
    assert found == one_by_one(prepared, [prepared])
