"""Thinning and crossing numbers against `skeletonize` and a ring of neighbours.

Both thinnings keep the components and the holes of the ridges. They differ in two ways. Algorithm
A1 of Guo and Hall and that of Zhang and Suen peel ridges of even width from different sides: lines
lie up to a pixel or two apart, and end a few pixels earlier or later. `skeletonize` leaves corners
that connection does not need, which `thin` deletes: where a spur of a pixel or two begins, one
skeleton may have a fork that the other lacks. The crossing numbers of one skeleton are the same.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, label
from skimage.morphology import skeletonize

from fpmatch import StageRecorder, extract
from fpmatch.image.skeleton.minutiae import find_nodes
from fpmatch.image.skeleton.thin import thin

SAMPLES = Path(__file__).parents[3] / "sample_data"
EIGHT, FOUR = np.ones((3, 3)), [[0, 1, 0], [1, 1, 1], [0, 1, 0]]
RING = ((0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1))
NEAR_PX = 4.0


@pytest.fixture(scope="module", params=["101_1", "102_2", "103_4", "104_3"])
def skeletons(request):
    """Return the ridges of a print, and the two skeletons of them."""
    recorder = StageRecorder()
    extract(SAMPLES / f"{request.param}.tif", recorder=recorder)
    ridges = recorder.stages["binary"].astype(bool)
    return ridges, thin(ridges), np.asarray(skeletonize(ridges))


def components_and_holes(binary):
    return label(binary, EIGHT)[1], label(~np.pad(binary, 1), FOUR)[1]


def crossing_numbers(skeleton):
    """Return half the number of changes around each pixel of a skeleton, 0 elsewhere."""
    padded = np.pad(skeleton.astype(int), 1)
    height, width = skeleton.shape
    ring = [padded[1 + y : 1 + y + height, 1 + x : 1 + x + width] for y, x in RING]
    changes = sum(abs(one - other) for one, other in zip(ring, ring[1:] + ring[:1], strict=True))
    return changes // 2 * skeleton


def test_both_skeletons_have_the_components_and_holes_of_the_ridges(skeletons):
    ridges, ours, theirs = skeletons
    assert components_and_holes(ours) == components_and_holes(ridges)
    assert components_and_holes(theirs) == components_and_holes(ridges)
    assert not (ours & ~ridges).any()


def test_the_skeletons_differ_by_a_pixel_or_two_but_at_ends(skeletons):
    _, ours, theirs = skeletons
    assert (ours != theirs).mean() < 0.05
    for one, other in ((ours, theirs), (theirs, ours)):
        apart = distance_transform_edt(~other)[one]
        assert (apart <= 1.5).mean() > 0.99
        assert apart.max() < 6


def test_nodes_are_those_of_plain_crossing_numbers(skeletons):
    for skeleton in skeletons[1:]:
        plain, nodes = crossing_numbers(skeleton), find_nodes(skeleton, 0)
        expected = np.argwhere((plain == 1) | (plain > 2))
        assert np.array_equal(np.column_stack([nodes.y, nodes.x]), expected)
        assert np.array_equal(nodes.crossing_number, plain[nodes.y, nodes.x])


@pytest.mark.parametrize(("number", "least"), [(1, 0.95), (3, 0.9)])
def test_endings_and_bifurcations_of_both_skeletons_are_the_same(skeletons, number, least):
    ours, theirs = (np.argwhere(crossing_numbers(one) == number) for one in skeletons[1:])
    apart = np.linalg.norm(ours[:, None] - theirs[None], axis=2)
    assert (apart.min(axis=1) <= NEAR_PX).mean() >= least
    assert (apart.min(axis=0) <= NEAR_PX).mean() >= least
