"""`fpmatch.matching.decision`: a third outcome where prints lack evidence, and only there."""

import re
from dataclasses import replace
from itertools import product

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import fragment
from skimage import data

from fpmatch import Minutiae, Template, extract, verify
from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
from fpmatch.matching.registry import get_matcher, matcher_names
from fpmatch.matching.result import INCONCLUSIVE, MATCH, NO_MATCH
from fpmatch.matching.scale import MIN_PAIRS, measure_scale
from fpmatch.matching.verify import verify as verify_templates

MATCHER = get_matcher("unit-circle")
FORM = (
    r"(\d+) minutiae on (\d+) mm² in the smaller print, where about (\d+) on (\d+) mm² are "
    r"usually needed for a score of 40\.0"
)
SENTENCE = "the quick brown fox jumps over the lazy dog 0123"


def text():
    page = np.full((480, 640), 255, np.uint8)
    for y in range(23, 480, 23):
        cv2.putText(page, SENTENCE, (8, y), cv2.FONT_HERSHEY_SIMPLEX, 0.55, 0, 1, cv2.LINE_AA)
    return page


NO_PRINTS = {
    "blank": lambda: np.full((374, 388), 255, np.uint8),
    "noise": lambda: np.random.default_rng(7).integers(0, 256, (374, 388)).astype(np.uint8),
    "text": text,
    "face": lambda: data.astronaut()[:240, 120:360].mean(axis=2).astype(np.uint8),
    "photograph": lambda: data.astronaut().mean(axis=2).astype(np.uint8),
}


@pytest.fixture(scope="module")
def impostor(fingers):
    return extract(fingers[1], dpi=500)


@pytest.mark.parametrize("name", NO_PRINTS)
def test_what_is_no_print_is_inconclusive(print_, name):
    picture = extract(NO_PRINTS[name](), dpi=500)
    pairs = ((picture, print_), (print_, picture), (picture, picture))
    for pair, matcher in product(pairs, matcher_names()):
        found = verify(*pair, matcher=matcher)
        if not found.match:  # a picture and itself may well be the same
            assert found.decision == INCONCLUSIVE, found.reason
            if name != "face":  # a few of its lines lie together, like those of a fragment
                assert found.shortage.code == "no ridges"
                assert "has no ridges" in found.reason


def test_minutiae_across_their_own_ridges_match_nothing(print_, impostor):
    m = print_.minutiae
    turned = replace(print_, minutiae=Minutiae(m.x, m.y, m.angle + np.pi / 2, m.kind, m.quality))
    bare = replace(turned, field=None)
    assert verify(bare, bare).match
    for pair in product((turned, bare), repeat=2):
        if pair == (bare, bare):
            continue
        found = verify(*pair)
        assert (found.decision, found.shortage.code) == (INCONCLUSIVE, "no finger")
        assert "shows no finger: its minutiae do not lie along its own ridges" in found.reason
        assert found.fmr > 0.005
        unheld = UnitCircleMatcher(beyond_share=0.0).compare(*map(MATCHER.prepare, pair))
        assert unheld.similarity > 2 * found.similarity
    assert verify(turned, impostor).shortage.code == "no finger"


@given(st.integers(1, 40), st.floats(0, 100), st.floats(0, 100))
def test_a_higher_threshold_never_makes_an_outcome_clearer(print_, impostor, minutiae, one, other):
    part = fragment(print_, minutiae)
    low, high = (verify(part, impostor, threshold=t).decision for t in sorted([one, other]))
    assert (low, high) in {
        *((MATCH, later) for later in (MATCH, NO_MATCH, INCONCLUSIVE)),
        *((NO_MATCH, later) for later in (NO_MATCH, INCONCLUSIVE)),
        (INCONCLUSIVE, INCONCLUSIVE),
    }
    assert verify(impostor, part, threshold=one).decision == (
        verify(part, impostor, threshold=one).decision
    )


def test_an_assumed_resolution_that_decides_is_named(fingers, print_):
    from fpmatch.image.io.grey import GreyImage

    large = cv2.resize(fingers[0], None, fx=1.6, fy=1.6, interpolation=cv2.INTER_CUBIC)
    taken_as_500 = verify(GreyImage(large, dpi=500), print_)
    found = verify_templates(taken_as_500.probe, print_, dpi_assumed=("probe",))
    assert (found.decision, found.shortage.code) == (INCONCLUSIVE, "unknown resolution")
    assert "the resolution of the probe is unknown" in found.reason
    assert taken_as_500.decision == NO_MATCH
    assert verify(GreyImage(large, dpi=800), print_).decision == MATCH


