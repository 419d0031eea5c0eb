import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.errors import ImageError
from fpmatch.image.folder_traits import common_polarity
from fpmatch.image.quality import line_cues as lines
from fpmatch.image.quality.line_cues import (
    LINE_CUES,
    MAX_EVIDENCE,
    WEIGHTS_FILE,
    evidence_of_cues,
    line_cues,
    polarity_evidence,
)
from fpmatch.image.quality.measures import LinearWeights
from fpmatch.image.quality.polarity import (
    MIN_EVIDENCE,
    POLARITIES,
    background_level,
    check_polarity,
    is_inverted,
)
from research.training.background import other_background
from tests.image.made_images import hostile_pictures


def test_prints_on_white_and_their_negatives(pressed):
    for image in pressed:
        assert background_level(image) == 1
        assert polarity_evidence(image) > 0
        assert not is_inverted(image)
        assert is_inverted(255 - image)


def test_the_lines_tell_where_the_background_does_not(pressed):
    middles = [image[120:270, 110:270] for image in pressed]
    assert [background_level(middle) for middle in middles] == [0, 0, 0, 0]
    evidence = [polarity_evidence(middle) for middle in middles]
    assert common_polarity(evidence) == "dark"
    assert common_polarity([-one for one in evidence]) == "white"


def test_a_dark_background_alone_is_not_enough(stripes, pressed):
    assert background_level(255 - stripes) == -1
    assert not is_inverted(255 - stripes)
    for number, image in enumerate(pressed):
        inside = cv2.dilate((image < 150).astype(np.uint8), np.ones((15, 15), np.uint8)) > 0
        rng = np.random.default_rng(number)
        darkened = other_background(image, inside, "dark", rng)
        assert background_level(darkened) < 0.5
        assert not is_inverted(darkened)


@pytest.mark.parametrize("ground", [160, 200, 255])
def test_a_grey_background_and_one_of_both_kinds(whorl, rng, ground):
    noisy = np.where(whorl == 255, ground, whorl * 0.8) + rng.normal(0, 2, whorl.shape)
    grey = noisy.clip(0, 255).astype(np.uint8)
    assert background_level(grey) > 0 > background_level(255 - grey)
    assert background_level(np.pad(whorl, ((0, 0), (64, 64)))) == 0


@pytest.mark.parametrize("picture", hostile_pictures().values(), ids=hostile_pictures())
def test_no_print_no_ridges(picture):
    assert not is_inverted(picture)
    assert abs(polarity_evidence(picture)) < MIN_EVIDENCE


def test_large_and_tiny_images(pressed, monkeypatch):
    twice = pressed[0].repeat(2, axis=0).repeat(2, axis=1)
    assert polarity_evidence(twice, 1000) > 0
    monkeypatch.setattr(lines, "MAX_PX", 10_000_000)
    assert polarity_evidence(twice, 100) == 0
    assert polarity_evidence(np.zeros((15, 300), np.uint8)) == 0
    assert polarity_evidence(pressed[0][:1, :1], 4000) == 0


@given(st.lists(st.floats(-8, 8), max_size=40))
def test_the_negatives_of_a_folder_are_decided_the_other_way(evidence):
    other = {"dark": "white", "white": "dark", "auto": "auto"}
    assert common_polarity([-one for one in evidence]) == other[common_polarity(evidence)]


@given(st.lists(st.floats(-100, 100), min_size=7, max_size=7))
def test_evidence_is_bounded_and_has_no_constant_term(cues):
    weights = LinearWeights.load(WEIGHTS_FILE, LINE_CUES)
    found, negative = (evidence_of_cues(sign * np.array(cues), weights) for sign in (1, -1))
    assert abs(found) <= MAX_EVIDENCE
    assert negative == pytest.approx(-found)


def test_only_known_polarities():
    assert [check_polarity(known) for known in POLARITIES] == list(POLARITIES)
    with pytest.raises(ImageError, match=r"None: .*auto, dark, white"):
        check_polarity(None)


def waves(shape=(160, 160)):
    x = np.broadcast_to(np.arange(shape[1]), shape)
    return 128 + 90 * np.cos(x * 0.7)


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.floats(0, 60), st.integers(40, 200), st.integers(40, 200))
def test_the_negative_has_the_other_sign(seed, noise, rows, columns):
    rng = np.random.default_rng(seed)
    image = waves((rows, columns)) + noise * rng.standard_normal((rows, columns))
    image = image.clip(0, 255).astype(np.uint8)
    cues, negative = line_cues(image), line_cues(255 - image)
    assert (cues is None) == (negative is None)
    if cues is not None and negative is not None:
        assert cues == pytest.approx(-negative, abs=0.02)


def test_pores_are_dots_in_dark_lines_and_wide_lines_a_larger_share():
    y, x = np.mgrid[:160, :160]
    dark = np.cos(x * 0.7) < -0.95
    cues = line_cues(np.where(dark & (y % 12 == 0), 220, waves()).astype(np.uint8))
    found = dict(zip(LINE_CUES, cues.tolist(), strict=True))
    assert min(found[cue] for cue in ("dots", "gaps along crests", "roughness along crests")) > 1
    wide = line_cues((128 - 90 * np.sign(np.cos(x * 0.7) + 0.4)).astype(np.uint8))
    assert wide[LINE_CUES.index("share of dark")] > 0.05


def test_hostile_pictures_give_none_or_numbers_and_small_ones_none():
    for picture in hostile_pictures().values():
        cues = line_cues(picture)
        assert cues is None or np.isfinite(cues).all()
    for shape in ((1, 1), (1, 500), (31, 31)):
        assert line_cues(waves(shape).astype(np.uint8)) is None


def test_the_middle_of_a_large_image_is_measured(pressed, monkeypatch):
    whole = line_cues(pressed[0])
    monkeypatch.setattr(lines, "MAX_SIDE", 128)
    middle = line_cues(pressed[0])
    assert not np.array_equal(whole, middle)
