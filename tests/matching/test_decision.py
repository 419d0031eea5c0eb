"""`fpmatch.matching.decision`: a third outcome where prints lack evidence, and only there."""

from dataclasses import replace
from itertools import product

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import fragment
from skimage import data

from fpmatch import Minutiae, extract, verify
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.decision import (
    INCONCLUSIVE,
    MATCH,
    NO_FINGER,
    NO_MATCH,
    decide,
    evidence_in,
    lacks_ridges,
    reachable_scores,
    reachable_similarities,
)
from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
from fpmatch.matching.registry import get_matcher, matcher_names
from fpmatch.matching.verify import verify as verify_templates

MATCHER = get_matcher("unit-circle")
SENTENCE = "the quick brown fox jumps over the lazy dog 0123"


def text(scale=0.55, step=23, size=(480, 640)):
    page = np.full(size, 255, np.uint8)
    for y in range(step, size[0], step):
        cv2.putText(page, SENTENCE, (8, y), cv2.FONT_HERSHEY_SIMPLEX, scale, 0, 1, cv2.LINE_AA)
    return page


def screenshot():
    page = np.full((600, 800), 235, np.uint8)
    cv2.rectangle(page, (0, 0), (800, 40), 60, -1)
    for k in range(10):
        cv2.rectangle(page, (20, 60 + 50 * k), (220, 95 + 50 * k), 120 + 8 * k, -1)
        cv2.putText(page, SENTENCE, (260, 85 + 50 * k), cv2.FONT_HERSHEY_SIMPLEX, 0.5, 20, 1)
        cv2.line(page, (260, 92 + 50 * k), (780, 92 + 50 * k), 150, 1)
    return page


def one_ridge():
    page = np.full((374, 388), 255, np.uint8)
    cv2.ellipse(page, (190, 190), (100, 140), 0, 0, 300, 0, 5, cv2.LINE_AA)
    return page


def noise(blur):
    pixels = np.random.default_rng(7).normal(128, 40, (374, 388))
    blurred = cv2.GaussianBlur(pixels, (0, 0), blur) if blur else pixels
    return cv2.normalize(blurred, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)


NO_PRINTS = {
    "blank": lambda: np.full((374, 388), 255, np.uint8),
    "black": lambda: np.zeros((374, 388), np.uint8),
    "noise": lambda: noise(0),
    "smooth noise": lambda: noise(2.2),
    "text": text,
    "large text": lambda: text(0.8, 28, (480, 400)),
    "screenshot": screenshot,
    "one ridge": one_ridge,
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
        assert (found.decision, found.shortage.code) == (INCONCLUSIVE, NO_FINGER)
        assert "shows no finger: its minutiae do not lie along its own ridges" in found.reason
        assert found.fmr > 0.005
        unheld = UnitCircleMatcher(beyond_share=0.0).compare(*map(MATCHER.prepare, pair))
        assert unheld.similarity > 2 * found.similarity
    assert verify(turned, impostor).shortage.code == NO_FINGER


def test_whole_prints_of_two_fingers_do_not_match(print_, impostor):
    found = verify(print_, impostor)
    assert (found.decision, found.match, found.shortage) == (NO_MATCH, False, None)
    assert found.reachable_score > found.threshold
    same = verify(print_, print_)
    assert (same.decision, same.match, same.shortage) == (MATCH, True, None)


@pytest.mark.parametrize("minutiae", [1, 2, 3, 4])
def test_a_fragment_is_too_little_skin(print_, impostor, minutiae):
    part = fragment(print_, minutiae)
    for pair in ((part, impostor), (impostor, part)):
        found = verify(*pair)
        assert (found.decision, found.shortage.code) == (INCONCLUSIVE, "too little skin")
        assert "mm² in the smaller print" in found.reason
    bare = replace(part, field=None)
    assert verify(bare, impostor).decision == INCONCLUSIVE


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


def test_many_are_decided_as_one_by_one(print_, impostor):
    prints = [print_, impostor, *(fragment(print_, k) for k in (2, 3, 8, 20))]
    prints.append(replace(impostor, field=None))
    evidence = np.stack([evidence_in(MATCHER, one, MATCHER.prepare(one)) for one in prints])
    curve = load_calibration(MATCHER.name)
    for threshold in (20.0, 40.0, 90.0):
        for k, probe in enumerate(prints):
            found = [verify(probe, other, threshold=threshold) for other in prints]
            similar = reachable_similarities(MATCHER, evidence[k], evidence)
            reachable = reachable_scores(curve, similar)
            outcome = decide([one.match for one in found], reachable, threshold)
            assert outcome.tolist() == [one.decision for one in found]


def test_scattered_and_straight_ridges_are_not_those_of_a_finger(print_):
    field = print_.field
    assert lacks_ridges(print_) == ""
    assert lacks_ridges(replace(print_, field=None)) == ""
    rows, columns = np.indices(field.mask.shape)
    scattered = replace(field, mask=field.mask & ((rows // 3 + columns // 3) % 4 == 0))
    assert "scattered" in lacks_ridges(replace(print_, field=scattered))
    straight = replace(field, orientation=np.full_like(field.orientation, 0.1))
    assert "straight" in lacks_ridges(replace(print_, field=straight))
    small = fragment(replace(print_, field=straight), 3)
    assert lacks_ridges(small) == ""  # so few may be


def test_a_threshold_that_no_genuine_pair_reaches_is_named(print_, impostor):
    found = verify(print_, impostor, threshold=100)
    assert (found.decision, found.shortage.code) == (INCONCLUSIVE, "threshold too high")
