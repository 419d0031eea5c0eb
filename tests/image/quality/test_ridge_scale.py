"""Images of small sensors, 96 by 103 pixels, whose file states a resolution that is not theirs."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from fpmatch.image.extract import assess
from fpmatch.image.io.read import decode_image
from fpmatch.image.quality.print_quality import why_no_minutiae
from fpmatch.image.quality.ridge_scale import (
    common_dpi,
    contradiction,
    likely_dpi,
    possible_dpi,
    ridge_period_px,
)
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI
from tests.image.made_files import saved
from tests.image.made_images import concentric_rings


def rings(period, shape=(300, 260), noise=12.0):
    """Return grey ridges around the middle of an image."""
    rng = np.random.default_rng(1)
    values = 128 + 90 * concentric_rings(shape, period) + rng.normal(0, noise, shape)
    return values.clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("period", [3.5, 5.0, 9.0, 14.0, 20.0])
def test_the_period_is_measured_in_pixels(period):
    assert ridge_period_px(rings(period)) == pytest.approx(period, rel=0.05)


@pytest.mark.parametrize("dpi", [120, 180, 250, 1000, 1200])
def test_a_resolution_that_puts_ridges_too_far_apart_or_too_close_is_ignored(dpi):
    grey = rings(9.0)
    data = saved(grey, "PNG", dpi=(dpi, dpi))
    image = decode_image(data, "print.png", polarity="dark")
    apart = 9 * 25.4 / dpi
    assert image.dpi is None
    (note,) = image.notes
    assert note.startswith(f"at its resolution of {dpi} dpi ridges would be ")
    assert float(note.split(" mm")[0].split()[-1]) == pytest.approx(apart, rel=0.06)
    assert note.endswith(": ignored")
    forced = decode_image(data, "print.png", polarity="dark", dpi=dpi)
    assert (forced.dpi, forced.notes) == (dpi, ())


@pytest.mark.parametrize("dpi", [180, 300, 700, 1200])
@pytest.mark.parametrize("millimetres", [0.33, 0.6])
def test_a_right_resolution_is_kept_and_a_usual_one_not_questioned(dpi, millimetres):
    grey = rings(millimetres * dpi / 25.4)
    data = saved(grey, "PNG", dpi=(dpi, dpi))
    image = decode_image(data, "print.png", polarity="dark")
    assert (image.dpi, image.notes) == (dpi, ())
    assert not any(contradiction(rings(20.0), usual) for usual in (450, 508, 600))


@given(st.integers(1, 200), st.integers(1, 200), st.sampled_from([0, 1, 5, 60]), st.integers(0, 9))
def test_what_shows_no_ridges_contradicts_nothing(height, width, noise, seed):
    rng = np.random.default_rng(seed)
    grey = (128 + noise * rng.standard_normal((height, width))).clip(0, 255).astype(np.uint8)
    grey[: height // 2] //= 2
    assert not contradiction(grey, 180)
    if not noise:
        assert likely_dpi(grey) == 500


SAMPLE = Path(__file__).parents[3] / "sample_data" / "101_1.tif"
SIZE = (96, 103)


def shrunk(factor):
    """Return the middle of a sample print, of 500 dpi, as an image of 500 / `factor` dpi."""
    with Image.open(SAMPLE) as whole:
        centre = np.array(whole.size) / 2
        half = factor * np.array(SIZE) / 2
        part = whole.convert("L").crop((*(centre - half).tolist(), *(centre + half).tolist()))
        return np.asarray(part.resize(SIZE, Image.Resampling.LANCZOS))


@pytest.mark.parametrize("factor", [1.5, 2.0, 2.5, 3.0, 3.6])
def test_the_likely_resolution_is_named(factor):
    quality = assess(shrunk(factor), 500).quality
    (reason,) = quality.reasons
    assert why_no_minutiae(quality).startswith("no minutiae found; wrong resolution: ridges lie ")
    assert quality.at_found_resolution().reasons == ()
    assert reason.code == "wrong resolution"
    assert reason.dpi == pytest.approx(500 / factor, rel=0.1)
    assert f"about {reason.dpi:.0f} dpi" in reason.message
    assert not any(
        r.code == reason.code for r in assess(shrunk(factor), reason.dpi).quality.reasons
    )


@pytest.mark.parametrize("dpi", [140, 200, 250, 500, 508, 512, 1000, 1500, 2000])
def test_the_likely_resolution_of_a_print_that_states_none(dpi):
    grey = rings(0.46 * dpi / 25.4, shape=(round(0.6 * dpi), round(0.52 * dpi)))
    near = {140: 150, 508: 500, 512: 500}.get(dpi, dpi)
    assert likely_dpi(grey) == pytest.approx(near, rel=0.3 if dpi == 200 else 0.12)


@given(st.floats(0.5, 200), st.tuples(st.integers(1, 9000), st.integers(1, 9000)))
def test_a_possible_resolution_makes_no_image_too_large_or_small(period, shape):
    for one in (period, None):
        possible = possible_dpi(one, shape)
        assert possible
        assert all(MIN_DPI <= dpi <= MAX_DPI for dpi in possible)
        others = [dpi / 500 for dpi in possible if dpi != 500]
        assert all(min(shape) >= 32 * by for by in others)
        assert all(by >= 1 or shape[0] * shape[1] <= 4e6 * by**2 * 1.001 for by in others)
    if 0.29 <= period * 25.4 / 500 <= 0.7:
        assert possible_dpi(period, shape)[0] == 500


@given(st.lists(st.floats(2.0, 200.0), min_size=1, max_size=40), st.randoms())
def test_the_order_of_prints_changes_no_resolution(periods, random):
    shuffled = random.sample(periods, len(periods))
    assert common_dpi(shuffled) == common_dpi(periods)
