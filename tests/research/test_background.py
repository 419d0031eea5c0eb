"""Only what is meant to change does."""

import numpy as np
import pytest

from fpmatch.errors import ImageError
from research.training.background import BACKGROUNDS, MIN_CROP_PX, other_background


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
