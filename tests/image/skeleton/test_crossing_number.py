"""Nodes drawn by hand, and the tracing kernel and its twins."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_images import drawn, extremes_too, shapes

from fpmatch.image.skeleton import _trace_kernel as kernel
from fpmatch.image.skeleton.minutiae import (
    find_nodes,
    nodes_with_kernel,
    nodes_with_numpy,
)
from fpmatch.image.skeleton.thin import bordered, thin

LINE = drawn("#######", margin=3)
FORK = drawn(
    "       #",
    "      # ",
    "     #  ",
    "#####   ",
    "     #  ",
    "      # ",
    "       #",
    margin=2,
)
PLUS = drawn("   #   ", "   #   ", "   #   ", "#######", "   #   ", "   #   ", "   #   ", margin=1)
CROSS = drawn("#   #", " # # ", "  #  ", " # # ", "#   #", margin=1)
RING = drawn(" ### ", "#   #", "#   #", "#   #", " ### ", margin=1)
LOLLIPOP = drawn(" ###     ", "#   #    ", "#    ####", "#   #    ", " ###     ", margin=1)


def walked(nodes, node, branch):
    """Return the pixels (x, y) of a branch."""
    path = nodes.paths[node, branch, : nodes.steps[node, branch]]
    return [(int(x), int(y)) for y, x in path]


def at(nodes):
    """Return (x, y, crossing number) of all nodes."""
    columns = (nodes.x, nodes.y, nodes.crossing_number)
    return [(int(x), int(y), int(c)) for x, y, c in zip(*columns, strict=True)]


def test_a_line_has_two_endings_that_lead_to_each_other():
    nodes = find_nodes(LINE, 20)
    assert at(nodes) == [(3, 3, 1), (9, 3, 1)]
    assert walked(nodes, 0, 0) == [(x, 3) for x in range(4, 10)]
    assert walked(nodes, 1, 0) == [(x, 3) for x in range(8, 2, -1)]
    assert nodes.target[:, 0].tolist() == [1, 0]
    assert not nodes.steps[:, 1:].any()
    assert (nodes.target[:, 1:] == -1).all()


@pytest.mark.parametrize(
    "line", [drawn("#" * 20), drawn(*"#" * 20), drawn("##"), drawn("# ", " #"), drawn(" #", "# ")]
)
def test_a_line_from_border_to_border(line):
    nodes = find_nodes(line, 30)
    assert nodes.crossing_number.tolist() == [1, 1]
    assert nodes.steps[:, 0].tolist() == [line.sum() - 1] * 2
    assert nodes.target[:, 0].tolist() == [1, 0]


def test_a_fork_has_one_bifurcation_with_three_branches():
    nodes = find_nodes(FORK, 20)
    assert sorted(at(nodes)) == [(2, 5, 1), (6, 5, 3), (9, 2, 1), (9, 8, 1)]
    fork = at(nodes).index((6, 5, 3))
    ends = {(nodes.x[t], nodes.y[t]) for t in nodes.target[fork, :3]}
    assert ends == {(2, 5), (9, 2), (9, 8)}
    assert nodes.steps[fork].tolist() == [4, 3, 3, 0]
    assert [nodes.target[k, 0] for k in range(4) if k != fork] == [fork] * 3


def test_a_ring_has_no_node():
    nodes = find_nodes(RING, 10)
    assert nodes.paths.shape == (0, 4, 10, 2)
    assert nodes.steps.shape == nodes.target.shape == (0, 4)


@pytest.mark.parametrize(("picture", "arm"), [(PLUS, 3), (CROSS, 2)])
def test_a_crossing_has_four_branches(picture, arm):
    nodes = find_nodes(picture, 20)
    crossing = nodes.crossing_number.tolist().index(4)
    assert sorted(nodes.crossing_number.tolist()) == [1, 1, 1, 1, 4]
    assert nodes.steps[crossing].tolist() == [arm] * 4
    assert len(set(nodes.target[crossing].tolist())) == 4


def test_a_loop_at_the_end_of_a_line_meets_no_other_node():
    nodes = find_nodes(LOLLIPOP, 8)
    assert nodes.crossing_number.tolist() == [3, 1]
    assert nodes.target[1, 0] == 0
    assert nodes.target[0, :3].tolist() == [1, -1, -1]
    assert nodes.steps[0, :3].tolist() == [3, 8, 8]


@pytest.mark.parametrize("limit", [0, 1, 2, 5, 6, 7])
def test_a_walk_ends_at_its_limit(limit):
    nodes = find_nodes(LINE, limit)
    assert nodes.steps[:, 0].tolist() == [min(limit, 6)] * 2
    assert nodes.target[:, 0].tolist() == ([1, 0] if limit >= 6 else [-1, -1])


@extremes_too
@given(shapes)
def test_a_node_has_a_branch_for_each_change_around_it(binary):
    nodes = find_nodes(thin(binary), 6)
    branches = np.count_nonzero(nodes.steps, axis=1)
    # where a skeleton must stay two pixels wide, four edge neighbours can be one run
    assert ((branches == nodes.crossing_number) | (branches == 4)).all()
    assert np.array_equal(np.lexsort((nodes.x, nodes.y)), np.arange(len(nodes.x)))


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


@given(shapes, st.booleans())
def test_kernel_and_numpy_list_the_same_nodes(binary, thinned):
    padded = bordered(thin(binary) if thinned else binary)
    for one, other in zip(nodes_with_kernel(padded), nodes_with_numpy(padded), strict=True):
        assert one.dtype == other.dtype
        assert np.array_equal(one, other)


@given(shapes, st.integers(1, 12))
def test_interpreted_the_kernel_finds_the_same(interpreted, binary, limit):
    compiled = find_nodes(binary, limit)
    plain = interpreted("_trace_kernel")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("list_nodes", "trace_branches"):
            patch.setattr(kernel, name, getattr(plain, name))
        found = find_nodes(binary, limit)
    for one, other in zip(found, compiled, strict=True):
        assert np.array_equal(one, other)
