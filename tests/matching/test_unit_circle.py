"""The default matcher: symmetric, invariant, robust to any template, clear about a non-match."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from extreme_prints import DEGENERATE, FIELDS, USUAL
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    EMPTY,
    along,
    assert_mirrored,
    distorted,
    even_field,
    jittered,
    moved,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
    turned_on_screen,
)
from matching_weights import ALWAYS, NEVER, REJECTING, scored_by, some_weights

from fpmatch.matching.constants import MIN_PAIRS_FOR_SCALE
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.verify import verify
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template

SECONDS_FOR_A_CROWD = 5.0 if COMPILED else 90.0
PRINT_SIZE = 30 if COMPILED else 18


def compare(probe, reference):
    return MATCHER.compare(MATCHER.prepare(probe), MATCHER.prepare(reference))


def two_impressions(seed, field=None):
    """Return two impressions of one finger, each with lost and spurious minutiae."""
    rng = np.random.default_rng(seed)
    every = spread_points(rng, PRINT_SIZE)
    shared, own = PRINT_SIZE * 2 // 3, PRINT_SIZE // 6
    b = jittered(rng, every[:, np.r_[0:shared, shared + own : PRINT_SIZE]], 1.5, 0.05)
    return tuple(
        template_of(side, quality=rng.integers(0, 101, side.shape[1]), field=field)
        for side in (every[:, : shared + own].copy(), b)
    )


@given(templates(), templates())
def test_any_two_templates_compare_the_same_both_ways(a, b):
    forth, back = verify(a, b), verify(b, a)
    assert_mirrored(compare(a, b), compare(b, a))
    assert (forth.score, forth.match) == (back.score, back.match)
    assert 0 <= forth.score <= 100
    assert 0 <= forth.agreement <= 1
    assert 0 <= forth.overlap <= 1
    assert 0 <= forth.rms_px < math.inf
    assert forth.match or forth.reason
    i, j = forth.pairs.T.tolist()
    assert i == sorted(set(i))
    assert len(set(j)) == len(j)
    assert all(0 <= k < len(a.minutiae) for k in i)
    assert all(0 <= k < len(b.minutiae) for k in j)
    if forth.transform:
        # Where too few pairs can tell it, the scale is that of the resolutions.
        assert 0.75 < forth.transform.scale * a.dpi / b.dpi < 1.35
        assert len(forth.pairs)
    else:
        # What the prefilter rejects has a score, though a low one.
        assert (forth.match, len(forth.pairs)) == (False, 0)
        assert forth.score < 10


@given(
    seeds,
    st.sampled_from(FIELDS),
    st.sampled_from(FIELDS),
    st.sampled_from([ALWAYS, -6.0, NEVER]),
    st.sampled_from([-math.inf, 2.0, math.inf]),
    st.sampled_from([-1.0, 0.05, math.inf]),
)
def test_prints_compare_the_same_both_ways_whatever_the_thresholds(
    seed, field, other, refine, confident, relaxation
):
    a, b = two_impressions(seed, field)
    if other is FIELDS[2]:
        noise = np.random.default_rng(seed).integers(0, 2**63, other.ridges.shape, np.uint64)
        other = replace(other, ridges=other.ridges ^ (noise & (noise >> np.uint64(7))))
    b = replace(b, field=other)
    with scored_by(some_weights(refine, 0.4, REJECTING, confident, relaxation, apart=3.0)):
        forth, back = compare(a, b), compare(b, a)
    assert_mirrored(forth, back)
    assert forth.reason == back.reason
    assert len(compare(a, b).pairs) >= PRINT_SIZE // 3


NARROW = np.array([[50.0, 70, 60], [-50, -50, -70], [1, 1, 1], [0, 0, 0]])
WIDE = np.array([[50.0, 350, 200], [-50, -50, -350], [1, 1, 1], [0, 0, 0]])
"""Three minutiae close together have no neighbours like those of three far apart."""


@given(templates())
@example(Template(Minutiae(x=[0, 0, 0], y=[0.0625, 0, 4e-10], angle=[0, 0, 0]), 400, 400, dpi=100))
def test_any_template_is_aligned_with_itself_by_the_identity(template):
    found = compare(template, template)
    n = len(template.minutiae)
    assert (found.transform is None) == (n == 0)
    if n:
        assert found.pairs.tolist() == [[i, i] for i in range(n)]
        assert found.transform.matrix == pytest.approx(np.eye(2, 3), abs=1e-6)
        assert found.agreement == 1.0


@given(seeds, st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_pairs_are_found_where_the_skin_is_distorted(seed, towards, turn):
    """By 14 px within 60 px, which no similarity transform follows, but the mesh does."""
    rng = np.random.default_rng(seed)
    a = spread_points(rng, 40, 20.0, size=360.0)
    b = jittered(rng, moved(distorted(a, towards), turn, 30 + 10j), 1.0, 0.05)
    with scored_by(some_weights()):
        found = compare(template_of(a), template_of(b))
    assert found.pairs.tolist() == [[i, i] for i in range(40)]
    assert found.transform.rotation == pytest.approx(-turn, abs=0.2)


@given(seeds, st.sampled_from(FIELDS))
@settings(max_examples=20)
def test_a_print_matches_itself_without_moving(seed, field):
    size = 300.0 if COMPILED else 125.0  # as far as the fields reach
    points = along(spread_points(np.random.default_rng(seed), PRINT_SIZE, size=size))
    template = template_of(points, field=field)
    found = verify(template, template)
    assert (found.match, found.reason) == (True, "")
    assert found.agreement == found.overlap == 1.0
    assert found.transform.matrix == pytest.approx(np.eye(2, 3), abs=1e-9)
    assert found.rms_px < 1e-9


@given(
    seeds,
    st.floats(-math.pi, math.pi),
    st.tuples(st.floats(-300, 300), st.floats(-300, 300)),
    st.booleans(),
)
def test_pairs_do_not_change_where_a_template_is_turned_and_shifted(seed, turn, shift, probe_moves):
    """Which side is taken first depends on the content; where it stays, so do the pairs.

    Without a field, the region is the hull on a grid, which changes when it is turned: the choice
    between hypotheses must not depend on it, so that there is but one.
    """
    a, b = two_impressions(seed)
    move = Similarity(1.0, turn, *shift)
    moved_sides = (turned_on_screen(a, move), b) if probe_moves else (a, turned_on_screen(b, move))
    before, after = ([MATCHER.prepare(t) for t in sides] for sides in ((a, b), moved_sides))
    assume((before[0].key < before[1].key) == (after[0].key < after[1].key))
    with scored_by(some_weights(relaxation=math.inf)):
        found, again = MATCHER.compare(*before), MATCHER.compare(*after)
    assert again.pairs.tolist() == found.pairs.tolist()
    assert again.rms_px == pytest.approx(found.rms_px, abs=1e-3)
    expected = found.transform.apply(a.minutiae.xy)
    expected = expected if probe_moves else move.apply(expected)
    assert again.transform.apply(moved_sides[0].minutiae.xy) == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize("n", [3, 5, 18])
@pytest.mark.parametrize(("probe_dpi", "reference_dpi"), [(500, 1000), (1000, 500), (569, 250)])
def test_scale_is_that_of_the_resolutions(n, probe_dpi, reference_dpi):
    points = spread_points(np.random.default_rng(n), n, 25.0)
    probe = template_of(points, probe_dpi)
    reference = template_of(moved(points, 0.5, 60 - 40j), reference_dpi)
    found = compare(probe, reference).transform
    assert found.scale == pytest.approx(reference_dpi / probe_dpi, rel=1e-4)
    assert found.rotation == pytest.approx(-0.5, abs=1e-4)
    assert found.apply(probe.minutiae.xy) == pytest.approx(reference.minutiae.xy, abs=1e-2)


@given(seeds)
@settings(max_examples=10)
def test_pairs_on_one_spot_do_not_set_the_scale(seed):
    """Of 24 minutiae within a tenth of a pixel, and the same within 5 px: scale stays 1."""
    rng = np.random.default_rng(seed)
    angle, place = rng.uniform(0, 2 * np.pi, 24), rng.uniform(0, 1, (2, 24))
    directions = np.array([np.cos(angle), np.sin(angle)])
    narrow, wide = (
        template_of(np.vstack([100 + size * place[:1], -100 - size * place[1:], directions]))
        for size in (0.1, 5.0)
    )
    with scored_by(some_weights()):
        found = compare(narrow, wide)
    assert len(found.pairs) >= MIN_PAIRS_FOR_SCALE
    assert found.transform.scale == 1.0


def test_a_crowd_of_minutiae_is_compared_by_its_best_in_bounded_time():
    rng = np.random.default_rng(3)
    points = spread_points(rng, 2000, 0.0, 3000.0)
    quality = rng.integers(0, 50, 2000)
    best = np.sort(rng.permutation(2000)[:200])
    quality[best] = 90
    template = template_of(points, quality=quality)
    start = time.perf_counter()
    found = compare(template, template)
    assert time.perf_counter() - start < SECONDS_FOR_A_CROWD
    assert found.pairs.tolist() == [[i, i] for i in best.tolist()]


def some_print(seed, n=15, field=None):
    return template_of(spread_points(np.random.default_rng(seed), n, 20.0), field=field)


RIDGES_ALONE = Template(Minutiae.empty(), 300, 300, field=even_field())


@pytest.mark.parametrize(
    ("probe", "reference"),
    [
        (template_of(NARROW), template_of(WIDE)),
        (EMPTY, some_print(1)),
        (some_print(1), some_print(2, 2)),
        (RIDGES_ALONE, some_print(1)),
    ],
)
def test_too_little_to_compare_is_named(probe, reference):
    found = compare(probe, reference)
    assert found.reason == "no minutiae of the two prints can be paired"
    assert (found.similarity, found.transform, len(found.pairs)) == (0.0, None, 0)


def test_a_small_common_region_is_named():
    """The lower right corner of one print is the upper left corner of the other."""
    points = spread_points(np.random.default_rng(5), 12, 12.0, size=96.0)
    sides = moved(points, 0.0, 304 - 304j), points
    found = compare(*(template_of(side, field=even_field()) for side in sides))
    assert found.reason.startswith("too little agrees")
    assert "12 pairs among the 24 minutiae" in found.reason
    assert "(6% of the smaller print)" in found.reason
    assert found.overlap == pytest.approx((96 / 400) ** 2, abs=0.01)
    assert found.transform.tx == pytest.approx(-304, abs=1e-3)


def test_ridges_that_disagree_lower_the_similarity():
    points = along(spread_points(np.random.default_rng(5), 15, 20.0), 0.65)
    fields = [striped_field(side=20, orientation=turn) for turn in (0.4, 0.9)]
    straight, across = (template_of(points, field=field) for field in fields)
    with scored_by(some_weights()):
        found, same = (compare(straight, other) for other in (across, straight))
    assert found.overlap == 1.0
    assert found.similarity < same.similarity


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


@given(seeds)
@settings(max_examples=15 if COMPILED else 3)
def test_prints_that_the_prefilter_rejects_are_aligned_to_explain_it(seed):
    """Whichever of the two is the probe; the similarity is that of `compare` all the same."""
    rng = np.random.default_rng(seed)
    one, other = (MATCHER.prepare(template_of(spread_points(rng, 30))) for _ in range(2))
    with scored_by(some_weights(NEVER, prefilter=(1e9, 0.0, 1e9))):
        found, back = MATCHER.compare(one, other), MATCHER.compare(other, one)
        explained = MATCHER.explain(one, other, found)
        turned = MATCHER.explain(other, one, back)
    with scored_by(some_weights(NEVER)):
        aligned = MATCHER.compare(one, other)
    assert found.transform is None
    assert "too little in common" in found.reason
    assert (back.similarity, back.reason) == (found.similarity, found.reason)
    if aligned.transform is None:
        assert explained.reason == found.reason
        return
    assert explained.pairs.tolist() == aligned.pairs.tolist()
    assert explained.transform.matrix == pytest.approx(aligned.transform.matrix, abs=1e-9)
    assert explained.similarity == found.similarity
    assert "pairs among" in explained.reason
    assert turned.reason == explained.reason
    assert_mirrored(explained, turned)
