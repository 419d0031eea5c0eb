"""The default matcher: symmetric, invariant, robust to any template, clear about a non-match."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
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

from fpmatch.matching.align import alignments, identity_alignment
from fpmatch.matching.compare import align
from fpmatch.matching.local import local_similarity
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.matchers.unit_circle import MATCHER, MIN_PAIRS_FOR_SCALE
from fpmatch.matching.packed_templates import PackedTemplates
from fpmatch.matching.result import Comparison, Matcher, Verification
from fpmatch.matching.score import evidence_scorer, gather_evidence
from fpmatch.matching.verify import verify
from fpmatch.minutiae import Minutiae, RidgeField, Template
from fpmatch.pointset.similarity import Similarity

EXAMPLES = 50 if COMPILED else 15
SECONDS_FOR_A_CROWD = 5.0 if COMPILED else 90.0
PRINT_SIZE = 30 if COMPILED else 18
CELL_PX = 16.0  # of the region that stands for a print without a field
FIELDS = (None, even_field(side=20), striped_field(side=20 if COMPILED else 8))
"""No field, one that does not show its ridges, and one that does."""


def compare(probe: Template, reference: Template) -> Comparison:
    matcher: Matcher = MATCHER
    return matcher.compare(matcher.prepare(probe), matcher.prepare(reference))


def two_impressions(seed: int, field: RidgeField | None = None) -> tuple[Template, Template]:
    """Return two impressions of one finger, each with lost and spurious minutiae."""
    rng = np.random.default_rng(seed)
    every = spread_points(rng, PRINT_SIZE)
    shared = PRINT_SIZE * 2 // 3
    own = (PRINT_SIZE - shared) // 2
    a = every[:, : shared + own].copy()
    b = jittered(rng, every[:, np.r_[0:shared, shared + own : PRINT_SIZE]], 1.5, 0.05)
    first, second = (
        template_of(side, quality=rng.integers(0, 101, side.shape[1]), field=field)
        for side in (a, b)
    )
    return first, second


def assert_mirrored(forth: Verification, back: Verification) -> None:
    """Hold two results to being each other with the sides exchanged."""
    assert forth.score == back.score
    assert forth.match == back.match
    assert forth.agreement == back.agreement
    assert forth.overlap == back.overlap
    assert {*map(tuple, forth.pairs.tolist())} == {(j, i) for i, j in back.pairs.tolist()}
    assert (forth.transform is None) == (back.transform is None)
    if forth.transform and back.transform:
        corners = np.array([[0, 0], [forth.probe.width, 0], [0, forth.probe.height]])
        again = back.transform.inverse().apply(corners)
        assert again == pytest.approx(forth.transform.apply(corners), rel=1e-6, abs=1e-6)


def test_it_is_the_default() -> None:
    assert DEFAULT_MATCHER == MATCHER.name == "unit-circle"
    assert get_matcher("unit-circle") is MATCHER


@given(templates(), templates())
@settings(max_examples=EXAMPLES)
def test_any_two_templates_compare_the_same_both_ways(a: Template, b: Template) -> None:
    forth, back = verify(a, b), verify(b, a)
    assert_mirrored(forth, back)
    assert 0 <= forth.score <= 100
    assert 0 <= forth.agreement <= 1
    assert 0 <= forth.overlap <= 1
    assert math.isfinite(forth.rms_px)
    assert forth.rms_px >= 0
    assert forth.match or forth.reason
    if forth.transform:
        # Where too few pairs can tell it, the scale is that of the resolutions.
        assert 0.75 < forth.transform.scale * a.dpi / b.dpi < 1.35
        assert len(forth.pairs)
    else:
        # What the prefilter rejects has a score, though a low one.
        assert (forth.match, len(forth.pairs)) == (False, 0)
        assert forth.score < 10


@given(templates(), st.sampled_from([100.0, 500.0, 569.0, 4000.0]), seeds)
@settings(max_examples=EXAMPLES)
def test_a_shuffled_template_at_another_resolution_compares_the_same_both_ways(
    template: Template, dpi: float, seed: int
) -> None:
    order = np.random.default_rng(seed).permutation(len(template.minutiae))
    shuffled = Template(template.minutiae.take(order), 400, 400, dpi, template.field)
    assert_mirrored(verify(template, shuffled), verify(shuffled, template))


@given(seeds, st.sampled_from(FIELDS))
@settings(max_examples=EXAMPLES)
def test_impressions_of_one_finger_compare_the_same_both_ways(
    seed: int, field: RidgeField | None
) -> None:
    a, b = two_impressions(seed, field)
    forth = verify(a, b)
    assert_mirrored(forth, verify(b, a))
    assert len(forth.pairs) >= PRINT_SIZE // 3


@given(
    seeds,
    st.sampled_from(FIELDS),
    st.sampled_from(FIELDS),
    st.sampled_from([ALWAYS, -6.0, NEVER]),
    st.sampled_from([-math.inf, 2.0, math.inf]),
    st.sampled_from([-1.0, 0.05, math.inf]),
)
@settings(max_examples=EXAMPLES)
def test_prints_compare_the_same_both_ways_whatever_the_thresholds(
    seed: int,
    field: RidgeField | None,
    other: RidgeField | None,
    refine: float,
    confident: float,
    relaxation: float,
) -> None:
    """To the last bit; the transform back is the inverse."""
    a, b = two_impressions(seed, field)
    b = replace(b, field=other)
    with scored_by(some_weights(refine, 0.4, REJECTING, confident, relaxation, apart=3.0)):
        forth, back = compare(a, b), compare(b, a)
    for name in ("similarity", "agreement", "overlap", "reason"):
        assert getattr(forth, name) == getattr(back, name)
    assert forth.pairs.tolist() == sorted(back.pairs[:, ::-1].tolist())
    assert (forth.transform is None) == (back.transform is None)
    if forth.transform and back.transform:
        assert back.transform.inverse().matrix == pytest.approx(
            forth.transform.matrix, rel=1e-9, abs=1e-9
        )


@given(templates(), templates())
@settings(max_examples=EXAMPLES)
def test_pairs_are_one_to_one_in_range_and_in_order(a: Template, b: Template) -> None:
    pairs = compare(a, b).pairs
    assert pairs.dtype == np.int32
    assert pairs.shape[1] == 2
    i, j = pairs.T.tolist()
    assert i == sorted(set(i))
    assert len(set(j)) == len(j)
    assert all(0 <= k < len(a.minutiae) for k in i)
    assert all(0 <= k < len(b.minutiae) for k in j)


@given(seeds, st.sampled_from(FIELDS), st.sampled_from([ALWAYS, NEVER]))
@settings(max_examples=20)
def test_the_alignment_is_that_of_the_greatest_sum(
    seed: int, field: RidgeField | None, refine: float
) -> None:
    """Of the refined hypotheses, or of the coarse ones where none passes the refine threshold."""
    sides = (MATCHER.prepare(side) for side in two_impressions(seed, field))
    a, b = sorted(sides, key=lambda side: side.key)
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    weights = some_weights(refine)
    scorer = evidence_scorer(len(b), weights)
    alignment, expected = max(
        (
            (found, gather_evidence(a, b, found, similarity, scorer))
            for found in alignments(a.points, b.points, similarity, coarse=refine == NEVER)
        ),
        key=lambda row: row[1].total,
    )
    aligned = align(a, b, evidence_scorer(len(b), weights))
    assert aligned is not None
    if a.region.ridges is not None and aligned[1].total > expected.total:
        return  # found by the ridges
    assert aligned[0].partner.tolist() == alignment.partner.tolist()
    assert aligned[0].transform.tolist() == alignment.transform.tolist()
    assert aligned[1].total == expected.total
    with scored_by(weights):
        assert MATCHER.compare(a, b).similarity == expected.similarity
        assert MATCHER.compare(b, a).similarity == expected.similarity


def test_a_print_is_aligned_with_itself_by_the_identity() -> None:
    print_ = MATCHER.prepare(some_print(3))
    aligned = align(print_, print_, evidence_scorer(len(print_), some_weights()))
    assert aligned is not None
    identity = identity_alignment(print_.points)
    assert aligned[0].transform.tolist() == identity.transform.tolist()
    assert aligned[0].partner.tolist() == identity.partner.tolist()


NARROW = np.array([[50.0, 70, 60], [-50, -50, -70], [1, 1, 1], [0, 0, 0]])
WIDE = np.array([[50.0, 350, 200], [-50, -50, -350], [1, 1, 1], [0, 0, 0]])
"""Three minutiae close together have no neighbours like those of three far apart."""


def test_nothing_is_aligned_where_nothing_is_similar() -> None:
    a, b = (MATCHER.prepare(template_of(side)) for side in (NARROW, WIDE))
    assert align(a, b) is None


@given(seeds, st.floats(-8, 12))
@settings(max_examples=20)
def test_ridges_compare_the_same_both_ways_whatever_the_refine_threshold(
    seed: int, refine: float
) -> None:
    rng = np.random.default_rng(seed)
    field = FIELDS[2]
    assert field is not None
    assert field.ridges is not None
    noise = rng.integers(0, 2**63, field.ridges.shape, np.uint64)
    a, b = two_impressions(seed, field)
    b = replace(b, field=replace(field, ridges=field.ridges ^ (noise & (noise >> np.uint64(7)))))
    with scored_by(some_weights(refine)):
        forth, back = compare(a, b), compare(b, a)
    assert forth.similarity == back.similarity
    assert forth.overlap == back.overlap
    assert forth.pairs.tolist() == sorted(back.pairs[:, ::-1].tolist())


def test_ridges_that_agree_raise_the_similarity() -> None:
    a, b = two_impressions(5, FIELDS[2])
    with scored_by(some_weights(ALWAYS)):
        with_ridges = compare(a, b)
    with scored_by(some_weights(NEVER, confident=-math.inf)):  # nor looked for by the ridges
        on_minutiae = compare(a, b)
    assert with_ridges.similarity > on_minutiae.similarity


@given(seeds)
@settings(max_examples=10)
def test_the_same_templates_give_the_same_result(seed: int) -> None:
    """Whatever the thread has compared in between."""
    a, b = two_impressions(seed)
    first = compare(a, b)
    compare(*two_impressions(seed + 1, FIELDS[2]))
    again = compare(a, b)
    assert first.similarity == again.similarity
    assert first.transform == again.transform
    assert first.pairs.tolist() == again.pairs.tolist()


@given(templates())
@settings(max_examples=EXAMPLES)
def test_any_template_is_aligned_with_itself_by_the_identity(template: Template) -> None:
    found = compare(template, template)
    n = len(template.minutiae)
    if n == 0:
        assert found.transform is None
        return
    assert found.pairs.tolist() == [[i, i] for i in range(n)]
    assert found.transform is not None
    assert found.transform.matrix == pytest.approx(np.eye(2, 3), abs=1e-6)
    assert found.agreement == 1.0


@given(seeds, st.sampled_from(FIELDS))
@settings(max_examples=20)
def test_a_print_matches_itself_without_moving(seed: int, field: RidgeField | None) -> None:
    template = template_of(spread_points(np.random.default_rng(seed), PRINT_SIZE), field=field)
    found = verify(template, template)
    assert found.match
    assert found.reason == ""
    assert found.agreement == found.overlap == 1.0
    assert found.pairs.tolist() == [[i, i] for i in range(PRINT_SIZE)]
    assert found.transform is not None
    assert found.transform.matrix == pytest.approx(np.eye(2, 3), abs=1e-9)
    assert found.rms_px < 1e-9


@given(seeds, st.floats(-math.pi, math.pi), st.floats(-400, 400), st.floats(-400, 400))
@settings(max_examples=EXAMPLES)
def test_a_moved_print_is_found_where_it_was_moved(
    seed: int, turn: float, tx: float, ty: float
) -> None:
    template = template_of(spread_points(np.random.default_rng(seed), 15, 20.0))
    move = Similarity(1.0, turn, tx, ty)
    found = compare(template, turned_on_screen(template, move))
    assert found.transform is not None
    xy = template.minutiae.xy
    assert found.transform.apply(xy) == pytest.approx(move.apply(xy), abs=1e-2)
    assert found.pairs.tolist() == [[i, i] for i in range(15)]


@given(
    seeds,
    st.floats(-math.pi, math.pi),
    st.tuples(st.floats(-300, 300), st.floats(-300, 300)),
    st.booleans(),
)
@settings(max_examples=EXAMPLES)
def test_pairs_do_not_change_where_a_template_is_turned_and_shifted(
    seed: int, turn: float, shift: tuple[float, float], probe_moves: bool
) -> None:
    """Which side is taken first depends on the content; where it stays, so do the pairs.

    Without a field, the region is the hull on a grid, which changes when it is turned: the choice
    between hypotheses must not depend on it, so that there is but one.
    """
    a, b = two_impressions(seed)
    turned = turned_on_screen(a if probe_moves else b, Similarity(1.0, turn, *shift))
    before = [MATCHER.prepare(t) for t in (a, b)]
    after = [MATCHER.prepare(t) for t in ((turned, b) if probe_moves else (a, turned))]
    assume((before[0].key < before[1].key) == (after[0].key < after[1].key))
    with scored_by(some_weights(relaxation=math.inf)):
        found, again = MATCHER.compare(*before), MATCHER.compare(*after)
    assert again.pairs.tolist() == found.pairs.tolist()
    assert again.rms_px == pytest.approx(found.rms_px, abs=1e-3)
    assert found.transform is not None
    assert again.transform is not None
    move = Similarity(1.0, turn, *shift)
    xy = a.minutiae.xy
    if probe_moves:
        assert again.transform.apply(move.apply(xy)) == pytest.approx(
            found.transform.apply(xy), abs=0.01
        )
    else:
        expected = move.apply(found.transform.apply(xy))
        assert again.transform.apply(xy) == pytest.approx(expected, abs=0.01)


@given(seeds, st.integers(0, 20), st.integers(0, 20))
@settings(max_examples=EXAMPLES)
def test_a_shift_by_whole_cells_leaves_the_similarity_as_it_is(seed: int, u: int, v: int) -> None:
    """Which side is taken first depends on the content; where it stays, so does the result."""
    a, b = (turned_on_screen(t, Similarity(tx=64, ty=64)) for t in two_impressions(seed))
    shifted = turned_on_screen(b, Similarity(tx=u * CELL_PX, ty=v * CELL_PX))
    p, q, r = (MATCHER.prepare(t) for t in (a, b, shifted))
    assume((p.key < q.key) == (p.key < r.key))
    before, after = MATCHER.compare(p, q), MATCHER.compare(p, r)
    assert after.similarity == pytest.approx(before.similarity, rel=1e-4)
    assert after.pairs.tolist() == before.pairs.tolist()
    assert after.rms_px == pytest.approx(before.rms_px, abs=1e-4)


@given(seeds, st.floats(-math.pi, math.pi))
@settings(max_examples=EXAMPLES)
def test_a_turn_changes_the_similarity_by_no_more_than_its_region_is_coarse(
    seed: int, turn: float
) -> None:
    """Without a field the region is the hull on a grid, which falls anew when it is turned."""
    a, b = two_impressions(seed)
    middle = np.array([[150.0, 150.0]])
    shift = (600.0 - Similarity(1.0, turn).apply(middle))[0]
    turned = turned_on_screen(b, Similarity(1.0, turn, *shift.tolist()))
    with scored_by(some_weights()):
        before, after = compare(a, b), compare(a, turned)
    assert abs(math.log(after.similarity / before.similarity)) < 0.7
    assert abs(len(after.pairs) - len(before.pairs)) <= 2


@pytest.mark.parametrize("n", [3, 4, 5, 8, 18])
@pytest.mark.parametrize(("probe_dpi", "reference_dpi"), [(500, 1000), (1000, 500), (569, 250)])
def test_scale_is_that_of_the_resolutions(n: int, probe_dpi: float, reference_dpi: float) -> None:
    points = spread_points(np.random.default_rng(n), n, 25.0)
    turned = moved(points, 0.5, 60 - 40j)
    probe, reference = template_of(points, probe_dpi), template_of(turned, reference_dpi)
    found = compare(probe, reference)
    assert found.transform is not None
    assert found.transform.scale == pytest.approx(reference_dpi / probe_dpi, rel=1e-4)
    assert found.transform.rotation == pytest.approx(-0.5, abs=1e-4)
    assert found.transform.apply(probe.minutiae.xy) == pytest.approx(
        reference.minutiae.xy, abs=1e-2
    )


def test_residual_is_in_pixels_of_the_reference() -> None:
    rng = np.random.default_rng(4)
    points = spread_points(rng, 18)
    worn = jittered(rng, points, 2.0, 0.05)
    plain, fine = (compare(template_of(points), template_of(worn, dpi)) for dpi in (500.0, 1000.0))
    assert 1 < plain.rms_px < 5
    assert fine.rms_px == pytest.approx(2 * plain.rms_px, rel=1e-3)


@pytest.mark.parametrize("n", [3, 5])
def test_minutiae_on_one_spot_turn_by_their_directions(n: int) -> None:
    angle = np.array([0.0, 0.8, 1.9, 3.3, 5.0])[:n]  # no turn makes them the same again
    points = np.vstack([np.full(n, 90.0), np.full(n, -70.0), np.cos(angle), np.sin(angle)])
    turned = moved(points, 0.4, 200 - 100j)
    found = compare(template_of(points), template_of(turned, 1000.0))
    assert len(found.pairs) == n
    assert found.transform is not None
    assert found.transform.scale == 2.0
    assert found.transform.rotation == pytest.approx(-0.4, abs=1e-5)


@given(seeds)
@settings(max_examples=10)
def test_pairs_on_one_spot_do_not_set_the_scale(seed: int) -> None:
    """Of 24 minutiae within a tenth of a pixel, and the same within 5 px: scale stays 1."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, 24)
    directions = np.array([np.cos(angle), np.sin(angle)])
    place = rng.uniform(0, 1, (2, 24))
    narrow, wide = (
        np.vstack([100 + size * place[:1], -100 - size * place[1:], directions])
        for size in (0.1, 5.0)
    )
    with scored_by(some_weights()):
        found = compare(template_of(narrow), template_of(wide))
    assert len(found.pairs) >= MIN_PAIRS_FOR_SCALE
    assert found.transform is not None
    assert found.transform.scale == 1.0


