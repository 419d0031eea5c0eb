"""Prepared prints: points, qualities, neighbourhoods, areas, key and bit descriptors."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    any_points,
    even_field,
    on_pixels,
    plane,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
    two_impressions,
)

from fpmatch.matching.constants import MAX_ENCODED, NOWHERE, ORIENTATIONS
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.prints.prepare import prefilter_of, prepare, score_descriptors
from fpmatch.matching.prints.prepared import codes_at, orientation_codes, qualities
from fpmatch.matching.reference.neighbourhood import neighbourhoods
from fpmatch.matching.reference.prefilter import descriptor_similarity
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from fpmatch.templates.plausibility import FEW_MINUTIAE, LEAST_EVEN, LEAST_EVEN_OF_FEW


@pytest.mark.parametrize("dpi", [250.0, 500.0, 1000.0])
def test_points_are_at_500_dpi_with_y_pointing_up(dpi):
    minutiae = Minutiae(x=[10, 30], y=[20, 40], angle=[0, np.pi / 2], quality=[100, 25])
    prepared = prepare(Template(minutiae, 100, 100, dpi))
    zoom = 500 / dpi
    assert prepared.to_500dpi == zoom
    assert prepared.points[:2].T.tolist() == [[10 * zoom, -20 * zoom], [30 * zoom, -40 * zoom]]
    assert pytest.approx(np.eye(2), abs=1e-7) == prepared.points[2:].T
    assert prepared.quality.tolist() == [1.0, 0.25]
    assert prepared.index.tolist() == [0, 1]


@given(seeds, st.integers(0, 40))
def test_qualities_that_are_none_or_of_few_minutiae_are_the_usual_one(seed, n):
    rng = np.random.default_rng(seed)
    quality = rng.choice([0, 40, 99, 100], n, p=rng.dirichlet(np.full(4, 0.3))).astype(np.uint8)
    squares = quality.astype(float) ** 2
    least = LEAST_EVEN if n >= FEW_MINUTIAE else LEAST_EVEN_OF_FEW
    some = quality.any() and not (quality == 100).all()
    even = some and np.minimum(squares, squares.mean()).mean() >= least * squares.mean()
    expected = quality / 100 if even else np.full(n, 0.7)
    assert qualities(quality, 0.7).tolist() == expected.tolist()


def test_a_neighbour_stands_in_the_frame_of_its_minutia():
    x, y, angle = np.array([[10, 10, 90], [10, 40, 180], [-10, 10, 90]]).T
    minutiae = Minutiae(x=x, y=-y, angle=np.radians(angle))
    made = prepare(Template(minutiae, 100, 100)).neighbourhoods
    # From the first minutia, which looks up: 30 px ahead, and 20 px to the left.
    assert made.count.tolist() == [2, 2, 2]
    left, ahead = made.frame[0, :4, :2].T
    assert left == pytest.approx([0, 20, 1, 0], abs=1e-5)
    assert ahead == pytest.approx([30, 0, 0, 1], abs=1e-5)
    precision = [(USUAL.tolerance_px + USUAL.tolerance_per_px * d) ** -2 for d in (20, 30)]
    assert made.frame[0, 4, :2] == pytest.approx(precision)


@given(seeds, st.integers(1, 14), st.floats(0.1, 1))
def test_neighbourhoods_agree_with_the_reference(seed, size, second):
    crowded = on_pixels(np.random.default_rng(seed), 40, side=4)
    for points in (any_points(seed), crowded):
        p = MatchParameters(neighbours=size, second_ring_weight=second)
        prepared = prepare(template_of(points), p)
        made, expected = prepared.neighbourhoods, neighbourhoods(prepared.points, p)
        assert made.count.tolist() == expected.count.tolist()
        assert np.isfinite(made.frame).all()
        assert made.frame[:, :5] == pytest.approx(expected.frame[:, :5], rel=1e-4, abs=1e-4)
        weights, others = (np.rint(100 * of.frame[:, 5]) for of in (made, expected))
        assert abs(weights - others).max(initial=0) <= 1
        assert (np.float32(weights / 100.0) == made.frame[:, 5]).all()


@given(seeds)
def test_the_area_of_a_field_is_the_box_around_its_mask(seed):
    rng = np.random.default_rng(seed)
    mask = rng.random(tuple(rng.integers(1, 9, 2).tolist())) < rng.choice([0.0, 0.05, 0.3])
    ridges = rng.integers(0, 2**64, mask.shape, np.uint64)
    orientation = np.where(mask, rng.uniform(0, np.pi, mask.shape), np.nan)
    field = RidgeField(20.0, orientation, mask, ridges)
    region = prepare(Template(Minutiae.empty(), 60, 40, 1000.0, field)).region
    rows, columns = np.nonzero(mask)
    first = (int(rows.min()), int(columns.min())) if len(rows) else (0, 0)
    shape = (int(np.ptp(rows)) + 1, int(np.ptp(columns)) + 1) if len(rows) else (0, 0)
    assert (region.first_row, region.first_column) == first
    box = tuple(slice(at, at + size) for at, size in zip(first, shape, strict=True))
    assert region.code.tolist() == orientation_codes(orientation[box], mask[box]).tolist()
    assert region.ridges.tolist() == field.ridges[box].tolist()
    assert region.ridges.flags.c_contiguous
    assert (region.step, region.has_flow) == (10.0, True)
    assert (region.inside, region.area) == (len(rows), 100.0 * len(rows))


def test_every_orientation_has_a_code_and_comes_back_from_it():
    orientation = np.linspace(0, np.pi, 5001)[None]
    mask = np.ones(orientation.shape, bool)
    mask[0, 2500] = False
    codes = orientation_codes(orientation, mask)
    assert set(codes.ravel().tolist()) == set(range(ORIENTATIONS + 1))
    known = (codes - 1.0) * np.pi / ORIENTATIONS
    off = np.angle(np.exp(2j * (orientation - known)))[mask]
    assert np.abs(off).max() <= np.pi / ORIENTATIONS + 1e-9
    assert orientation_codes(known, mask).tolist() == codes.tolist()


def test_region_without_a_field_is_the_hull_of_the_minutiae():
    corners = np.array([[20.0, 180, 180, 20], [-20, -20, -180, -180], [1, 1, 1, 1], [0, 0, 0, 0]])
    region = prepare(template_of(corners)).region
    assert not region.has_flow
    assert region.code.max() == 1
    assert codes_at(region, np.array([25 - 25j, 100 - 100j, 175 - 175j])).all()
    assert not codes_at(region, np.array([2 - 100j, 100 - 250j, 250 - 100j, -9 + 9j])).any()
    assert region.area == pytest.approx(160**2, rel=0.25)
    beside = prepare(template_of(corners * [[-1], [1], [1], [1]])).region
    assert beside.inside == beside.area == 0  # outside of the image


@pytest.mark.parametrize("reach", [2e4, 1e9])
def test_far_minutiae_take_no_more_memory(reach):
    minutiae = Minutiae(x=[0, reach, 10], y=[0, 10, reach], angle=[0, 0, 0])
    p = MatchParameters(max_hull_cells=64)
    prepared = prepare(Template(minutiae, 100, 100), p)
    assert max(prepared.region.code.shape) <= p.max_hull_cells + 1
    assert codes_at(prepared.region, plane(prepared.points)).all()


def test_key_differs_where_anything_that_is_compared_does():
    points = spread_points(np.random.default_rng(1), 5)
    one_cell = np.zeros((2, 2), np.float32)
    mask = np.array([[False, False], [False, True]])
    fields = (
        None,
        even_field(),
        even_field(orientation=0.7),
        # the same orientations: other ridges, none in sight, and none known, as above
        striped_field(side=25),
        striped_field(9.0, side=25),
        replace(even_field(), ridges=np.zeros((25, 25))),
        # two regions of one cell with the same centre
        RidgeField(16.0, one_cell, mask),
        RidgeField(48.0, one_cell[:1, :1], mask[1:, 1:]),
    )
    others = [template_of(points, field=field) for field in fields]
    others += [template_of(points[:, ::-1].copy()), template_of(points[:, 1:].copy())]
    others.append(template_of(points, quality=np.full(5, 99)))
    keys = [prepare(template).key for template in others]
    assert len(set(keys)) == len(others)
    assert prepare(template_of(points)).key == keys[0]


def impressions(seed):
    """Return impressions of one finger and of others, with and without ridges."""
    sides = [
        *two_impressions(seed),
        any_points(seed + 1),
        # a cell has one word however many neighbours are in it; those far away have none
        np.array([[0, 40, 41, 42], [0, 3, 4, 5], [1, 1, 1, 1], [0, 0, 0, 0]], float),
        np.array([[0, 140.0, 0], [0, 0, 135.0], [1, 1, 1], [0, 0, 0]]),
    ]
    flows = (striped_field(orientation=0.3), striped_field(orientation=1.9), None)
    return [template_of(side, field=flows[k % 3]) for k, side in enumerate(sides)]


def assert_same_both_ways(a, b):
    """Hold the scores of two prints equal, whichever is in the tables, and to the reference."""
    expected = descriptor_similarity(a, b)
    assert score_descriptors(prefilter_of(a), b) == expected
    tables = prefilter_of(a)
    tables.load(b.xy, b.direction_bin, b.neighbour_bits, b.orientation_bins, b.has_flow)
    arrays = a.xy, a.direction_bin, a.neighbour_bits, a.orientation_bins, a.has_flow
    assert tables.score(0, len(a.xy), *arrays, True) == expected


@given(seeds, templates())
def test_prints_have_in_common_what_the_reference_finds(seed, any_template):
    """Whichever print is in the tables, and whatever was in them before."""
    prints = [prepare(one).bit_descriptors for one in (*impressions(seed), any_template)]
    for a, b in product(prints, prints):
        assert_same_both_ways(a, b)


@pytest.mark.parametrize("n", [0, 1, 65, 130])
def test_crowds_are_compared_by_their_best(n):
    rng = np.random.default_rng(n)
    quality = rng.integers(1, 100, n)
    points = spread_points(rng, n, 9.0, 400.0)
    crowd = prepare(template_of(points, size=500, quality=quality)).bit_descriptors
    coded = (crowd.neighbour_bits != NOWHERE).any(axis=1)
    assert coded.sum() <= MAX_ENCODED
    if n > MAX_ENCODED:
        assert quality[coded].min() >= np.sort(quality)[-MAX_ENCODED]
        assert score_descriptors(prefilter_of(crowd), crowd) > 100
    few = prepare(template_of(spread_points(rng, 30), size=500)).bit_descriptors
    assert_same_both_ways(crowd, few)
    assert_same_both_ways(crowd, crowd)
