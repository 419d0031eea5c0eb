"""A grid of shifts tells where the skin lies."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from fpmatch.errors import ImageError
from fpmatch.pointset.similarity import Similarity
from fpmatch.synthesis.displacement import DisplacementField
from fpmatch.synthesis.presets import PRESETS
from fpmatch.synthesis.sensor import SENSORS
from fpmatch.synthesis.truth_file import NODE_EVERY_PX
from fpmatch.synthesis.warp import draw_warp

Points = NDArray[np.float64]


def grid(shape: tuple[int, int], step: int = 1) -> Points:
    y, x = np.mgrid[: shape[0] : step, : shape[1] : step]
    return np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 15))
def test_nodes_lie_around_every_pixel(rows: int, columns: int, step: int) -> None:
    field = DisplacementField.sampled(lambda p: p, (rows, columns), step)
    for side, nodes in zip((rows, columns), field.shift.shape, strict=False):
        last_inner = (nodes - 3) * step
        assert side - 1 <= last_inner < side - 1 + 2 * step


def test_quadratic_shifts_are_exact_between_the_nodes() -> None:
    def bent(p: Points) -> Points:
        x, y = p.T
        return p + np.column_stack([0.01 * x * x - 0.3 * y, 0.02 * x * y + 1.0])

    points = grid((30, 40), 3) + 0.37
    field = DisplacementField.sampled(bent, (31, 41), 8)
    np.testing.assert_allclose(field.relaxed(points), bent(points), atol=1e-9)


def test_beyond_the_picture_the_edge_goes_on() -> None:
    field = DisplacementField.sampled(lambda p: 1.1 * p, (33, 41), 8)
    np.testing.assert_allclose(field.at([[-50, 3]]), field.at([[0, 3]]))
    np.testing.assert_allclose(field.at([[999, 999]]), [[4.8, 4.0]])
    assert field.at(np.empty((0, 2))).shape == (0, 2)
    assert not field.shift.flags.writeable


@pytest.mark.parametrize("preset", ["normal", "hard"])
@pytest.mark.parametrize("sensor", ["optical-388x374", "optical-296x560"])
def test_rounded_shifts_place_the_skin_within_a_tenth_of_a_pixel(preset: str, sensor: str) -> None:
    taken = SENSORS[sensor]
    points = grid(taken.shape, 5)
    for seed in range(12):
        rng = np.random.default_rng(seed)
        warp = draw_warp((560, 440), taken.shape, taken.dpi, rng, PRESETS[preset].placement)
        touching = points[warp.radius(points) < 1]
        origin = warp.to_master(touching)
        transform = Similarity.fit(origin, touching)
        field = DisplacementField.sampled(
            lambda p, t=transform, w=warp: t.apply(w.to_master(p)),  # type: ignore[misc]
            taken.shape,
            round(NODE_EVERY_PX * taken.px),
        )
        field = DisplacementField(field.step, field.shift.round(2))
        unstretched = transform.apply(origin)
        assert np.hypot(*(field.relaxed(touching) - unstretched).T).max() < 0.1
        assert np.hypot(*(field.stretched(unstretched) - touching).T).max() < 0.1


@pytest.mark.parametrize(
    ("step", "shape"), [(8, (4, 4)), (8, (3, 4, 2)), (8, (4, 3, 2)), (8, (4, 4, 3)), (0, (4, 4, 2))]
)
def test_grids_that_are_none_are_refused(step: float, shape: tuple[int, ...]) -> None:
    with pytest.raises(ImageError, match="a displacement field needs"):
        DisplacementField(step, np.zeros(shape))
    with pytest.raises(ImageError, match="finite"):
        DisplacementField(8, np.full((4, 4, 2), np.nan))