def test_a_crowd_of_minutiae_is_compared_by_its_best_in_bounded_time() -> None:
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


def some_print(seed: int, n: int = 15, field: RidgeField | None = None) -> Template:
    return template_of(spread_points(np.random.default_rng(seed), n, 20.0), field=field)


EMPTY = Template(Minutiae.empty(), 300, 300)
RIDGES_ALONE = Template(Minutiae.empty(), 300, 300, field=even_field())


@pytest.mark.parametrize(
    ("probe", "reference", "reason"),
    [
        (EMPTY, some_print(1), "the probe has no ridges"),
        (some_print(1), EMPTY, "the reference has no ridges"),
        (EMPTY, EMPTY, "the probe has no ridges; the reference has no ridges"),
        (RIDGES_ALONE, some_print(1), "the probe has too few minutiae (0)"),
        (some_print(1), some_print(2, 2), "the reference has too few minutiae (2)"),
        (
            some_print(2, 1),
            EMPTY,
            "the probe has too few minutiae (1); the reference has no ridges",
        ),
    ],
)
def test_too_little_to_compare_is_named(probe: Template, reference: Template, reason: str) -> None:
    found = compare(probe, reference)
    assert found.reason == reason
    assert (found.similarity, found.transform, len(found.pairs)) == (0.0, None, 0)
    assert verify(probe, reference, threshold=0).reason == reason


