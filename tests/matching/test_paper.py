import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.matchers.paper import MATCHER, PaperMatcher
from fpmatch.matching.registry import get_matcher
from fpmatch.matching.verify import verify
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template


def template_of(xy, dpi=500.0):
    minutiae = Minutiae(x=xy[:, 0], y=xy[:, 1], angle=np.zeros(len(xy)))
    return Template(minutiae, width=400, height=400, dpi=dpi)


def positions(seed, n=35):
    return np.random.default_rng(seed).uniform(20, 380, (n, 2)).round()


def compare(probe, reference):
    return MATCHER.compare(MATCHER.prepare(probe), MATCHER.prepare(reference))


@pytest.fixture
def worn():
    """Return a print's minutiae, those of a second impression, and the transform between them."""
    rng = np.random.default_rng(3)
    p = positions(3, 40)
    move = Similarity(1.0, 0.3, 40.0, -25.0)
    q = move.apply(p + rng.normal(0, 1.5, p.shape))
    return p, q[(q[:, 0] < 380) | (q[:, 1] < 200)], move


def test_second_impression_matches(worn):
    p, q, move = worn
    found = compare(template_of(p), template_of(q))
    assert get_matcher("paper") is MATCHER
    assert found.similarity > 0.9
    assert found.reason == ""
    assert found.rms_px < 3
    assert found.agreement > 0.9
    assert 0.7 < found.overlap <= 1
    assert found.transform.apply(p) == pytest.approx(move.apply(p), abs=4)
    fine = compare(template_of(p), template_of(q * 2, dpi=1000))
    assert fine.rms_px == pytest.approx(2 * found.rms_px, rel=1e-3)
    assert fine.pairs.tolist() == found.pairs.tolist()


def test_impostors_are_less_similar_than_impressions(worn):
    p, q, _ = worn
    genuine = compare(template_of(p), template_of(q))
    for seed in range(10, 20):
        impostor = compare(template_of(p), template_of(positions(seed)))
        assert impostor.similarity < 0.7 * genuine.similarity
        assert impostor.agreement < genuine.agreement


@pytest.mark.parametrize(("probe_dpi", "reference_dpi"), [(1000, 500), (500, 569), (1000, 250)])
def test_transform_is_in_the_pixels_of_both_inputs(probe_dpi, reference_dpi):
    p = positions(5)
    q = Similarity(1.0, -0.5, 12.0, 90.0).apply(p)
    probe, reference = p * probe_dpi / 500, q * reference_dpi / 500
    found = compare(template_of(probe, probe_dpi), template_of(reference, reference_dpi))
    assert found.similarity == 1
    assert found.transform.apply(probe) == pytest.approx(reference, abs=1e-2)
    assert found.transform.scale == pytest.approx(reference_dpi / probe_dpi, rel=1e-4)


@given(st.integers(0, 10_000), st.sampled_from([500.0, 569.0]))
def test_exchanging_the_sides_gives_the_same_to_the_last_bit(seed, dpi):
    rng = np.random.default_rng(seed)
    p = positions(seed, int(rng.integers(0, 30)))
    q = np.vstack([p[::2] + rng.normal(0, 2, p[::2].shape), positions(seed + 1, 12)])
    sides = template_of(p, dpi), template_of(q)
    forth, back = compare(*sides), compare(*sides[::-1])
    assert forth.similarity == back.similarity
    assert 0 <= forth.similarity <= 1
    assert 0 <= forth.agreement <= 1
    assert 0 <= forth.overlap <= 1
    assert math.isfinite(forth.rms_px)
    assert {*map(tuple, forth.pairs.tolist())} == {(j, i) for i, j in back.pairs.tolist()}
    assert (forth.transform is None) == (back.transform is None)
    if forth.transform:
        again = back.transform.inverse()
        assert again.apply(p) == pytest.approx(forth.transform.apply(p), abs=1e-6)
        assert forth.agreement == pytest.approx(back.agreement, abs=0.1)


@pytest.mark.parametrize(
    ("probe", "reference", "reason"),
    [
        (positions(1, 0), positions(2), "too few minutiae: 0 in the probe"),
        (positions(1), positions(2, 3), "too few minutiae: 3 in the reference"),
        (np.arange(16.0).reshape(8, 2), positions(2), "no minutia of the probe has others"),
        (
            np.array([[0, 0], [40, 0], [20, 40], [20, 15]]),
            np.array([[0, 0], [40, 0], [40, 40], [0, 40], [20, 21]]),
            "no one-ring of the probe is like one of the reference",
        ),
    ],
)
def test_nothing_in_common_is_explained(probe, reference, reason):
    found = compare(template_of(probe), template_of(reference))
    assert found.reason.startswith(reason)
    assert (found.similarity, found.transform, len(found.pairs)) == (0.0, None, 0)


