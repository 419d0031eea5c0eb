import numpy as np
import pytest

from fpmatch.errors import ImageError
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import MasterParameters, make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import Sensor
from research.training.background import BACKGROUNDS, MIN_CROP_PX, other_background, ridge_target


@pytest.fixture
def inside(whorl):
    y, x = np.mgrid[: whorl.shape[0], : whorl.shape[1]]
    return np.asarray(np.hypot(x - 110, (y - 120) * 0.9) < 100)


@pytest.mark.parametrize("seed", range(3))
def test_backgrounds(whorl, inside, seed):
    made = {
        kind: other_background(whorl, inside, kind, np.random.default_rng(seed))
        for kind in BACKGROUNDS
    }
    assert np.array_equal(made["own"], whorl)
    assert min(made["none"].shape) >= MIN_CROP_PX
    assert (made["none"] == 255).mean() < 0.05
    assert made["dark"][0].max() < 255
    middle = (slice(100, 140), slice(90, 130))
    assert np.array_equal(made["dark"][middle], whorl[middle])
    assert made["vignette"][0, 0] < 255
    assert all(image.dtype == np.uint8 for image in made.values())


def test_no_print_and_no_such_kind(whorl, rng):
    nowhere = np.zeros(whorl.shape, bool)
    assert np.array_equal(other_background(whorl, nowhere, "none", rng), whorl)
    with pytest.raises(ImageError, match="no background 'blue': there are own, none"):
        other_background(whorl, nowhere, "blue", rng)


SENSOR = Sensor("small", 100, 130)


@pytest.fixture(scope="module")
def master():
    return make_master(7, 1, MasterParameters(shape=(170, 130)))


def impression_of(master, preset, number=1):
    return make_impression(master, number, PRESETS[preset], SENSOR)


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_the_target_covers_the_picture_and_is_nothing_off_the_print(master, preset):
    made = impression_of(master, preset)
    relief, inside = ridge_target(made, master)
    assert relief.shape == inside.shape == made.image.shape
    assert (relief.dtype, inside.dtype) == (np.float32, bool)
    assert (np.abs(relief) <= 1 + 1e-5).all()
    assert not relief[~inside].any()
    assert inside.any()


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_clean_picture_is_dark_on_ridges_and_light_in_valleys(master, number):
    made = impression_of(master, "clean", number)
    relief, inside = ridge_target(made, master)
    assert made.image[relief > 0.5].mean() + 60 < made.image[inside & (relief < -0.5)].mean()
    assert ((made.image < 128) == (relief > 0))[inside].mean() > 0.8
