"""Segments: the mate has most votes, kernels do as their numpy forms, damage is refused."""

import json

import numpy as np
import numpy_forms
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    any_points,
    jittered,
    moved,
    spread_points,
    striped_field,
    template_of,
)

from fpmatch.errors import MatcherError
from fpmatch.gallery.index._term_kernel import describe_edges, measure_curvatures
from fpmatch.gallery.index._vote_kernel import add_similarity, count_votes
from fpmatch.gallery.index.embedding import LENGTH
from fpmatch.gallery.index.model import MODEL_FILE, TERMS, IndexModel, index_model
from fpmatch.gallery.index.segment import COLUMNS, TABLE, Segment
from fpmatch.gallery.index.terms import UNKNOWN, curvatures, edges_of, print_terms, probe_terms
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.templates.minutiae import RidgeField


def segment_of(templates, first=0):
    numbers = range(first, first + len(templates))
    return Segment.build(numbers, numbers, [*map(MATCHER.prepare, templates)])


def gallery(seed, count=40, n=30):
    rng = np.random.default_rng(seed)
    return [template_of(spread_points(rng, n)) for _ in range(count)]


@given(st.integers(0, 2**32 - 1))
def test_terms_are_those_of_the_numpy_form(seed):
    print_ = MATCHER.prepare(template_of(any_points(seed)))
    edges = np.ascontiguousarray(edges_of(print_), np.int32).reshape(-1, 2)
    border = np.radians([-35, -15, 0, 15, 35])
    curvature = np.random.default_rng(seed).choice(
        [*border, *border + 1e-9, -1.5, 1.5, 4], len(edges)
    )
    made, expected = np.empty((2, 2, len(edges)), np.uint16)
    describe_edges(print_.points, edges, curvature, *made)
    numpy_forms.describe_edges(print_.points, edges, curvature, *expected)
    assert made.tolist() == expected.tolist()
    assert not len(edges) or made[0].max() < TERMS


@given(st.integers(0, 2**32 - 1))
def test_curvatures_are_those_of_the_numpy_form(seed):
    rng = np.random.default_rng(seed)
    points = any_points(seed)
    edges = rng.integers(0, points.shape[1], (30 * (points.shape[1] > 0), 2)).astype(np.int32)
    code = rng.integers(0, 256, rng.integers(0, 12, 2)).astype(np.uint8)
    code[rng.random(code.shape) < 0.2] = 0
    angle = 2 * np.pi / 255 * (np.arange(256) - 1)
    doubled = np.stack([np.cos(angle), np.sin(angle)]) * (np.arange(256) > 0)
    cells = float(rng.choice([4.0, 16.0, 33.3])), int(rng.integers(-3, 9)), int(rng.integers(0, 9))
    made, expected = np.empty((2, len(edges)))
    measure_curvatures(points, edges, code, doubled, *cells, made)
    numpy_forms.measure_curvatures(points, edges, code, doubled, *cells, expected)
    assert made == pytest.approx(expected, abs=1e-9)


def whorl(centre_px, side=25, step=16.0):
    """Return a field of circles around a place, right and down from the corner."""
    row, column = (np.mgrid[:side, :side] + 0.5) * step
    orientation = np.arctan2(row - centre_px[1], column - centre_px[0])
    orientation = np.mod(np.pi / 2 - orientation, np.pi).astype(np.float32)
    return RidgeField(step, orientation, np.ones((side, side), bool), None)


@pytest.mark.parametrize("distance", [60.0, 100.0, 140.0])
def test_the_curvature_is_the_difference_of_the_orientations_on_both_sides(distance):
    centre, middle = np.array([200.0, 200.0]), np.array([200.0 + distance, 200.0])
    ends = middle[:, None] + [[0.0, 20.0], [0.0, 0.0]]  # along the radius: circles cross it
    points = np.vstack([ends * [[1], [-1]], [[1, 1], [0, 0]]])
    print_ = MATCHER.prepare(template_of(points, field=whorl(centre)))
    seen, back = curvatures(print_, np.array([[0, 1], [1, 0]], np.int32))
    expected = 2 * np.arctan2(28.0, distance + 10)
    assert seen == pytest.approx(expected, abs=0.03)
    assert back == pytest.approx(-seen)
    points[:2] = [[200 + distance] * 2, [-190, -210]]  # circles run along it
    along = MATCHER.prepare(template_of(points, field=whorl(centre)))
    assert curvatures(along, np.array([[0, 1]], np.int32)) == pytest.approx(0, abs=0.03)


def test_where_the_orientation_is_not_known_the_curvature_is_not():
    points = spread_points(np.random.default_rng(3), 12)
    without = MATCHER.prepare(template_of(points))
    edges = edges_of(without)
    assert (curvatures(without, edges) == UNKNOWN).all()
    small = MATCHER.prepare(template_of(points, field=striped_field(side=6)))  # of 96 px
    found = curvatures(small, edges)
    assert 0 < (found == UNKNOWN).sum() < len(edges)
    assert found[found != UNKNOWN] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("fields", [(0, 0), (0, 1), (1, 0)])
def test_a_mate_is_found_whether_or_not_its_orientation_is_known(fields):
    rng = np.random.default_rng(8)
    finger = spread_points(rng, 30)
    of_probe, of_mate = (whorl((150.0, 150.0)) if known else None for known in fields)
    mate = template_of(jittered(rng, finger, 1.5, 0.05), field=of_mate)
    segment = segment_of([*gallery(5), mate])
    votes = segment.votes(probe_terms(MATCHER.prepare(template_of(finger, field=of_probe))))
    assert votes.argmax() == len(segment) - 1