def test_transform_that_matches_no_minutia_is_none():
    exact = PaperMatcher(area_tolerance=3.0, precision=0.0)
    found = exact.compare(*(exact.prepare(template_of(positions(seed, 9))) for seed in (1, 2)))
    assert found.transform is None
    assert found.reason.startswith("no transform aligns minutiae of the probe with")


crowded = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=0, max_size=14).map(
    lambda places: 40.0 * np.array(places, float).reshape(-1, 2)
)
"""Places on a coarse lattice: coincident, collinear and co-circular minutiae abound."""


@given(crowded)
def test_a_print_matches_itself_or_has_no_ring(xy):
    template = template_of(xy)
    found = verify(template, template, matcher="paper")
    assert found.match == bool(len(MATCHER.prepare(template).at_500_dpi.rings))
    assert found.match == (found.matched_share == 1)
    assert bool(found.reason) != found.match


@given(crowded, crowded, st.sampled_from([0.0, 0.3, 0.6, 1.0]))
def test_whatever_the_places_there_is_an_answer_and_it_is_symmetric(p, q, rho):
    matcher = PaperMatcher(rho=rho)
    forth = verify(template_of(p), template_of(q), matcher=matcher)
    back = verify(template_of(q), template_of(p), matcher=matcher)
    assert forth.match == back.match
    assert forth.score == back.score
    assert forth.match == (forth.transform is not None and forth.matched_share > rho)
    assert forth.match or forth.reason


@given(
    st.integers(0, 10_000), st.floats(-math.pi, math.pi), st.floats(0.5, 2.0), st.floats(-200, 200)
)
def test_turn_shift_and_scale_of_a_print_change_no_decision(seed, rotation, scale, shift):
    rng = np.random.default_rng(seed)
    p = positions(seed, 25)
    q = p + rng.normal(0, 3, p.shape) if seed % 2 else positions(seed + 1, 25)
    q[: seed % 5] = rng.uniform(20, 380, (seed % 5, 2))
    moved = Similarity(scale, rotation, shift, -shift).apply(q)
    plain = verify(template_of(p), template_of(q), matcher="paper")
    assume(abs(plain.matched_share - 0.6) > 0.05)  # one minutia at the very tolerance may tip it
    assert verify(template_of(p), template_of(moved), matcher="paper").match == plain.match


def test_more_than_rho_matches_and_rho_itself_does_not():
    p = positions(9, 20)
    far = np.random.default_rng(1).uniform(2000, 4000, (5, 2))
    probe, reference = template_of(p), template_of(np.vstack([p[:15], far]))
    share = verify(probe, reference, matcher="paper").matched_share
    assert share >= 0.7
    at = verify(probe, reference, matcher=PaperMatcher(rho=share))
    below = verify(probe, reference, matcher=PaperMatcher(rho=share - 0.01))
    assert (at.match, below.match) == (False, True)
    assert (at.rho, below.rho) == (share, share - 0.01)
    assert at.reason == "too few minutiae agree"


def test_a_threshold_decides_by_the_score_instead_of_rho():
    probe = template_of(positions(9, 20))
    found = verify(probe, probe, matcher="paper")
    assert found.match
    assert found.rho == 0.6
    assert found.threshold < found.score < 40
    asked = verify(probe, probe, matcher="paper", threshold=40)
    assert (asked.match, asked.rho, asked.threshold) == (False, None, 40)
    assert verify(probe, probe, matcher="paper", threshold=found.score).match


def test_a_smaller_area_tolerance_lets_fewer_rings_pass():
    sides = template_of(positions(1)), template_of(positions(2))
    matchers = [PaperMatcher(area_tolerance=area) for area in (0.001, 0.1, 10.0)]
    found = [one.compare(*map(one.prepare, sides)).similarity for one in matchers]
    assert found[0] < found[2]
    assert found == sorted(found)


def test_very_many_minutiae_are_an_answer():
    rng = np.random.default_rng(5)
    many = template_of(rng.uniform(0, 2000, (2000 if COMPILED else 300, 2)))
    assert verify(many, many, matcher="paper").match
    few = verify(template_of(positions(3, 12)), many, matcher="paper")
    assert few.match or few.reason