def test_that_nothing_can_be_paired_is_named() -> None:
    found = compare(template_of(NARROW), template_of(WIDE))
    assert found.reason == "no minutiae of the two prints can be paired"
    assert (found.similarity, found.transform, len(found.pairs)) == (0.0, None, 0)


def test_prints_that_the_prefilter_rejects_are_named() -> None:
    with scored_by(some_weights(prefilter=(1e9, 0.0, 1e9))):
        found = compare(some_print(1), some_print(2))
    assert "too little in common" in found.reason
    assert (found.transform, len(found.pairs)) == (None, 0)


def test_a_small_common_region_is_named() -> None:
    """The lower right corner of one print is the upper left corner of the other."""
    points = spread_points(np.random.default_rng(5), 12, 12.0, size=96.0)
    corner = moved(points, 0.0, 304 - 304j)
    field = even_field()
    found = compare(template_of(corner, field=field), template_of(points, field=field))
    assert found.reason.startswith("the common region is small (6% of the smaller print): 12 pairs")
    assert found.overlap == pytest.approx((96 / 400) ** 2, abs=0.01)
    assert found.transform is not None
    assert found.transform.tx == pytest.approx(-304, abs=1e-3)


def test_ridges_that_disagree_are_named() -> None:
    points = spread_points(np.random.default_rng(5), 15, 20.0)
    fields = (striped_field(side=20, orientation=turn) for turn in (0.4, 0.4 + math.pi / 2))
    along, across = (template_of(points, field=field) for field in fields)
    assert across.field is not None
    plain = replace(across, field=replace(across.field, ridges=None))
    with scored_by(some_weights()):
        found, same, not_compared = (compare(along, other) for other in (across, along, plain))
    assert found.reason.startswith("the ridges disagree under the best transform: 15 pairs")
    assert found.overlap == 1.0
    assert found.similarity < same.similarity
    assert not_compared.reason.startswith(
        "too few minutiae agree under the best transform: 15 pairs"
    )


