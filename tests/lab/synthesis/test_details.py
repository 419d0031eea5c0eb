"""What sensors and cards show of detailed skin."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.lab.synthesis.contact import Contact
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS, Sensor, as_set, develop, draw_card

SIDE = 90
PLAIN = Sensor("plain", SIDE, SIDE, paper=220.0, noise=0.0, specks=0, ink_variation=0.0)


def developed(sensor, relief, seed=3):
    flat = np.zeros(sensor.shape, np.float32)
    contact = Contact(flat, flat + 1, flat)
    numbers = (np.random.default_rng(seed) for _ in range(2))
    return develop(relief, contact, sensor, next(numbers), 0.0, next(numbers)).astype(float)


@settings(max_examples=20)
@given(st.sampled_from(sorted(SENSORS)), st.integers(0, 2**32))
def test_a_sensor_as_set_is_near_the_usual_one(name, seed):
    sensor = SENSORS[name]
    found = as_set(sensor, np.random.default_rng(seed))
    assert found == as_set(sensor, np.random.default_rng(seed))
    settings = ("paper", "ink", "softness", "blur", "ink_variation")
    assert replace(found, **{n: getattr(sensor, n) for n in settings}) == sensor
    assert found.ink < found.paper
    assert min(found.softness, found.blur) > 0


@pytest.mark.parametrize("native", [0.5, 0.72])
def test_repeated_pixels_stay_where_they_are(native):
    """A slope of grey levels is a staircase around the same line, with fewer levels."""
    slope = np.linspace(-1, 1, SIDE, dtype=np.float32) * np.ones((SIDE, 1), np.float32)
    smooth = replace(PLAIN, softness=0.5)
    whole, repeated = (developed(replace(smooth, native=n), slope) for n in (1.0, native))
    assert np.abs((whole - repeated).mean()) < 1.5
    steps = np.count_nonzero(np.diff(repeated.mean(axis=0)))
    assert steps == pytest.approx(native * SIDE, rel=0.2)


def test_speckle_frays_edges_only_and_grain_is_in_the_ink():
    rows = np.cos(np.arange(SIDE) * 2 * np.pi / 30)[:, None].astype(np.float32)
    skin = rows * np.ones((1, SIDE), np.float32)
    crisp = replace(PLAIN, softness=0.08)
    plain, speckled = (developed(replace(crisp, speckle=s), skin) for s in (0.0, 0.2))
    rough = np.abs(plain - speckled).mean(axis=1)
    assert rough[np.abs(rows[:, 0]) < 0.3].mean() > 2 * rough[np.abs(rows[:, 0]) > 0.9].mean()
    grainy = developed(replace(crisp, ink_grain=20.0), skin)
    assert grainy[rows[:, 0] > 0.7].std() > plain[rows[:, 0] > 0.7].std() + 5
    assert grainy[rows[:, 0] < -0.9].std() < 3


@settings(max_examples=15)
@given(st.integers(60, 300), st.integers(60, 300), st.integers(0, 2**32))
def test_cards_of_any_size_have_ink_from_0_to_1_mostly_near_their_borders(rows, columns, seed):
    ink = draw_card((rows, columns), np.random.default_rng(seed))
    assert ink.shape == (rows, columns)
    assert ink.dtype == np.float32
    assert 0 <= ink.min() <= ink.max() <= 1
    assert (ink > 0.5).mean() < 0.25


def test_a_card_is_seen_beside_the_print():
    nothing = np.full((SIDE, SIDE), -9, np.float32)
    empty = developed(PLAIN, nothing)
    darkest = [developed(replace(PLAIN, card=True), nothing, seed).min() for seed in range(4)]
    assert min(darkest) < 150
    assert empty.min() > 215


def test_rolled_prints_are_wider_than_flat_ones():
    """The truth of both is that of one finger, whose minutiae lie on ridges of the image."""
    rolled, flat = PRESETS["rolled"], PRESETS["normal"]
    master = make_master(5, 2, rolled.master)
    sensor = SENSORS["rolled-512x512"]
    wide, narrow = (make_impression(master, 1, preset, sensor) for preset in (rolled, flat))
    assert len(wide.minutiae) > 0.8 * len(master.minutiae)
    assert wide.visible.sum() > 1.5 * narrow.visible.sum()
    assert wide.image.shape == (512, 512)
