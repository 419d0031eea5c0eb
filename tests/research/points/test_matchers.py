import importlib.util
import math
import signal
import sys
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fpmatch.errors import MatcherError
from fpmatch.pointset.geometry.point_match import PointMatch
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper import matcher as unit_circle_matcher
from research.points import matchers as point_matchers
from research.points.matchers import (
    MATCHER_NAMES,
    PointCase,
    StoppedError,
    is_installed,
    matcher_named,
)
from research.points.random_sets import independent_pair, random_pair

needs_astroalign = pytest.mark.skipif(not is_installed("astroalign"), reason="an extra")
MATCHERS = [
    pytest.param(name, marks=[needs_astroalign] if name == "astroalign" else [])
    for name in MATCHER_NAMES
]
RHO, LAMBDA = 0.95, 0.428
EASY = random_pair(20, 24, 1.0, 0.0, LAMBDA, rng=3)


def case_of(pair, **changes):
    case = PointCase(pair.p, pair.q, pair.tolerance, RHO, LAMBDA, 1_000_000, math.inf)
    return replace(case, **changes)


@pytest.mark.parametrize("name", MATCHERS)
def test_a_match_has_the_transform_and_the_pairs_and_independent_sets_none(name):
    matcher = matcher_named(name)
    match = matcher.find(case_of(EASY))
    np.testing.assert_allclose(match.transform.apply(EASY.p), EASY.transform.apply(EASY.p))
    np.testing.assert_array_equal(match.pairs, EASY.pairs)
    assert matcher.find(case_of(independent_pair(14, 16, LAMBDA, rng=5))).transform is None
    assert matcher.complete == (name == "triangles")


@pytest.mark.parametrize(("paired", "matches"), [(20, True), (19, False)])  # 19 of 20 are ρ = 0.95
def test_the_papers_method_matches_where_it_pairs_more_than_rho(monkeypatch, paired, matches):
    match = PointMatch(Similarity(), EASY.pairs[:paired], paired / 20, 0.0, 1)
    seen, case = [], case_of(EASY)
    monkeypatch.setattr(
        unit_circle_matcher, "match_by_unit_circle", lambda *words: seen.append(words) or match
    )
    assert (matcher_named("paper").find(case).transform is not None) is matches
    ((*_, given),) = seen
    assert (given.matching_factor, given.tolerance) == (RHO, case.tolerance)


def test_the_baseline_gives_up_after_its_steps():
    assert matcher_named("van-wamelen").find(case_of(EASY, max_steps=50)).transform is None


def test_matchers_that_are_unknown_or_not_installed(monkeypatch):
    with pytest.raises(MatcherError, match="'his'; known: tri"):
        matcher_named("his")
    monkeypatch.setattr(point_matchers, "find_spec", lambda _: None)
    assert not is_installed("astroalign")
    assert is_installed("triangles")
    with pytest.raises(MatcherError, match=r"astroalign .*fpmatch\[bench\]"):
        matcher_named("astroalign")


def fake_astroalign(monkeypatch, find_transform):
    """Put a module in astroalign's place whose one function is `find_transform`."""
    lost = type("MaxIterError", (RuntimeError,), {})
    fake = SimpleNamespace(PIXEL_TOL=2, MaxIterError=lost, seen=[])

    def find(p, q, max_control_points):
        fake.seen.append((fake.PIXEL_TOL, max_control_points))
        return find_transform(fake), None

    fake.find_transform = find
    monkeypatch.setitem(sys.modules, "astroalign", fake)
    spec = importlib.util.spec_from_loader("astroalign", loader=None)
    monkeypatch.setattr(point_matchers, "find_spec", lambda _: spec)
    return fake


def test_astroalign_has_our_tolerance_for_the_call_and_all_points(monkeypatch):
    matrix = np.vstack([EASY.transform.matrix, [0, 0, 1]])
    fake = fake_astroalign(monkeypatch, lambda _: SimpleNamespace(params=matrix))
    match = matcher_named("astroalign").find(case_of(EASY))
    assert fake.seen == [(EASY.tolerance, 24)]
    assert fake.PIXEL_TOL == 2
    np.testing.assert_array_equal(match.pairs, EASY.pairs)
    assert match.transform.rotation == pytest.approx(EASY.transform.rotation)


def raising(kind):
    def find(fake):
        raise kind(fake)

    return find


@pytest.mark.parametrize(
    "found",
    [
        raising(lambda fake: fake.MaxIterError()),
        raising(lambda _: np.linalg.LinAlgError("SVD did not converge")),
        raising(lambda _: AttributeError("FailedEstimation has no attribute 'residuals'")),
        lambda _: SimpleNamespace(params=np.full((3, 3), np.nan)),
        lambda _: SimpleNamespace(params=np.zeros((3, 3))),
    ],
)
def test_where_astroalign_fails_there_is_no_match(monkeypatch, found):
    fake = fake_astroalign(monkeypatch, found)
    assert matcher_named("astroalign").find(case_of(EASY)).transform is None
    assert fake.PIXEL_TOL == 2


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers here")
def test_astroalign_is_stopped_whatever_it_catches(monkeypatch):
    def slow(_):
        try:
            time.sleep(30)
        except Exception as error:
            raise TypeError from error

    fake, handler = fake_astroalign(monkeypatch, slow), signal.getsignal(signal.SIGALRM)
    with pytest.raises(StoppedError):
        matcher_named("astroalign").find(case_of(EASY, limit_s=0.01))
    assert signal.getsignal(signal.SIGALRM) is handler
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    assert fake.PIXEL_TOL == 2
