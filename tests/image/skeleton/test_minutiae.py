"""Nodes of a skeleton and their branches, genuine minutiae, directions and quality."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.image.skeleton import minutiae as module
from fpmatch.image.skeleton.minutiae import (
    RADIUS_PX,
    SIGMA_PX,
    SkeletonNodes,
    directions,
    filter_spurious,
    find_nodes,
    minutia_quality,
    remove_spurs_and_islands,
)
from fpmatch.image.skeleton.thin import thin
from tests.image.made_images import extremes_too, lines, shapes, turn_between


def walked(nodes, node, branch):
    """Return the pixels (x, y) of a branch."""
    path = nodes.paths[node, branch, : nodes.steps[node, branch]]
    return [(int(x), int(y)) for y, x in path]


def branches_of(binary, nodes, limit):
    """Walk every branch of every node pixel by pixel: the slow, obvious twin."""
    ridge = {(int(y), int(x)) for y, x in np.argwhere(binary)}
    edges = [(0, 1), (-1, 0), (0, -1), (1, 0)]
    corners = [(-1, 1), (-1, -1), (1, -1), (1, 1)]

    def beside(a, b):
        return max(abs(a[0] - b[0]), abs(a[1] - b[1])) <= 1

    def walk(node, start, first):
        path, last = [first], start
        while nodes.get(path[-1], node) == node and len(path) < limit:
            here = path[-1]
            around = [(here[0] + dy, here[1] + dx) for dy, dx in edges + corners]
            onward = [pixel for pixel in around if pixel in ridge and not beside(pixel, last)]
            if not onward:
                return path, -1
            path.append(onward[0])
            last = here
        met = nodes.get(path[-1], -1)
        return path, -1 if met == node else met

    found = []
    for (y, x), node in nodes.items():
        starts = [(y + dy, x + dx) for dy, dx in edges if (y + dy, x + dx) in ridge]
        starts += [
            (y + dy, x + dx)
            for dy, dx in corners
            if (y + dy, x + dx) in ridge and not {(y + dy, x), (y, x + dx)} & ridge
        ]
        found.append([walk(node, (y, x), first) for first in starts[:4]])
    return found


@given(shapes, st.integers(1, 12), st.booleans())
def test_agrees_with_the_twin(binary, limit, thinned):
    picture = thin(binary) if thinned else binary
    nodes = find_nodes(picture, limit)
    index = {(int(y), int(x)): k for k, (y, x) in enumerate(zip(nodes.y, nodes.x, strict=True))}
    for node, branches in enumerate(branches_of(picture, index, limit)):
        assert np.count_nonzero(nodes.steps[node]) == len(branches)
        for branch, (path, target) in enumerate(branches):
            assert [(y, x) for x, y in walked(nodes, node, branch)] == path
            assert nodes.target[node, branch] == target


def test_weights_fall_off_as_a_gaussian_and_end_with_the_image(rng):
    a, b = rng.normal(0, 1, (2, 35, 50)).astype(np.float32) + 1
    rows, columns = np.indices(a.shape)
    for x, y in ((0, 0), (20, 16), (49, 34)):
        dy, dx = rows - y, columns - x
        weight = np.exp(-(dx**2 + dy**2) / (2 * SIGMA_PX**2))
        weight *= np.maximum(abs(dx), abs(dy)) <= RADIUS_PX
        expected = (weight * a * b).sum() / np.sqrt((weight * a * a).sum() * (weight * b * b).sum())
        found = minutia_quality(a, b, np.array([x]), np.array([y]))
        assert found[0] == max(0, round(100 * expected))
        for pixels, worthless in ((-a, a), (0 * a, a), (a, 0 * a)):
            assert minutia_quality(pixels, worthless, np.array([x]), np.array([y])) == [0]


SHAPE = (80, 100)
RIDGE = ((15, 40), (85, 40))


def kept_at(skeleton, mask=None, branch_px=module.BRANCH_PX):
    """Return the places (x, y) of the nodes that `filter_spurious` keeps."""
    nodes = find_nodes(skeleton, branch_px)
    whole = np.ones(skeleton.shape, bool) if mask is None else mask
    keep = filter_spurious(nodes, directions(nodes), whole)
    return {(int(x), int(y)) for x, y in zip(nodes.x[keep], nodes.y[keep], strict=True)}


@extremes_too
@given(shapes)
def test_any_picture_gives_angles_and_nothing_is_added(binary):
    skeleton = thin(binary)
    before = skeleton.copy()
    cleaned = remove_spurs_and_islands(skeleton)
    assert np.array_equal(skeleton, before)
    assert not (cleaned & ~skeleton).any()
    assert len(kept_at(cleaned)) <= skeleton.sum()
    nodes = find_nodes(skeleton, 14)
    angle = directions(nodes)
    assert (angle.dtype, angle.shape) == (np.float32, nodes.x.shape)
    assert ((angle >= 0) & (angle <= np.float32(2 * np.pi))).all()


@pytest.mark.parametrize(
    ("stroke", "erased"),
    [
        *((((50, 39), (50, 40 - length)), length <= 8) for length in (1, 3, 8, 9)),  # a spur
        *((((50, 20), (49 + length, 20)), length <= 15) for length in (2, 6, 15, 16)),  # an island
    ],
)
def test_spurs_and_islands_up_to_their_limits_go(stroke, erased):
    ridge, skeleton = lines(SHAPE, RIDGE), lines(SHAPE, RIDGE, stroke)
    expected = ridge if erased else skeleton
    assert np.array_equal(remove_spurs_and_islands(skeleton), expected)


ENDING = lines(SHAPE, ((0, 40), (50, 40)))
FORK = lines(SHAPE, ((0, 40), (50, 40)), ((50, 40), (99, 65)), ((50, 40), (99, 15)))


@pytest.mark.parametrize("distance", [0, 3, 4, 6, 7, 12])
def test_a_minutia_is_genuine_but_near_the_edge_of_the_mask(distance):
    for skeleton in (ENDING, FORK):
        (place,) = kept_at(skeleton)
        assert np.hypot(place[0] - 50, place[1] - 40) <= 2
    mask = np.ones(SHAPE, bool)
    mask[:, 50 + distance :] = False
    assert kept_at(ENDING, mask) == ({(50, 40)} if distance > 6 else set())
    to_the_border = lines(SHAPE, ((50, 79), (50, distance)))
    assert len(kept_at(to_the_border)) == (1 if distance >= 4 else 0)


def lake(half):
    left, right, top, bottom = (50 - half, 40), (50 + half, 40), (50, 40 - half), (50, 40 + half)
    around = [(left, top), (top, right), (left, bottom), (bottom, right)]
    return [((0, 40), left), *around, (right, (99, 40))]


def two(first, second, down):
    return [first, tuple((x, y + down) for x, y in second)]


WHOLE, RIGHT = ((0, 30), (99, 30)), ((50, 30), (99, 30))
STRUCTURES = {
    "bridge": [
        ([*two(WHOLE, WHOLE, gap), ((50, 30), (50, 30 + gap))], count)
        for gap, count in ((4, 0), (8, 0), (9, 2), (20, 2))
    ],
    "lake": [(lake(half), count) for half, count in ((3, 0), (4, 0), (12, 2))],
    "overlap": [(two(((0, 30), (54, 30)), RIGHT, 8), 2)],
    "crossing": [([((0, 40), (99, 40)), ((50, 0), (50, 79))], 0)],
}


@pytest.mark.parametrize("name", STRUCTURES)
def test_minutiae_of_known_causes_are_rejected(name):
    for strokes, count in STRUCTURES[name]:
        assert len(kept_at(lines(SHAPE, *strokes))) == count, strokes


def arm(degrees):
    """Return a line of 45 pixels from (60, 60)."""
    angle = np.radians(degrees)
    return (60, 60), (round(60 + 45 * np.cos(angle)), round(60 - 45 * np.sin(angle)))


@pytest.mark.parametrize("degrees", range(0, 360, 15))
def test_minutiae_point_back_along_their_ridge_or_along_their_valley(degrees):
    nodes = find_nodes(thin(lines((120, 120), arm(degrees))), 14)
    found = np.degrees(directions(nodes))
    here = (nodes.x == 60) & (nodes.y == 60)
    assert turn_between(found[here], degrees).max() < 6
    assert turn_between(found[~here], degrees + 180).max() < 6
    for half_opening in (35, 50):
        towards = degrees + 180, degrees - half_opening, degrees + half_opening
        fork = thin(lines((120, 120), *map(arm, towards)))
        nodes = find_nodes(remove_spurs_and_islands(fork), 20)
        found = np.degrees(directions(nodes, 20))[nodes.crossing_number == 3]
        assert found.shape == (1,)
        assert turn_between(found, degrees).max() < 12


def crowded_or_broken(nodes, angle, i, j):
    """Tell whether two nodes refuse each other: the obvious test of one pair."""
    dx, up = float(nodes.x[j] - nodes.x[i]), float(nodes.y[i] - nodes.y[j])
    distance = np.hypot(dx, up)
    if distance < module.CROWDED_PX:
        return True
    towards = np.degrees(np.arctan2(up, dx))
    back_of_i = turn_between(np.degrees(angle[i]), towards + 180) < module.BROKEN_ANGLE_DEG
    back_of_j = turn_between(np.degrees(angle[j]), towards) < module.BROKEN_ANGLE_DEG
    both_end = nodes.crossing_number[i] == nodes.crossing_number[j] == 1
    return bool(both_end and distance < module.BROKEN_PX and back_of_i and back_of_j)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(0, 60),
    st.sampled_from([0, 3, 6, 12]),
    st.sampled_from([0, 5.5, 10, 25]),
)
def test_crowding_agrees_with_a_look_at_every_pair(seed, count, crowded_px, broken_px):
    rng = np.random.default_rng(seed)
    y, x = np.divmod(np.sort(rng.permutation(3600)[:count]).astype(np.int32), np.int32(60))
    number = rng.choice(np.array([1, 3], np.uint8), count)
    paths, steps = np.zeros((count, 4, 1, 2), np.int32), np.zeros((count, 4), np.int32)
    nodes = SkeletonNodes(y, x, number, paths, steps, target=np.full_like(steps, -1))
    angle = rng.uniform(0, 2 * np.pi, count).astype(np.float32)
    whole = np.ones((60, 60), bool)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MIN_MASK_DISTANCE_PX", 0)
        patch.setattr(module, "MIN_BORDER_DISTANCE_PX", 0)
        patch.setattr(module, "CROWDED_PX", crowded_px)
        patch.setattr(module, "BROKEN_PX", broken_px)
        refused = [
            any(crowded_or_broken(nodes, angle, i, j) for j in range(count) if j != i)
            for i in range(count)
        ]
        assert filter_spurious(nodes, angle, whole).tolist() == [not one for one in refused]
