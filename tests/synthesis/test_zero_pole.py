"""Half a turn around every core, half a turn back at every delta."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.synthesis.zero_pole import ZeroPoleParameters, zero_pole_turning

PLAIN = ZeroPoleParameters(correction_deg=0, uprightness=(0, 0), loop_narrowing_deg=(0, 0))


def turns_around(
    point: complex, cores: list[complex], deltas: list[complex], seed: int, radius: float = 3.0
) -> float:
    """Return how far the orientation turns on a small circle around `point`, in units of π."""
    circle = point + radius * np.exp(1j * np.linspace(0, 2 * np.pi, 401))
    turning = zero_pole_turning(circle[None], cores, deltas, np.random.default_rng(seed))[0]
    steps = np.mod(np.diff(turning) + np.pi / 2, np.pi) - np.pi / 2
    return float(steps.sum() / np.pi)


@given(st.integers(0, 2**32))
def test_the_index_of_every_point_survives_every_correction(seed: int) -> None:
    cores, deltas = [-5 + 60j, 8 - 10j], [-100 - 110j, 95 - 120j]
    for core in cores:
        assert turns_around(core, cores, deltas, seed) == pytest.approx(1)
    for delta in deltas:
        assert turns_around(delta, cores, deltas, seed) == pytest.approx(-1)
    assert turns_around(40 + 30j, cores, deltas, seed) == pytest.approx(0)
    assert turns_around(0j, cores, deltas, seed, radius=900.0) == pytest.approx(0)


def test_without_corrections_it_is_the_plain_model(rng: np.random.Generator) -> None:
    place = rng.uniform(-200, 200, (5, 6)) + 1j * rng.uniform(-200, 200, (5, 6))
    found = zero_pole_turning(place, [0j], [50 - 80j], rng, PLAIN)
    plain = 0.5 * (np.angle(place) - np.angle(place - (50 - 80j)))
    np.testing.assert_allclose(found, plain, atol=1e-12)


def test_no_singular_points_no_turning(rng: np.random.Generator) -> None:
    assert not zero_pole_turning(np.ones((3, 4), complex), [], [], rng).any()


def test_an_upright_loop_stands_more_upright() -> None:
    below = np.array([[-40j]])
    axes = []
    for uprightness in (0.0, 1.0):
        p = ZeroPoleParameters(
            correction_deg=0, uprightness=(uprightness,) * 2, loop_narrowing_deg=(0, 0)
        )
        turning = zero_pole_turning(below, [0j], [100 - 100j], np.random.default_rng(0), p)
        axes.append(math.degrees(turning[0, 0]) % 180)
    assert abs(axes[1] - 90) < abs(axes[0] - 90) - 5
