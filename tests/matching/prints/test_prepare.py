from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from matching_prints import (
    cells_of,
    contains,
    even_field,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
)

from fpmatch.matching.prints.parameters import NeighbourhoodParameters, PreparationParameters
from fpmatch.matching.prints.prepare import prepare
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

USUAL_QUALITY = PreparationParameters().usual_quality


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


@pytest.mark.parametrize(
    ("quality", "prepared"),
    [
        *((none, [USUAL_QUALITY] * 6) for none in (None, [100] * 6, [0] * 6)),
        ([0] * 2 + [1] * 4, [0.0] * 2 + [0.01] * 4),
        ([0] * 3 + [1] * 3, [USUAL_QUALITY] * 6),
        ([1] * 5 + [25], [USUAL_QUALITY] * 6),
        ([100] * 5 + [99], [1.0] * 5 + [0.99]),
    ],
)
def test_qualities_that_are_none_or_of_no_print_are_the_usual_one(quality, prepared):
    quality = None if quality is None else np.array(quality)
    template = template_of(spread_points(np.random.default_rng(6), 6), quality=quality)
    assert prepare(template).quality.tolist() == prepared


def test_of_too_many_minutiae_the_best_take_part_in_their_order():
    quality = np.array([10, 90, 50, 90, 50, 70])
    points = spread_points(np.random.default_rng(1), 6)
    parameters = PreparationParameters(max_minutiae=4), NeighbourhoodParameters(neighbours=3)
    prepared = prepare(template_of(points, quality=quality), *parameters)
    assert prepared.index.tolist() == [1, 2, 3, 5]
    assert prepared.points[0] == pytest.approx(points[0, [1, 2, 3, 5]], abs=1e-4)
    assert prepared.neighbourhoods.count.tolist() == [3] * 4
    assert prepared.neighbourhoods.frame.shape == (4, 6, 3)


@given(templates())
def test_any_template_can_be_prepared(template):
    prepared = prepare(template)
    ridges = None if template.field is None else template.field.ridges
    assert (prepared.region.ridges is None) == (ridges is None)
    assert len(prepared) == len(template.minutiae) == prepared.points.shape[1]
    assert np.isfinite(prepared.points).all()
    assert np.isfinite(prepared.neighbourhoods.frame).all()
    assert cells_of(prepared.region).shape == (4, prepared.region.inside)
    assert prepared.region.has_flow == (template.field is not None)


def test_region_of_a_field_is_its_mask_and_flow():
    mask = np.array([[True, False, False], [True, True, False]])
    orientation = np.array([[0.0, 9.0, 9.0], [np.pi / 4, np.pi / 2, 9.0]])
    template = Template(Minutiae.empty(), 60, 40, 1000.0, RidgeField(20.0, orientation, mask))
    region = prepare(template).region
    assert (region.step, region.has_flow, region.area) == (10.0, True, 300.0)
    assert cells_of(region)[:2].T.tolist() == [[5, -5], [5, -15], [15, -15]]
    assert pytest.approx(np.array([[1, 0], [0, 1], [-1, 0]]), abs=0.02) == cells_of(region)[2:].T
    x, y = np.array([5.0, 15, 15, -1, 35, 5]), np.array([-5.0, -15, -5, -5, -5, -25])
    assert contains(region, x, y).tolist() == [True, True, False, False, False, False]


def test_ridges_are_those_of_the_cells_in_the_box_around_the_mask():
    mask = np.zeros((5, 6), bool)
    mask[1, 4] = mask[3, 2] = mask[3, 3] = True
    ridges = np.arange(1, 31, dtype=np.uint64).reshape(mask.shape) << np.uint64(59)
    field = RidgeField(16.0, np.zeros(mask.shape), mask, ridges)
    region = prepare(Template(Minutiae.empty(), 60, 40, 1000.0, field)).region
    assert (region.first_row, region.first_column) == (1, 2)
    assert region.ridges.dtype == np.uint64
    assert region.ridges.flags.c_contiguous
    assert region.ridges.tolist() == (ridges * mask)[1:4, 2:5].tolist()
    assert region.code.shape == region.ridges.shape


@given(seeds)
def test_the_box_leaves_out_empty_rows_and_columns_alone(seed):
    rng = np.random.default_rng(seed)
    mask = rng.random(tuple(rng.integers(1, 9, 2).tolist())) < rng.choice([0.0, 0.05, 0.3])
    region = prepare(Template(Minutiae.empty(), 9, 9, field=RidgeField(9, mask * 1.0, mask))).region
    rows, columns = np.nonzero(mask)
    first = (int(rows.min()), int(columns.min())) if len(rows) else (0, 0)
    shape = (int(np.ptp(rows)) + 1, int(np.ptp(columns)) + 1) if len(rows) else (0, 0)
    assert (region.first_row, region.first_column) == first
    assert region.code.shape == shape
    assert region.inside == len(rows)


def test_region_without_a_field_is_the_hull_of_the_minutiae():
    corners = np.array([[20.0, 180, 180, 20], [-20, -20, -180, -180], [1, 1, 1, 1], [0, 0, 0, 0]])
    region = prepare(template_of(corners)).region
    assert not region.has_flow
    assert not cells_of(region)[2:].any()
    inside = np.array([25.0, 100, 175]), np.array([-25.0, -100, -175])
    outside = np.array([2.0, 100, 250]), np.array([-100.0, -250, -100])
    assert contains(region, *inside).all()
    assert not contains(region, *outside).any()
    assert region.area == pytest.approx(160**2, rel=0.25)


def test_minutiae_outside_the_image_have_no_region():
    points = spread_points(np.random.default_rng(1), 9) * [[-1], [1], [1], [1]]
    prepared = prepare(template_of(points))
    assert prepared.region.inside == prepared.region.area == 0
    assert not contains(prepared.region, *prepared.points[:2]).any()


@pytest.mark.parametrize("reach", [2e4, 1e9])
def test_far_minutiae_take_no_more_memory(reach):
    minutiae = Minutiae(x=[0, reach, 10], y=[0, 10, reach], angle=[0, 0, 0])
    p = PreparationParameters(max_hull_cells=64)
    prepared = prepare(Template(minutiae, 100, 100), p)
    assert max(prepared.region.code.shape) <= p.max_hull_cells + 1
    assert contains(prepared.region, *prepared.points[:2]).all()


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
