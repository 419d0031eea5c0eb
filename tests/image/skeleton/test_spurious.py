"""Drawn spurs, islands, bridges, lakes, breaks, crowds, and borders."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_images import Binary, binaries, blobs, lines, strips_and_extremes, turn_between

from fpmatch.image.skeleton.crossing_number import SkeletonNodes, find_nodes
from fpmatch.image.skeleton.spurious import (
    SpuriousParameters,
    directions,
    filter_spurious,
    remove_spurs_and_islands,
)
from fpmatch.image.skeleton.thin import thin

P = SpuriousParameters(
    max_spur_px=8,
    max_island_px=14,
    max_bridge_px=8,
    min_mask_distance_px=6,
    min_border_distance_px=4,
    crowded_px=6,
    broken_px=10,
    broken_angle_deg=50,
    direction_px=14,
)
SHAPE = (80, 100)
RIDGE = ((15, 40), (85, 40))
Stroke = tuple[tuple[int, int], tuple[int, int]]


def kept_at(
    skeleton: Binary, mask: Binary | None = None, parameters: SpuriousParameters = P
) -> set[tuple[int, int]]:
    """Return the places (x, y) of the nodes that `filter_spurious` keeps."""
    nodes = find_nodes(skeleton, parameters.branch_px)
    whole = np.ones(skeleton.shape, bool) if mask is None else mask
    angle = directions(nodes, parameters.direction_px)
    keep = filter_spurious(nodes, angle, whole, parameters)
    return {(int(x), int(y)) for x, y in zip(nodes.x[keep], nodes.y[keep], strict=True)}


def check_angles_and_cleaning(binary: Binary) -> None:
    skeleton = thin(binary)
    before = skeleton.copy()
    cleaned = remove_spurs_and_islands(skeleton, P)
    assert np.array_equal(skeleton, before)
    assert not (cleaned & ~skeleton).any()
    assert len(kept_at(cleaned)) <= skeleton.sum()
    nodes = find_nodes(skeleton, 14)
    angle = directions(nodes, 14)
    assert (angle.dtype, angle.shape) == (np.float32, nodes.x.shape)
    assert ((angle >= 0) & (angle <= np.float32(2 * np.pi))).all()


@pytest.mark.parametrize("name", strips_and_extremes())
def test_extremes_give_angles_and_nothing_is_added(name: str) -> None:
    check_angles_and_cleaning(strips_and_extremes()[name])


@given(st.one_of(binaries, blobs))
def test_any_picture_gives_angles_and_nothing_is_added(binary: Binary) -> None:
    check_angles_and_cleaning(binary)


@pytest.mark.parametrize(
    ("stroke", "erased"),
    [
        *((((50, 39), (50, 40 - length)), length <= 8) for length in (1, 3, 8, 9)),  # a spur
        *((((50, 20), (49 + length, 20)), length <= 15) for length in (2, 6, 15, 16)),  # an island
    ],
)
def test_spurs_and_islands_up_to_their_limits_go(stroke: Stroke, erased: bool) -> None:
    ridge, skeleton = lines(SHAPE, RIDGE), lines(SHAPE, RIDGE, stroke)
    expected = ridge if erased else skeleton
    assert np.array_equal(remove_spurs_and_islands(skeleton, P), expected)


@pytest.mark.parametrize(("spur", "island"), [(20, 3), (3, 20), (0, 20), (20, 0), (0, 0)])
def test_spurs_and_islands_have_limits_of_their_own(spur: int, island: int) -> None:
    with_spur = lines(SHAPE, RIDGE, ((50, 39), (50, 30)))
    with_island = lines(SHAPE, RIDGE, ((50, 20), (60, 20)))
    p = replace(P, max_spur_px=spur, max_island_px=island)
    ridge = lines(SHAPE, RIDGE)
    assert np.array_equal(remove_spurs_and_islands(with_spur, p), ridge) == (spur == 20)
    assert np.array_equal(remove_spurs_and_islands(with_island, p), ridge) == (island == 20)


ENDING = lines(SHAPE, ((0, 40), (50, 40)))
FORK = lines(SHAPE, ((0, 40), (50, 40)), ((50, 40), (99, 65)), ((50, 40), (99, 15)))


@pytest.mark.parametrize("skeleton", [ENDING, FORK], ids=["ending", "bifurcation"])
def test_a_minutia_in_the_middle_is_genuine(skeleton: Binary) -> None:
    (place,) = kept_at(skeleton)
    assert np.hypot(place[0] - 50, place[1] - 40) <= 2


@pytest.mark.parametrize("distance", [2, 5, 7, 12])
def test_a_minutia_keeps_its_distance_from_the_edge_of_the_mask(distance: int) -> None:
    mask = np.ones(SHAPE, bool)
    mask[:, 50 + distance :] = False
    assert kept_at(ENDING, mask) == ({(50, 40)} if distance > 6 else set())
    assert kept_at(ENDING, np.zeros(SHAPE, bool)) == set()


@pytest.mark.parametrize("distance", [0, 3, 4, 9])
@pytest.mark.parametrize("turns", range(4))
def test_a_minutia_keeps_its_distance_from_the_border(distance: int, turns: int) -> None:
    skeleton = np.rot90(lines(SHAPE, ((50, 79), (50, distance))), turns)
    assert len(kept_at(skeleton)) == (1 if distance >= 4 else 0)


@pytest.mark.parametrize(("limit", "count"), [(8, 2), (20, 2), (30, 0)])
def test_the_limit_for_bridges_may_exceed_that_for_directions(limit: int, count: int) -> None:
    skeleton = lines(SHAPE, ((0, 20), (99, 20)), ((0, 45), (99, 45)), ((50, 20), (50, 45)))
    assert len(kept_at(skeleton, parameters=replace(P, max_bridge_px=limit))) == count


def lake(half: int) -> list[Stroke]:
    left, right, top, bottom = (50 - half, 40), (50 + half, 40), (50, 40 - half), (50, 40 + half)
    around = [(left, top), (top, right), (left, bottom), (bottom, right)]
    return [((0, 40), left), *around, (right, (99, 40))]


def two(first: Stroke, second: Stroke, down: int) -> list[Stroke]:
    return [first, tuple((x, y + down) for x, y in second)]  # type: ignore[list-item]


WHOLE, LEFT, RIGHT = ((0, 30), (99, 30)), ((0, 30), (50, 30)), ((50, 30), (99, 30))
STRUCTURES = {
    "bridge": [
        ([*two(WHOLE, WHOLE, gap), ((50, 30), (50, 30 + gap))], count)
        for gap, count in ((4, 0), (8, 0), (9, 2), (20, 2))
    ],
    "lake": [(lake(half), count) for half, count in ((3, 0), (4, 0), (12, 2))],
    "break": [
        ([((0, 40), (45, 40)), ((45 + gap, 40), (99, 40))], count)
        for gap, count in ((3, 0), (7, 0), (9, 0), (11, 2), (20, 2))
    ],
    "crowd": [(two(LEFT, LEFT, apart), n) for apart, n in ((3, 0), (5, 0), (6, 2), (9, 2))],
    "overlap": [(two(((0, 30), (54, 30)), RIGHT, 8), 2)],
    "crossing": [([((0, 40), (99, 40)), ((50, 0), (50, 79))], 0)],
}


@pytest.mark.parametrize("name", STRUCTURES)
def test_minutiae_of_known_causes_are_rejected(name: str) -> None:
    for strokes, count in STRUCTURES[name]:
        assert len(kept_at(lines(SHAPE, *strokes))) == count, strokes


@pytest.mark.parametrize("degrees", range(0, 360, 15))
def test_an_ending_points_back_along_its_ridge(degrees: int) -> None:
    angle = np.radians(degrees)
    far = round(60 + 45 * np.cos(angle)), round(60 - 45 * np.sin(angle))
    nodes = find_nodes(thin(lines((120, 120), ((60, 60), far))), 14)
    found = np.degrees(directions(nodes, 14))
    here = (nodes.x == 60) & (nodes.y == 60)
    assert turn_between(found[here], degrees).max() < 6
    assert turn_between(found[~here], degrees + 180).max() < 6


@pytest.mark.parametrize("half_opening", [35, 50])
@pytest.mark.parametrize("degrees", range(0, 360, 15))
def test_a_bifurcation_points_along_its_valley(degrees: int, half_opening: int) -> None:
    def arm(towards: float) -> tuple[tuple[int, int], tuple[int, int]]:
        angle = np.radians(towards)
        return (60, 60), (round(60 + 45 * np.cos(angle)), round(60 - 45 * np.sin(angle)))

    strokes = [arm(degrees + 180), arm(degrees - half_opening), arm(degrees + half_opening)]
    nodes = find_nodes(remove_spurs_and_islands(thin(lines((120, 120), *strokes)), P), 20)
    found = np.degrees(directions(nodes, 20))[nodes.crossing_number == 3]
    assert found.shape == (1,)
    assert turn_between(found, degrees).max() < 12


def test_a_direction_takes_no_more_of_the_branch_than_it_may() -> None:
    bent = thin(lines(SHAPE, ((20, 40), (30, 40)), ((30, 40), (30, 10))))
    nodes = find_nodes(bent, 30)
    left = int(np.flatnonzero(nodes.x == 20)[0])
    assert directions(nodes, 8)[left] == pytest.approx(0)
    assert np.degrees(directions(nodes, 30)[left]) > 45


def loose_endings(rng: np.random.Generator, count: int) -> SkeletonNodes:
    """Return nodes at distinct places of a 60 x 60 image, joined to nothing."""
    y, x = np.divmod(np.sort(rng.permutation(3600)[:count]).astype(np.int32), np.int32(60))
    return unjoined(y, x, rng.choice(np.array([1, 3], np.uint8), count))


def unjoined(y: np.ndarray, x: np.ndarray, number: np.ndarray) -> SkeletonNodes:
    paths, steps = np.zeros((len(y), 4, 1, 2), np.int32), np.zeros((len(y), 4), np.int32)
    return SkeletonNodes(y, x, number, paths, steps, target=np.full_like(steps, -1))


def crowded_or_broken(
    nodes: SkeletonNodes, angle: np.ndarray, i: int, j: int, p: SpuriousParameters
) -> bool:
    """Tell whether two nodes refuse each other: the obvious test of one pair."""
    dx, up = float(nodes.x[j] - nodes.x[i]), float(nodes.y[i] - nodes.y[j])
    distance = np.hypot(dx, up)
    if distance < p.crowded_px:
        return True
    towards = np.degrees(np.arctan2(up, dx))
    back_of_i = turn_between(np.degrees(angle[i]), towards + 180) < p.broken_angle_deg
    back_of_j = turn_between(np.degrees(angle[j]), towards) < p.broken_angle_deg
    both_end = nodes.crossing_number[i] == nodes.crossing_number[j] == 1
    return bool(both_end and distance < p.broken_px and back_of_i and back_of_j)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(0, 60),
    st.sampled_from([0, 3, 6, 12]),
    st.sampled_from([0, 5.5, 10, 25]),
)
def test_crowding_agrees_with_a_look_at_every_pair(
    seed: int, count: int, crowded_px: float, broken_px: float
) -> None:
    rng = np.random.default_rng(seed)
    nodes = loose_endings(rng, count)
    angle = rng.uniform(0, 2 * np.pi, count).astype(np.float32)
    p = replace(
        P,
        crowded_px=crowded_px,
        broken_px=broken_px,
        min_mask_distance_px=0,
        min_border_distance_px=0,
    )
    expected = [
        not any(crowded_or_broken(nodes, angle, i, j, p) for j in range(count) if j != i)
        for i in range(count)
    ]
    assert filter_spurious(nodes, angle, np.ones((60, 60), bool), p).tolist() == expected


def test_many_nodes_do_not_take_the_memory_of_all_their_pairs() -> None:
    y, x = (9 * index.ravel().astype(np.int32) for index in np.mgrid[:141, :141])
    count = len(y)
    nodes = unjoined(y, x, np.full(count, 3, np.uint8))
    p = replace(P, min_border_distance_px=0, min_mask_distance_px=0, crowded_px=9, broken_px=0)
    angle, mask = np.zeros(count, np.float32), np.ones((1270, 1270), bool)
    tracemalloc.start()
    assert filter_spurious(nodes, angle, mask, p).all()
    assert not filter_spurious(nodes, angle, mask, replace(p, crowded_px=9.5)).any()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < count**2  # a byte a pair
