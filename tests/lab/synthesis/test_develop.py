from dataclasses import replace

import numpy as np
import pytest

from fpmatch.lab.synthesis.contact import Contact
from fpmatch.lab.synthesis.develop import develop, framed
from fpmatch.lab.synthesis.sensor import SENSORS, Sensor

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


def test_residue_lies_around_the_print_and_not_far_from_it():
    threshold = np.zeros((200, 300), np.float32) + np.linspace(-1, 40, 300, dtype=np.float32)
    sensor = Sensor("damp", 300, 200, residue=1.6, paper=200, noise=0, specks=0)
    relief, rng = np.full_like(threshold, -99), np.random.default_rng(1)
    picture = develop(relief, contact_of(threshold), sensor, rng)
    near, far = picture[:, 20:60], picture[:, 250:]
    assert (near < 180).mean() > (far < 180).mean() + 0.01


def test_a_frame_covers_nothing_at_the_foot_and_all_of_the_upper_corners():
    assert not framed(SMALL).any()
    covered = framed(replace(SMALL, frame=0.2))
    assert covered[0].sum() == pytest.approx(2 * 0.2 * SMALL.width, abs=1)
    assert not covered[-1].any()
    np.testing.assert_array_equal(covered, covered[:, ::-1])
    image = bare(replace(SMALL, paper=180, frame=0.2))
    assert (image[covered == 1] == SMALL.ceiling).all()
    assert image[covered == 0].max() < 200


def test_stains_darken_the_glass():
    flat = np.zeros(SMALL.shape, np.float32)
    glass = [
        develop(flat - 9, contact_of(flat), SMALL, np.random.default_rng(1), flat + share)
        for share in (0.0, 0.3, 0.6)
    ]
    means = [picture.mean() for picture in glass]
    assert means == sorted(means, reverse=True)
    assert means[0] - means[2] > 80
