"""Skin touches inside the outline; what is legible is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.synthesis.contact import BORDER_PX, Contact, PressureParameters, is_legible, press
from fpmatch.synthesis.presets import PRESETS

SHAPE = (130, 110)
Y, X = np.mgrid[-1.4 : 1.4 : SHAPE[0] * 1j, -1.4 : 1.4 : SHAPE[1] * 1j]
RADIUS = np.hypot(X, Y)
NONE = np.zeros(SHAPE)
SMOOTH = {"unevenness": 0, "grain": 0, "max_scratches": 0, "max_spots": 0}
EVEN = PressureParameters(
    dryness=(0.1, 0.1), tilt=(0, 0), wear=(0, 0), outline=0, ragged=0, **SMOOTH
)


def pressed(parameters: PressureParameters, seed: int = 1, **layers: np.ndarray) -> Contact:
    on_print, creases = layers.get("on_print", NONE + 1), layers.get("creases", NONE)
    return press(RADIUS, on_print, creases, np.random.default_rng(seed), parameters)


def test_even_pressure_is_even_inside_and_none_beyond_the_outline() -> None:
    contact = pressed(EVEN)
    np.testing.assert_allclose(contact.threshold[RADIUS < 0.7], 0.1, atol=1e-6)
    assert contact.threshold[RADIUS > 1.05].min() > 1
    np.testing.assert_array_equal(contact.strength, 1)
    np.testing.assert_array_equal(contact.grain, 0)


@settings(max_examples=12)
@given(preset=st.sampled_from(sorted(PRESETS)), seed=st.integers(0, 2**32))
def test_nothing_prints_far_beyond_the_outline(preset: str, seed: int) -> None:
    contact = pressed(PRESETS[preset].pressure, seed)
    assert contact.threshold[RADIUS > 1.35].min() > 1
    assert 0 < contact.strength.min() <= contact.strength.max() <= 1


def test_neither_creases_nor_what_is_no_skin_touch() -> None:
    creases, on_print = NONE.copy(), NONE + 1
    creases[60] = 1
    on_print[:, :50] = 0
    contact = pressed(EVEN, creases=creases, on_print=on_print)
    assert contact.threshold[60].min() > 1
    assert contact.threshold[:, :50].min() > 1
    assert contact.threshold[65, 55] < 0.2


def test_a_preset_can_hide_creases() -> None:
    contact = press(RADIUS, NONE + 1, NONE + 1, np.random.default_rng(1), PRESETS["clean"].pressure)
    assert contact.threshold[65, 55] < 0.5


def test_harder_presets_press_less_evenly() -> None:
    middle = RADIUS < 0.7
    spread = [
        np.mean([pressed(preset.pressure, seed).threshold[middle].std() for seed in range(6)])
        for preset in PRESETS.values()
        if preset.name != "stretched"  # pressed as a normal print is
    ]
    assert spread == sorted(spread)


@pytest.mark.parametrize("level", [-1.5, 1.5])
def test_filled_valleys_and_lost_ridges_are_not_legible(level: float) -> None:
    threshold = np.zeros(SHAPE, np.float32)
    threshold[:, 55:] = level
    contact = Contact(threshold, np.ones_like(threshold), np.zeros_like(threshold))
    points = np.array([[30.0, 60.0], [80.0, 60.0]])
    assert is_legible(points, contact).tolist() == [True, False]


def test_worn_skin_is_legible_only_where_pressure_is_right() -> None:
    threshold = np.full(SHAPE, 0.5, np.float32)
    strength = np.ones_like(threshold)
    strength[:, 55:] = 0.4
    contact = Contact(threshold, strength, np.zeros_like(threshold))
    points = np.array([[30.0, 60.0], [80.0, 60.0]])
    assert is_legible(points, contact).tolist() == [True, False]


def test_nothing_is_legible_at_or_beyond_the_border() -> None:
    contact = pressed(EVEN)
    rows, columns = SHAPE
    points = [[BORDER_PX - 1, 65], [columns - BORDER_PX + 1, 65], [55, 2], [55, rows], [-9e5, 9e5]]
    assert not is_legible(np.array(points, float), contact).any()
    assert is_legible(np.empty((0, 2)), contact).shape == (0,)


def test_a_minutia_at_the_end_of_the_print_is_not_legible() -> None:
    threshold = np.zeros(SHAPE, np.float32)
    threshold[:, 60:] = 2
    contact = Contact(threshold, np.ones_like(threshold), np.zeros_like(threshold))
    points = np.array([[58.0, 60.0], [45.0, 60.0]])
    assert is_legible(points, contact).tolist() == [False, True]