@pytest.mark.parametrize("field", FIELDS)
def test_too_few_minutiae_that_agree_are_named(field: RidgeField | None) -> None:
    """Two prints that share four minutiae of fifteen, and the run of their ridges."""
    rng = np.random.default_rng(5)
    a, b = (spread_points(rng, PRINT_SIZE, 15.0) for _ in range(2))
    b[:, :4] = a[:, :4]
    found = verify(template_of(a, field=field), template_of(b, field=field), threshold=99.9)
    assert not found.match
    assert "too few minutiae agree under the best transform: " in found.reason
    assert f"{len(found.pairs)} pair" in found.reason


def test_impostors_do_not_match() -> None:
    for seed in range(20 if COMPILED else 5):
        found = verify(some_print(seed, PRINT_SIZE), some_print(seed + 100, PRINT_SIZE))
        assert not found.match
        assert found.reason


def degenerate_prints() -> dict[str, Template]:
    """Return prints that hardly are any, each with a name."""
    rng = np.random.default_rng(8)
    many = 2000 if COMPILED else 30
    usual = spread_points(rng, 12)
    flat = usual.copy()
    flat[2:] = [[1.0], [0.0]]
    made = {f"{n} minutiae": usual[:, :n] for n in range(5)}
    made["directions 0"] = flat
    made["4 of directions 0"] = flat[:, :4]
    for n in (3, 4, 12):
        line = usual[:, :n].copy()
        line[0], line[1] = 20.0 * np.arange(1, n + 1), -100.0
        made[f"{n} on a row"] = line
        slanted = line.copy()
        slanted[1] = -line[0]
        made[f"{n} on a slanted line"] = slanted
        flat_line = line.copy()
        flat_line[2:] = [[1.0], [0.0]]
        made[f"{n} on a row, directions 0"] = flat_line
        made[f"{n} on a column"] = np.vstack([-line[1], -line[0], line[2:]])
        spot = usual[:, :n].copy()
        spot[:2] = [[90.0], [-70.0]]
        made[f"{n} on one spot"] = spot
        made[f"{n} times the same"] = np.repeat(usual[:, :1], n, axis=1)
    made["pairs that coincide"] = np.repeat(usual[:, :6], 2, axis=1)
    angle = np.arange(12) * np.pi / 6
    circle = np.array([150 + 90 * np.cos(angle), -150 + 90 * np.sin(angle)])
    made["on a circle"] = np.vstack([circle, np.cos(angle), np.sin(angle)])
    row, column = np.divmod(np.arange(25), 5)
    grid = np.array([60.0 + 40 * column, -60.0 - 40 * row, np.ones(25), np.zeros(25)])
    made["on a grid, directions 0"] = grid
    made[f"{many} minutiae"] = spread_points(rng, many, 0.0, 1500.0)
    made[f"{many} minutiae, directions 0"] = made[f"{many} minutiae"].copy()
    made[f"{many} minutiae, directions 0"][2:] = [[1.0], [0.0]]
    made[f"{many} on one spot"] = np.repeat(usual[:, :1], many, axis=1)
    made["far outside the image"] = usual + np.array([[1e6], [1e6], [0], [0]])
    return {name: template_of(np.ascontiguousarray(points)) for name, points in made.items()}


DEGENERATE = degenerate_prints()


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("name", DEGENERATE)
def test_any_degenerate_print_has_an_answer_or_a_reason(
    name: str, field: RidgeField | None
) -> None:
    """Against each other one and itself, one by one and of many, both ways."""
    one = MATCHER.prepare(replace(DEGENERATE[name], field=field))
    every = 1 if COMPILED else 11
    others = [MATCHER.prepare(other) for other in [*DEGENERATE.values()][::every]]
    others += [one, MATCHER.prepare(some_print(4, field=field))]
    found = []
    with scored_by(some_weights()):
        for other in others:
            forth, back = MATCHER.compare(one, other), MATCHER.compare(other, one)
            assert forth.similarity == back.similarity
            assert forth.pairs.tolist() == sorted(back.pairs[:, ::-1].tolist())
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
        assert MATCHER.similarities(one, PackedTemplates.pack(others)).tolist() == found
    if len(one) == 0:
        assert not any(found)
    elif len(one) >= 3:
        assert found[-2] > 0
