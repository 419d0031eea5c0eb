import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.matching.matchers.paper import MATCHER, UNALIGNED, PaperMatcher
from fpmatch.matching.verify import verify
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template


def template_of(xy, dpi=500.0):
    minutiae = Minutiae(x=xy[:, 0], y=xy[:, 1], angle=np.zeros(len(xy)))
    return Template(minutiae, width=400, height=400, dpi=dpi)


def positions(seed, n=35):
    return np.random.default_rng(seed).uniform(20, 380, (n, 2)).round()


crowded = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=0, max_size=14).map(
    lambda places: 40.0 * np.array(places, float).reshape(-1, 2)
)
"""Places on a coarse lattice: coincident, collinear and co-circular minutiae abound."""
places = st.integers(0, 10_000).map(lambda seed: positions(seed, seed % 30))


def compare(probe, reference):
    return MATCHER.compare(MATCHER.prepare(probe), MATCHER.prepare(reference))


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
    assert at.reason == "too little agrees"


def test_a_threshold_decides_by_the_score_instead_of_rho():
    probe = template_of(positions(9, 20))
    found = verify(probe, probe, matcher="paper")
    assert found.match
    assert found.rho == 0.6
    assert found.threshold < found.score < 40
    asked = verify(probe, probe, matcher="paper", threshold=40)
    assert (asked.match, asked.rho, asked.threshold) == (False, None, 40)
    assert verify(probe, probe, matcher="paper", threshold=found.score).match


def test_two_impressions_match_in_the_pixels_of_both_inputs():
    rng = np.random.default_rng(3)
    p, move = positions(3, 40), Similarity(1.0, 0.3, 40.0, -25.0)
    q = move.apply(p + rng.normal(0, 1.5, p.shape))
    q = q[(q[:, 0] < 380) | (q[:, 1] < 200)]
    genuine = compare(template_of(p), template_of(q))
    assert genuine.similarity > 0.9
    assert genuine.rms_px < 3
    assert genuine.transform.apply(p) == pytest.approx(move.apply(p), abs=4)
    fine = compare(template_of(p * 0.5, dpi=250), template_of(q * 2, dpi=1000))
    assert fine.rms_px == pytest.approx(2 * genuine.rms_px, rel=1e-3)
    assert fine.pairs.tolist() == genuine.pairs.tolist()
    assert fine.transform.apply(p * 0.5) == pytest.approx(2 * genuine.transform.apply(p), abs=0.1)
    for seed in range(10, 20):
        impostor = compare(template_of(p), template_of(positions(seed)))
        assert impostor.similarity < 0.7 * genuine.similarity


NOTHING = [
    (positions(1, 0), positions(2)),
    (positions(1), positions(2, 3)),
    (np.arange(16.0).reshape(8, 2), positions(2)),
    (
        np.array([[0, 0], [40, 0], [20, 40], [20, 15]]),
        np.array([[0, 0], [40, 0], [40, 40], [0, 40], [20, 21]]),
    ),
    (positions(1, 9), positions(2, 9)),
]


@pytest.mark.parametrize(("probe", "reference"), NOTHING)
def test_nothing_in_common_is_explained(probe, reference):
    exact = {"area_tolerance": 3.0, "precision": 0.0} if len(probe) == 9 else {}
    matcher = PaperMatcher(**exact)
    found = matcher.compare(*(matcher.prepare(template_of(xy)) for xy in (probe, reference)))
    assert found.reason == UNALIGNED
    assert (found.similarity, found.transform, len(found.pairs)) == (0.0, None, 0)


@given(crowded | places, crowded | places, st.sampled_from([500.0, 569.0]), st.floats(0, 1))
def test_whatever_the_places_there_is_an_answer_and_it_is_symmetric(p, q, dpi, rho):
    q = np.vstack([p[::2] + 1.5, q])  # some in common
    sides, matcher = (template_of(p, dpi), template_of(q)), PaperMatcher(rho=rho)
    forth, back = verify(*sides, matcher=matcher), verify(*sides[::-1], matcher=matcher)
    assert (forth.match, forth.score, forth.similarity) == (back.match, back.score, back.similarity)
    assert forth.match == (forth.transform is not None and forth.matched_share > rho)
    assert forth.match or forth.reason
    assert 0 <= forth.similarity <= 1
    assert {*map(tuple, forth.pairs.tolist())} == {(j, i) for i, j in back.pairs.tolist()}
    if forth.transform:
        again = back.transform.inverse()
        assert again.apply(p) == pytest.approx(forth.transform.apply(p), abs=1e-6)
