import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.image.skeleton import _trace_kernel as kernel
from fpmatch.image.skeleton.minutiae import (
    RADIUS_PX,
    SIGMA_PX,
    find_nodes,
    minutia_quality,
)
from fpmatch.image.skeleton.thin import thin
from tests.image.made_images import extremes_too, plane_wave, shapes


def walked(nodes, node, branch):
    """Return the pixels (x, y) of a branch."""
    path = nodes.paths[node, branch, : nodes.steps[node, branch]]
    return [(int(x), int(y)) for y, x in path]


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


@given(shapes, st.integers(1, 12))
def test_interpreted_the_kernel_finds_the_same(interpreted, binary, limit):
    compiled = find_nodes(binary, limit)
    plain = interpreted("_trace_kernel")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernel, "trace_branches", plain.trace_branches)
        found = find_nodes(binary, limit)
    for one, other in zip(found, compiled, strict=True):
        assert np.array_equal(one, other)


WAVE = plane_wave(30, 9, (90, 110))
NOTHING = np.zeros_like(WAVE)
X, Y = np.array([0, 50, 109, 20], np.int32), np.array([0, 40, 89, 70], np.int32)


@pytest.mark.parametrize(
    ("pixels", "enhanced", "quality"),
    [
        *((WAVE, np.float32(scale) * WAVE, 100) for scale in (0.01, 1, 50)),
        (-WAVE, WAVE, 0),
        (NOTHING, WAVE, 0),
        (WAVE, NOTHING, 0),
        (NOTHING, NOTHING, 0),
    ],
)
def test_an_image_like_its_enhancement_is_perfect_and_an_inverted_or_empty_one_worthless(
    pixels, enhanced, quality
):
    assert minutia_quality(pixels, enhanced, X, Y).tolist() == [quality] * 4


def test_a_minutia_is_graded_alone_as_in_company(rng):
    noisy = WAVE + rng.normal(0, 1, WAVE.shape).astype(np.float32)
    together = minutia_quality(noisy, WAVE, X, Y)
    alone = [int(minutia_quality(noisy, WAVE, X[k : k + 1], Y[k : k + 1])[0]) for k in range(4)]
    assert together.tolist() == alone


@given(
    arrays(np.float32, (2, 12, 15), elements=st.floats(-3, 3, width=32)),
    st.integers(0, 14),
    st.integers(0, 11),
)
def test_quality_is_symmetric_and_within_0_to_100(images, x, y):
    at = np.array([x]), np.array([y])
    grade = int(minutia_quality(*images, *at)[0])
    assert 0 <= grade <= 100
    assert grade == int(minutia_quality(*images[::-1], *at)[0])


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
