from dataclasses import replace

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
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS, Sensor, develop, framed

SHAPE = (130, 110)
Y, X = np.mgrid[-1.4 : 1.4 : SHAPE[0] * 1j, -1.4 : 1.4 : SHAPE[1] * 1j]
RADIUS = np.hypot(X, Y)
NONE = np.zeros(SHAPE)
SMOOTH = {"unevenness": 0, "grain": 0, "max_scratches": 0, "max_spots": 0}
EVEN = PressureParameters(
    dryness=(0.1, 0.1), tilt=(0, 0), wear=(0, 0), outline=0, ragged=0, **SMOOTH
)
LEFT_AND_RIGHT = np.array([[30.0, 60.0], [80.0, 60.0]])


def pressed(parameters, seed=1, **layers):
    on_print, creases = layers.get("on_print", NONE + 1), layers.get("creases", NONE)
    return press(RADIUS, on_print, creases, np.random.default_rng(seed), parameters)


def test_even_pressure_is_even_inside_and_none_beyond_the_outline():
    contact = pressed(EVEN)
    np.testing.assert_allclose(contact.threshold[RADIUS < 0.7], 0.1, atol=1e-6)
    assert contact.threshold[RADIUS > 1.05].min() > 1
    np.testing.assert_array_equal(contact.strength, 1)
    np.testing.assert_array_equal(contact.grain, 0)


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
    # a preset can hide creases
    assert pressed(PRESETS["clean"].pressure, creases=NONE + 1).threshold[65, 55] < 0.5


@pytest.mark.parametrize(
    ("threshold", "strength"),
    [((0.0, -1.5), (1.0, 1.0)), ((0.0, 1.5), (1.0, 1.0)), ((0.5, 0.5), (1.0, 0.4))],
    ids=["filled valleys", "lost ridges", "worn skin"],
)
def test_what_is_legible_on_the_left_and_not_on_the_right(threshold, strength):
    layers = [np.where(X < 0, *sides).astype(np.float32) for sides in (threshold, strength)]
    contact = Contact(*layers, NONE.astype(np.float32))
    assert is_legible(LEFT_AND_RIGHT, contact).tolist() == [True, False]


def test_nothing_is_legible_at_or_beyond_the_border():
    contact = pressed(EVEN)
    rows, columns = SHAPE
    points = [[BORDER_PX - 1, 65], [columns - BORDER_PX + 1, 65], [55, 2], [55, rows], [-9e5, 9e5]]
    assert not is_legible(np.array(points, float), contact).any()
    assert is_legible(np.empty((0, 2)), contact).shape == (0,)


def test_a_minutia_at_the_end_of_the_print_is_not_legible():
    threshold = np.zeros(SHAPE, np.float32)
    threshold[:, 60:] = 2
    contact = Contact(threshold, np.ones_like(threshold), np.zeros_like(threshold))
    points = np.array([[58.0, 60.0], [45.0, 60.0]])
    assert is_legible(points, contact).tolist() == [False, True]


def test_stains_lie_where_the_finger_touches_and_are_no_darker_than_said():
    touching = np.zeros((120, 110))
    touching[:, :60] = 1
    stained = stain(touching, np.random.default_rng(4), SmearParameters(stain=(0.3, 0.3)))
    assert not stained[:, 60:].any()
    assert 0.05 < stained.max() <= 0.3
    assert stained.dtype == np.float32
    clean = SmearParameters(stain=(0.0, 0.0))
    assert not stain(touching, np.random.default_rng(4), clean).any()


SMALL = Sensor("small", 90, 80, specks=0)


def contact_of(threshold):
    return Contact(threshold, np.ones_like(threshold), np.zeros_like(threshold))


def bare(sensor, seed=1):
    """Return a picture of nothing, far from any finger."""
    nothing = np.full(sensor.shape, 99, np.float32)
    return develop(nothing - 100, contact_of(nothing), sensor, np.random.default_rng(seed))


@pytest.mark.parametrize("sensor", SENSORS.values(), ids=str)
def test_skin_is_darker_than_glass_on_every_sensor(sensor):
    skin = np.zeros(sensor.shape, np.float32)
    skin[:, : sensor.width // 2] = 1
    flat = np.zeros(sensor.shape, np.float32)
    picture = develop(2 * skin - 1, contact_of(flat), sensor, np.random.default_rng(1))
    assert picture.shape == (sensor.height, sensor.width)
    assert picture.dtype == np.uint8
    middle = slice(sensor.height // 3, -sensor.height // 3)
    dark = picture[middle, sensor.width // 4 : sensor.width // 2 - 3]
    light = picture[middle, sensor.width // 2 + 3 : -sensor.width // 4]
    assert light.mean() - dark.mean() > 40


def test_white_glass_saturates_a_vignette_darkens_the_corners_and_stripes_run_along_columns():
    assert np.median(bare(SMALL)) == SMALL.ceiling
    picture = bare(replace(SMALL, paper=180, vignette=60))
    assert picture[30:50, 35:55].mean() > picture[:5, :5].mean() + 20
    picture = bare(replace(SMALL, paper=120, stripes=5, noise=0)).astype(float)
    assert picture.mean(axis=0).std() > 3
    assert picture.mean(axis=1).std() < 0.5


def test_a_frame_covers_nothing_at_the_foot_and_all_of_the_upper_corners():
    assert not framed(SMALL).any()
    covered = framed(replace(SMALL, frame=0.2))
    assert covered[0].sum() == pytest.approx(2 * 0.2 * SMALL.width, abs=1)
    assert not covered[-1].any()
    np.testing.assert_array_equal(covered, covered[:, ::-1])
    image = bare(replace(SMALL, paper=180, frame=0.2))
    assert (image[covered == 1] == SMALL.ceiling).all()
    assert image[covered == 0].max() < 200
