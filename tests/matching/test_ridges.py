"""Ridges of aligned prints, and prints that they align: as in the reference."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from kernel_cases import IDENTITY, impose
from matching_prints import (
    NO_POINTS,
    moved,
    packed_pictures,
    plane,
    seeds,
    spread_points,
    striped_field,
    template_of,
)

from fpmatch.image.extract import extract
from fpmatch.matching.matchers.unit_circle import MATCHER, view_of
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline._kernels._alignment_kernel import Aligner
from fpmatch.matching.pipeline._kernels._relaxation_kernel import Relaxation
from fpmatch.matching.pipeline._kernels._ridge_kernel import RidgeCorrelator
from fpmatch.matching.pipeline._kernels._ridge_search_kernel import RidgeSearch
from fpmatch.matching.prints.prepare import prepare
from fpmatch.matching.reference.alignment import Pairing
from fpmatch.matching.reference.neighbourhood import local_similarity
from fpmatch.matching.reference.ridges import compare_ridges, drift_of, ridge_map, search_by_ridges
from fpmatch.templates.minutiae import RidgeField
from research.partial_templates import window

SAMPLES = Path(__file__).parents[2] / "sample_data"
MOST_CELLS = 16384
ROOM = 20  # for pairs


def compared_by_reference(a, b, partner, transform):
    """Return correlation and cells as the reference finds them."""
    move, drift = (complex(*transform[:2]), complex(*transform[2:])), None
    if (partner >= 0).any():
        mesh, predicted, _, _ = Pairing(a.points, b.points, partner, np.ones(len(a)), move).mesh
        drift = drift_of(a.region, mesh, predicted, move)
    return compare_ridges(a.region, b.region, move, drift)


def compared(a, b, transform=IDENTITY, partner=None):
    """Return correlation and cells as the kernel finds them; no minutiae paired if not given."""
    pairs = np.full(len(a), -1, np.int32) if partner is None else partner
    correlator = RidgeCorrelator(len(b))
    mesh = impose(Aligner(len(a), len(b), USUAL), a, b, pairs, transform).mesh
    cells = correlator.compare(view_of(a), view_of(b), mesh, *transform)
    return correlator.correlation, cells


def bare(field):
    """Return a print without minutiae."""
    return prepare(template_of(NO_POINTS, field=field))


def field_of(step, picture, mask=None):
    """Return a field that shows a picture of ridges, 8 pixels a cell along either side."""
    ridges = packed_pictures(picture)
    mask = np.ones(ridges.shape, bool) if mask is None else mask
    return RidgeField(step, np.zeros(mask.shape, np.float32), mask, ridges)


def some_field(rng, most=6):
    """Return a field with holes, of ridges that are stripes or no ridges at all but noise."""
    rows, columns = rng.integers(2, most + 1, 2)
    top, left = rng.integers(0, 2, 2)
    mask = np.zeros((top + rows, left + columns), bool)
    mask[top:, left:] = rng.random((rows, columns)) < rng.choice([0.7, 0.95, 1.0])
    v, u = np.mgrid[: 8 * len(mask), : 8 * mask.shape[1]]
    turn = rng.uniform(0, np.pi)
    stripes = np.sin((u * np.cos(turn) + v * np.sin(turn)) * 2 * np.pi / rng.uniform(4, 12)) > 0
    picture = stripes ^ (rng.random(stripes.shape) < rng.choice([0.0, 0.1, 0.5]))
    return field_of(float(rng.choice([8.0, 16.0, 21.7, 64.0, 64.0])), picture, mask)


def some_case(seed):
    """Return two prints, pairs of their minutiae, and a transform, of a copy or of another."""
    rng = np.random.default_rng(seed)
    points = spread_points(rng, int(rng.integers(0, 8)), size=100.0)
    turn, scale = rng.uniform(-0.4, 0.4) * rng.integers(0, 2), rng.uniform(0.94, 1.06)
    shift = complex(*rng.uniform(-12, 12, 2)) * rng.choice([0.3, 1.0, 4.0])
    field = some_field(rng)
    other = field if rng.random() < 0.5 else some_field(rng)
    points_b = moved(points, turn, shift, scale)
    points_b[:2] += rng.uniform(-8, 8, (2, points.shape[1]))
    a, b = (prepare(template_of(side, field=f)) for side, f in ((points, field), (points_b, other)))
    paired = rng.random(points.shape[1]) < 0.7
    partner = np.where(paired, np.arange(points.shape[1]), -1).astype(np.int32)
    linear = scale * np.exp(1j * turn)
    return a, b, partner, (float(linear.real), float(linear.imag), shift.real, shift.imag)


@given(seeds)
def test_comparison_agrees_with_the_reference(seed):
    a, b, partner, transform = some_case(seed)
    found, cells = compared(a, b, transform, partner)
    expected, expected_cells = compared_by_reference(a, b, partner, transform)
    assert cells == expected_cells
    assert found == pytest.approx(expected, abs=1e-12)
    assert -1.0 <= found <= 1.0


@given(seeds, st.booleans())
def test_the_mean_of_the_map_is_the_correlation(seed, swapped):
    a, b, partner, transform = some_case(seed)
    assume((partner >= 0).any())
    move = complex(*transform[:2]), complex(*transform[2:])
    found = ridge_map(
        a, b, Pairing(a.points, b.points, partner, np.ones(len(a)), move), swapped=swapped
    )
    correlation, cells = compared_by_reference(a, b, partner, transform)
    if not cells:
        assert found is None
        return
    assert len(found.correlation) == len(found.xy) == cells
    assert found.mean == pytest.approx(correlation, rel=1e-12)
    if swapped:
        place = (found.xy + 0.5) / found.cell_px - 0.5
        assert place == pytest.approx(place.round())
        first = a.region.first_column, a.region.first_row
        column, row = (place.round() - first).astype(int).T
        assert a.region.code[row, column].all()


def test_without_ridges_there_is_nothing_to_compare():
    points = spread_points(np.random.default_rng(1), 9)
    field = striped_field()
    fields = field, replace(field, ridges=None), None
    shown, *others = (prepare(template_of(points, field=one)) for one in fields)
    assert compared(shown, shown)[1] == 100
    for a, b in itertools.permutations((shown, *others), 2):
        assert compared(a, b, partner=np.arange(9, dtype=np.int32)) == (0.0, 0)


@pytest.mark.parametrize("step", [1e-300, 1e-9, 1e9, 1e300])
def test_cells_of_very_different_sizes_are_compared_or_not(step):
    usual = bare(striped_field(side=3))
    strange = replace(usual, region=replace(usual.region, step=step))
    for a, b in itertools.product((usual, strange), repeat=2):
        correlation, cells = compared(a, b)
        assert -1.0 <= correlation <= 1.0
        assert 0 <= cells <= 9


far_and_near = st.floats(-3, 3) | st.floats() | st.sampled_from([1.0, -1.0, 0.0, -16.0, 2**27])


@given(st.tuples(*[far_and_near] * 4))
def test_any_transform_is_survived(transform):
    print_ = bare(striped_field(side=4, step=4.0))
    correlation, cells = compared(print_, print_, transform)
    assert -1.0 <= correlation <= 1.0
    assert 0 <= cells <= 16


@pytest.mark.parametrize(
    ("rows", "columns"), [(124, 124), (2044, 4), (4, 2044), (124, 125), (2045, 4), (4, 2045)]
)
def test_too_large_a_region_is_not_compared(rows, columns):
    """Empty but for four cells in each of two corners, so that little is to be done."""
    mask = np.zeros((rows, columns), bool)
    mask[:2, :2] = mask[-2:, -2:] = True
    ridges = np.random.default_rng(3).integers(0, 2**63, mask.shape, np.uint64)
    large = bare(RidgeField(16.0, np.zeros(mask.shape), mask, ridges))
    compares = (rows + 4) * (columns + 4) <= MOST_CELLS
    assert compared(large, large) == ((1.0, np.count_nonzero(mask)) if compares else (0.0, 0))
    assert compared(bare(striped_field(side=2)), large)[1] == (4 if compares else 0)


def searched(a, b, parameters=USUAL, *, every=True, search=None):
    """Return the pairs that the kernel finds among all, or among the candidates; and these."""
    search = search or RidgeSearch(parameters)
    relaxation = Relaxation(parameters, len(a), len(b))
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    count = relaxation.load(a.points, len(a), b.points, len(b), similarity)
    found = search.search(view_of(a), view_of(b), relaxation, every, RidgeCorrelator(40))
    candidates = np.array(relaxation.first[:count]), np.array(relaxation.second[:count])
    return [(search.first[k], search.second[k]) for k in range(found)], candidates


def pair_transform(small, i, large, j):
    """Return rotation and shift of the transform that maps minutia i to minutia j."""
    own, other = small.points, large.points
    turn = (other[2, j] + 1j * other[3, j]) * (own[2, i] - 1j * own[3, i])
    return turn, other[0, j] + 1j * other[1, j] - turn * (own[0, i] + 1j * own[1, i])


def some_print(rng, size, side):
    """Return a print of stripes that run nearly one way, with minutiae anywhere on it."""
    way = rng.uniform(0, np.pi)
    row, column = np.mgrid[: 8 * side, : 8 * side] + 0.5
    across = column * np.sin(way) + row * np.cos(way)
    stripes = np.cos(2 * np.pi * across / 5.0) > 0
    ridges = packed_pictures(stripes ^ (rng.random(stripes.shape) < 0.05))
    orientation = (way + rng.normal(0, 0.2, (side, side))) % np.pi
    mask = rng.random((side, side)) < 0.9
    field = RidgeField(16.0, orientation.astype(np.float32), mask, ridges)
    return prepare(template_of(spread_points(rng, size, 5.0, 16.0 * side), field=field))


@pytest.fixture(scope="module")
def whole(fingers):
    return extract(fingers[0])


@given(seeds)
@example(59487)  # under one pair the prints have less in common than is required
def test_search_agrees_with_the_reference(seed):
    rng = np.random.default_rng(seed)
    a = some_print(rng, int(rng.integers(0, 6)), int(rng.integers(2, 7)))
    b = some_print(rng, int(rng.integers(0, 9)), int(rng.integers(4, 12)))
    p = MatchParameters(
        ridge_trials=int(rng.integers(1, 12)),
        ridge_starts=int(rng.integers(1, 4)),
        least_flow=float(rng.choice([-1.0, 0.3, 0.8])),
    )
    found, _ = searched(a, b, p)
    assert found == search_by_ridges(a, b, None, p)
    if a.region.area != b.region.area:  # of equal ones, the first is looked for
        assert [(j, i) for i, j in searched(b, a, p)[0]] == found


@pytest.mark.parametrize("seed", range(6))
def test_part_is_found_where_it_was_cut_out(whole, seed):
    """The pair found first maps the part, turned and moved, to where it was."""
    a, b = prepare(window(whole, 110.0, np.random.default_rng(seed))), prepare(whole)
    pairs, _ = searched(a, b)
    if not len(a):
        assert pairs == []
        return
    turn, shift = pair_transform(a, pairs[0][0], b, pairs[0][1])
    assert abs(turn - 1) < 0.2
    middle = plane(a.points).mean()
    assert abs(turn * middle + shift - middle) < 8


def test_single_minutia_and_the_ridges_round_it_are_a_match(whole):
    """With ridges on 12 by 12 cells one minutia is enough to tell where they lie."""
    inside = np.hypot(whole.minutiae.x - 140, whole.minutiae.y - 150).argmin()
    rows, columns = np.indices(whole.field.mask.shape)
    near = (abs(rows - 9) < 5) & (abs(columns - 8) < 5)
    field = replace(whole.field, mask=whole.field.mask & near)
    part = replace(whole, minutiae=whole.minutiae.take(np.array([inside])), field=field)
    found = MATCHER.compare(MATCHER.prepare(part), MATCHER.prepare(whole))
    assert len(found.pairs) == 1
    assert abs(found.transform.tx) + abs(found.transform.ty) < 1e-6


@given(seeds)
def test_larger_prints_are_looked_for_among_the_candidates(seed):
    """The one pair under which the ridges agree best, as the search of all pairs would find it."""
    rng = np.random.default_rng(seed)
    a, b = some_print(rng, 9, 8), some_print(rng, 12, 9)
    p = MatchParameters(
        ridge_candidates=int(rng.integers(1, 9)),
        candidate_flow=float(rng.choice([-1.0, 0.5])),
        candidate_value=float(rng.choice([0.0, 1.0, 3.0])),
    )
    search = RidgeSearch(p)
    found, candidates = searched(a, b, p, every=False, search=search)
    assert found == search_by_ridges(a, b, candidates, p)
    # and what was searched before leaves no trace
    assert searched(a, b, p, search=search)[0] == searched(a, b, p)[0]
