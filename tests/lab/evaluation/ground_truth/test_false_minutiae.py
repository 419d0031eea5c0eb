import numpy as np
import pytest
from truth_files import truth_of

from fpmatch.lab.evaluation.ground_truth.false_minutiae import (
    Cause,
    distance_to_border,
    false_minutiae,
)
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

TRUE = Minutiae(x=[100, 150], y=[100, 100], angle=[1.0, 1.0])


def template(*xy_angle, dpi=500.0):
    """Return a template of 200 x 200 px whose ridges end at x = 160."""
    mask = np.zeros((10, 10), bool)
    mask[:, :8] = True
    x, y, angle = np.array(xy_angle, dtype=np.float64).reshape(-1, 3).T
    field = RidgeField(20.0, np.zeros(mask.shape, np.float32), mask)
    return Template(Minutiae(x, y, angle), 200, 200, dpi, field)


def cause_of(x, y, angle=1.0, hidden=None):
    """Return the cause of one minutia beside one that is right."""
    found = template((100, 100, 1.0), (x, y, angle))
    return false_minutiae(found, truth_of(TRUE, hidden=hidden)).get(1)


def test_what_is_right_or_finds_an_invisible_minutia_is_not_false():
    assert cause_of(141, 100) is None
    assert false_minutiae(template(), truth_of(TRUE)) == {}
    assert false_minutiae(template((100, 100, 1.0)), truth_of(TRUE, [False, True])) == {}


def test_a_true_minutia_that_points_elsewhere():
    assert cause_of(141, 100, 4.0) is Cause.DIRECTION
    assert cause_of(105, 100, 4.0) is Cause.NEAR_ANOTHER  # the true one there is taken


@pytest.mark.parametrize(("x", "y"), [(60, 17), (17, 60), (60, 184), (145, 150), (170, 60)])
def test_near_the_border_of_the_image_or_of_its_ridges(x, y):
    assert cause_of(x, y) is Cause.BORDER


def test_where_no_ridges_can_be_seen():
    assert cause_of(60, 60, hidden=[[60, 80]]) is Cause.NO_RIDGES
    assert cause_of(60, 60, hidden=[[60, 150]]) is Cause.OTHER


def test_near_another_that_was_extracted():
    assert cause_of(100, 109.5) is Cause.NEAR_ANOTHER
    assert cause_of(100, 110.5) is Cause.OTHER
    both = false_minutiae(template((60, 60, 0), (64, 60, 3)), truth_of(TRUE))
    assert both == {0: Cause.NEAR_ANOTHER, 1: Cause.NEAR_ANOTHER}


def test_without_true_minutiae_all_are_false():
    assert false_minutiae(template((60, 60, 0)), truth_of(Minutiae.empty())) == {0: Cause.OTHER}


def test_lengths_are_of_500_dpi():
    found = template((100, 100, 1.0), (100, 115, 1.0), dpi=1000)
    assert false_minutiae(found, truth_of(TRUE)) == {1: Cause.NEAR_ANOTHER}
    assert false_minutiae(template((120, 100, 1.0), dpi=1000), truth_of(TRUE)) == {}


def test_distance_to_the_border_without_a_field_and_to_blocks_without_ridges():
    bare = Template(Minutiae.empty(), 100, 50)
    points = np.array([[10, 20], [50, 48], [-5, 20]])
    assert distance_to_border(bare, points).tolist() == [10, 2, 0]
    points = np.array([[150, 100], [100, 100], [165, 100]])
    assert distance_to_border(template(), points).tolist() == [10, 60, 0]
