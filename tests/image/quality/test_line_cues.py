import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.image.quality import line_cues as line_cues_module
from fpmatch.image.quality.line_cues import LINE_CUES, line_cues
from tests.image.made_images import hostile_pictures


def stripes(shape=(160, 160)):
    x = np.broadcast_to(np.arange(shape[1]), shape)
    return 128 + 90 * np.cos(x * 0.7)


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.floats(0, 60), st.integers(40, 200), st.integers(40, 200))
def test_the_negative_has_the_other_sign(seed, noise, rows, columns):
    rng = np.random.default_rng(seed)
    image = stripes((rows, columns)) + noise * rng.standard_normal((rows, columns))
    image = image.clip(0, 255).astype(np.uint8)
    cues, negative = line_cues(image), line_cues(255 - image)
    assert (cues is None) == (negative is None)
    if cues is not None and negative is not None:
        assert cues == pytest.approx(-negative, abs=0.02)


def test_pores_are_dots_in_dark_lines_and_wide_lines_a_larger_share():
    y, x = np.mgrid[:160, :160]
    dark = np.cos(x * 0.7) < -0.95
    cues = line_cues(np.where(dark & (y % 12 == 0), 220, stripes()).astype(np.uint8))
    found = dict(zip(LINE_CUES, cues.tolist(), strict=True))
    assert min(found[cue] for cue in ("dots", "gaps along crests", "roughness along crests")) > 1
    wide = line_cues((128 - 90 * np.sign(np.cos(x * 0.7) + 0.4)).astype(np.uint8))
    assert wide[LINE_CUES.index("share of dark")] > 0.05


def test_hostile_pictures_give_none_or_numbers_and_small_ones_none():
    for picture in hostile_pictures().values():
        cues = line_cues(picture)
        assert cues is None or np.isfinite(cues).all()
    for shape in ((1, 1), (1, 500), (31, 31)):
        assert line_cues(stripes(shape).astype(np.uint8)) is None


def test_the_middle_of_a_large_image_is_measured(pressed, monkeypatch):
    whole = line_cues(pressed[0])
    monkeypatch.setattr(line_cues_module, "MAX_SIDE", 128)
    middle = line_cues(pressed[0])
    assert not np.array_equal(whole, middle)