def test_ridges_that_bend_alike_add_votes():
    rng = np.random.default_rng(9)
    finger = spread_points(rng, 20)
    same, other = (whorl((x, 150.0)) for x in (150.0, 1500.0))
    prints = [template_of(jittered(rng, finger, 1.5, 0.05), field=f) for f in (same, other)]
    votes = segment_of(prints).votes(probe_terms(MATCHER.prepare(template_of(finger, field=same))))
    assert votes[0] > 1.3 * votes[1]


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.1, 0.5, 50.0]))
def test_votes_are_those_of_the_numpy_form(seed, budget):
    rng = np.random.default_rng(seed)
    templates = [template_of(any_points(int(k))) for k in rng.integers(0, 2**32, 12)]
    segment = segment_of(templates)
    probe = probe_terms(MATCHER.prepare(templates[0]), budget)
    looked_up = probe.term, probe.weight, probe.reading, probe.shift
    room = np.empty(len(probe.term), np.uint32), np.empty(TABLE, np.uint32)
    made, expected = np.zeros((2, len(segment)), np.uint16)
    factor = rng.integers(0, 1025, len(segment)).astype(np.uint16)
    count_votes(segment.term_start, segment.posting, *looked_up, factor, *room, made)
    numpy_forms.count_votes(
        segment.term_start, segment.posting, *looked_up, factor, *room, expected
    )
    assert made.tolist() == expected.tolist()


@given(st.integers(0, 2**32 - 1), st.sampled_from([0, 60_000]))
def test_similarities_are_those_of_the_numpy_form(seed, most):
    rng = np.random.default_rng(seed)
    embedding = rng.integers(-127, 128, (9, LENGTH), np.int8)
    embedding[-1] = 127
    made = rng.integers(0, most + 1, 9).astype(np.uint16)
    expected = made.copy()
    add_similarity(embedding, embedding[0].astype(np.int16), made)
    numpy_forms.add_similarity(embedding, embedding[0].astype(np.int16), expected)
    assert made.tolist() == expected.tolist()
    assert made[0] > 6000


@pytest.mark.parametrize("turn_deg", [0, 31, 90, 180, 275])
def test_the_mate_has_most_votes_however_it_is_turned(turn_deg):
    rng = np.random.default_rng(turn_deg)
    finger = spread_points(rng, 30)
    turned = moved(finger[:, 4:], np.radians(turn_deg), 20 - 9j)
    mate = template_of(jittered(rng, turned, 2.0, 0.05))
    others = gallery(5)
    segment = segment_of([*others, mate])
    votes = segment.votes(probe_terms(MATCHER.prepare(template_of(finger))))
    assert votes.argmax() == len(others)
    assert votes[-1] > 1.5 * votes[:-1].max()


def test_the_lookups_are_those_of_the_greatest_gain_within_the_budget():
    probe = MATCHER.prepare(gallery(3, 1)[0])
    few, many = probe_terms(probe, 0.1), probe_terms(probe, 5.0)
    assert 0 < len(few.term) < len(many.term)
    assert set(few.term.tolist()) <= set(many.term.tolist())
    assert (np.diff(many.term) >= 0).all()
    model = index_model()
    assert model.share[few.term].sum() * model.edges <= 2 * 0.1 * len(probe)  # without ridges
    assert set(print_terms(probe)[0].tolist()) <= set(many.term.tolist())


def test_a_model_is_what_its_document_says():
    document = json.loads(MODEL_FILE.read_bytes())
    assert index_model().lengths.tolist() == document["lengths"]
    for wrong in ({}, {**document, "lengths": [1.0]}, {**document, "edges": -1}):
        with pytest.raises(MatcherError, match="no model"):
            IndexModel.of_document(wrong)


@pytest.mark.parametrize("n", [0, 1, 2, 3, 200, 255])
def test_prints_of_any_size(n):
    rng = np.random.default_rng(n)
    sizes = [n if COMPILED else min(n, 60), 12, 0]
    templates = [template_of(spread_points(rng, k, 9.0, 400.0), size=500) for k in sizes]
    segment = segment_of(templates)
    for template in templates:
        assert segment.votes(probe_terms(MATCHER.prepare(template))).shape == (3,)
    again = Segment.of_arrays(segment.arrays())
    assert again.arrays().keys() == segment.arrays().keys() == COLUMNS.keys()
    assert len(segment_of([])) == 0


def changed(arrays, name, at, value):
    array = arrays[name].copy()
    array[at] = value
    return {**arrays, name: array}


def test_damaged_arrays_are_refused():
    whole = segment_of(gallery(8, 4, 12)).arrays()
    assert set(whole) == set(COLUMNS)
    last = len(whole["posting"])
    some = int(np.flatnonzero(np.diff(whole["term_start"]))[0]) + 1
    for name, at, value in (
        ("term_start", 0, 1),
        ("term_start", -1, last - 1),
        ("term_start", -1, last + 1),
        ("term_start", some, 2**32 - 1),
        ("posting", last - 1, 4 << 16),
        ("minutiae_start", 0, 1),
        ("minutiae_start", 1, -1),
        ("minutiae_start", 2, 2**62),
        ("orientation_bins", 7, 255),
        ("has_flow", 0, 2),
    ):
        with pytest.raises(MatcherError, match="damaged"):
            Segment.of_arrays(changed(whole, name, at, value))
    for name in ("number", "size", "term_start", "posting", "minutiae_start", "has_flow", "xy"):
        with pytest.raises(MatcherError, match="damaged"):
            Segment.of_arrays({**whole, name: whole[name][:-1]})
    twice = {**whole, "term_start": np.repeat([0, last], [TERMS, 1]).astype(np.uint32)}
    with pytest.raises(MatcherError, match="damaged"):
        Segment.of_arrays(twice)  # prints of a list do not ascend
