import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.lab.synthesis.contact import (
    BORDER_PX,
    Contact,
    PressureParameters,
    SmearParameters,
    is_legible,
    press,
    stain,
)
from fpmatch.lab.synthesis.noise import smooth_noise
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import draw_card
from fpmatch.lab.synthesis.skin import draw_lines


@given(st.integers(1, 90), st.integers(1, 90), st.floats(1.5, 200), st.integers(0, 2**32))
def test_noise_of_any_shape_and_extent_is_finite_and_smooth(rows, columns, extent, seed):
    field = smooth_noise((rows, columns), extent, np.random.default_rng(seed))
    assert field.shape == (rows, columns)
    assert np.isfinite(field).all()
    steps = [np.abs(np.diff(field, axis=axis)) for axis in (0, 1)]
    assert all(step.max(initial=0) < 12 / extent for step in steps)


@settings(max_examples=10)
@given(st.integers(1, 5), st.integers(0, 2**32))
def test_lines_are_thin_and_lie_between_0_and_1(count, seed):
    lines = draw_lines((150, 130), count, np.random.default_rng(seed))
    assert lines.min() == 0
    assert 0 < lines.max() <= 1
    assert (lines > 0.2).mean() < 0.05 * count
    assert not draw_lines((30, 20), 0, np.random.default_rng(seed)).any()


@settings(max_examples=15)
@given(st.integers(60, 300), st.integers(60, 300), st.integers(0, 2**32))
def test_cards_of_any_size_have_ink_from_0_to_1_mostly_near_their_borders(rows, columns, seed):
    ink = draw_card((rows, columns), np.random.default_rng(seed))
    assert (ink.shape, ink.dtype) == ((rows, columns), np.float32)
    assert 0 <= ink.min() <= ink.max() <= 1
    assert (ink > 0.5).mean() < 0.25


SHAPE = (130, 110)
Y, X = np.mgrid[-1.4 : 1.4 : SHAPE[0] * 1j, -1.4 : 1.4 : SHAPE[1] * 1j]
RADIUS = np.hypot(X, Y)
NONE = np.zeros(SHAPE)
EVEN = PressureParameters(
    dryness=(0.1, 0.1), tilt=(0, 0), wear=(0, 0), outline=0, ragged=0, unevenness=0, grain=0,
    max_scratches=0, max_spots=0,
)  # fmt: skip


def pressed(parameters, seed=1, **layers):
    on_print, creases = layers.get("on_print", NONE + 1), layers.get("creases", NONE)
    return press(RADIUS, on_print, creases, np.random.default_rng(seed), parameters)


@settings(max_examples=12)
@given(preset=st.sampled_from(sorted(PRESETS)), seed=st.integers(0, 2**32))
def test_nothing_prints_far_beyond_the_outline(preset, seed):
    contact = pressed(PRESETS[preset].pressure, seed)
    assert contact.threshold[RADIUS > 1.35].min() > 1
    assert 0 < contact.strength.min() <= contact.strength.max() <= 1


def test_neither_creases_nor_what_is_no_skin_touch():
    creases, on_print = NONE.copy(), NONE + 1
    creases[60] = 1
    on_print[:, :50] = 0
    contact = pressed(EVEN, creases=creases, on_print=on_print)
    assert contact.threshold[60].min() > 1
    assert contact.threshold[:, :50].min() > 1
    assert contact.threshold[65, 55] < 0.2


@pytest.mark.parametrize(
    ("threshold", "strength"),
    [((0.0, -1.5), (1.0, 1.0)), ((0.0, 1.5), (1.0, 1.0)), ((0.5, 0.5), (1.0, 0.4))],
    ids=["filled valleys", "lost ridges", "worn skin"],
)
def test_what_is_legible_on_the_left_and_not_on_the_right(threshold, strength):
    layers = [np.where(X < 0, *sides).astype(np.float32) for sides in (threshold, strength)]
    contact = Contact(*layers, NONE.astype(np.float32))
    assert is_legible(np.array([[30.0, 60.0], [80.0, 60.0]]), contact).tolist() == [True, False]


def test_nothing_is_legible_at_or_beyond_the_border():
    contact = pressed(EVEN)
    rows, columns = SHAPE
    points = [[BORDER_PX - 1, 65], [columns - BORDER_PX + 1, 65], [55, 2], [55, rows], [-9e5, 9e5]]
    assert not is_legible(np.array(points, float), contact).any()
    assert is_legible(np.empty((0, 2)), contact).shape == (0,)


def test_stains_lie_where_the_finger_touches_and_are_no_darker_than_said():
    touching = np.zeros((120, 110))
    touching[:, :60] = 1
    stained = stain(touching, np.random.default_rng(4), SmearParameters(stain=(0.3, 0.3)))
    assert not stained[:, 60:].any()
    assert 0.05 < stained.max() <= 0.3