def test_whole_prints_of_two_fingers_do_not_match(print_, impostor):
    found = verify(print_, impostor)
    assert (found.decision, found.match, found.shortage) == (NO_MATCH, False, None)
    assert found.reachable_score > found.threshold
    same = verify(print_, print_)
    assert (same.decision, same.match, same.shortage) == (MATCH, True, None)
    assert same.reachable_score > same.threshold
    most = verify(print_, impostor, threshold=100)
    assert (most.decision, most.shortage.code) == (INCONCLUSIVE, "threshold too high")


@pytest.mark.parametrize("minutiae", [1, 2, 3, 4])
def test_a_fragment_is_too_little_skin(print_, impostor, minutiae):
    part = fragment(print_, minutiae)
    for pair in ((part, impostor), (impostor, part)):
        found = verify(*pair)
        assert (found.decision, found.shortage.code) == (INCONCLUSIVE, "too little skin")
        assert "mm² in the smaller print" in found.reason
        if minutiae > 1:
            here, area, needed, needed_area = map(int, re.fullmatch(FORM, found.reason).groups())
            assert (here < needed, area < needed_area) == (True, True)
        assert found.reachable_score < found.threshold
    bare = replace(part, field=None)
    assert verify(bare, impostor).decision == INCONCLUSIVE


PAIRS = np.column_stack([np.arange(30)] * 2)


@pytest.fixture(scope="module")
def scattered():
    rng = np.random.default_rng(11)
    places = rng.uniform(0, 380, (2, 30))
    return Template(Minutiae(*places, rng.uniform(0, 6, 30)), width=388, height=374)


def moved(template, scale, noise_px=0.0, seed=1):
    """Return a print turned by half a radian and larger by `scale`, its minutiae jittered."""
    rng = np.random.default_rng(seed)
    m = template.minutiae
    places = (m.x + 1j * m.y) * scale * np.exp(0.5j) + 40 + 25j
    places += rng.normal(0, noise_px, len(m)) + 1j * rng.normal(0, noise_px, len(m))
    return replace(template, minutiae=Minutiae(places.real, places.imag, m.angle), field=None)


@pytest.mark.parametrize("factor", [1.0, 0.88, 1.138, 0.5, 2.0])
def test_a_wrong_resolution_is_found_match_or_not(print_, factor):
    decision = verify(replace(print_, dpi=print_.dpi * factor), print_)
    found = decision.scale
    assert found.differs == (factor != 1.0)
    assert found.ratio == pytest.approx(factor, rel=0.02)
    if factor in (0.5, 2.0):
        assert not decision.match  # and stays so: the scale is a reason, not a yes


def test_different_fingers_have_no_scale(fingers):
    a, b = (extract(pixels, dpi=500) for pixels in fingers)
    assert verify(a, b).scale is None
    at_the_edge = replace(a, dpi=110.0)
    assert verify(at_the_edge, b).scale is None


@given(st.floats(0.5, 2), st.floats(150, 1200), st.floats(150, 1200), st.integers(0, 1000))
def test_lengths_are_compared_in_millimetres_and_both_ways_alike(scattered, scale, p, q, seed):
    probe = replace(scattered, dpi=p)
    for noise_px, within in ((0.0, 1e-5), (4.0, 0.1)):
        reference = replace(moved(scattered, scale, noise_px, seed), dpi=q)
        there = measure_scale(probe, reference, PAIRS)
        assert there.ratio == pytest.approx(scale * p / q, rel=within)
        assert there.error < within * there.ratio
        back = measure_scale(reference, probe, PAIRS)
        assert there.ratio * back.ratio == pytest.approx(1, abs=1e-9)
        assert there.differs == back.differs


def test_skin_is_let_be_and_a_wrong_resolution_is_not(scattered):
    for scale, differs in ((1.0, False), (1.05, False), (0.95, False), (1.138, True), (0.88, True)):
        measured = measure_scale(scattered, moved(scattered, scale, 2.0), PAIRS)
        assert measured.differs is differs, scale
    vague = moved(scattered, 1.0, 60.0, seed=1), moved(scattered, 1.1, 60.0, seed=2)
    assert not measure_scale(*vague, PAIRS).differs
    assert measure_scale(scattered, scattered, PAIRS[: MIN_PAIRS - 1]) is None
    heap = replace(scattered, minutiae=Minutiae(np.ones(30), np.ones(30), np.ones(30)))
    assert measure_scale(heap, heap, PAIRS) is None
    found = [measure_scale(scattered, moved(scattered, 1.0, 5.0, k), PAIRS) for k in range(200)]
    expected = np.mean([one.error for one in found])  # as large as the scatter
    assert np.std([one.ratio for one in found]) == pytest.approx(expected, rel=0.25)
