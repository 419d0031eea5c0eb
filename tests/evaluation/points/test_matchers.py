"""The matchers of the experiment behind one interface."""

from __future__ import annotations

import importlib.util
import math
import signal
import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fpmatch.errors import MatcherError
from fpmatch.evaluation.points import matchers as point_matchers
from fpmatch.evaluation.points.matchers import (
    MATCHER_NAMES,
    PointCase,
    StoppedError,
    is_installed,
    matcher_named,
)
from fpmatch.pointset.point_match import PointMatch
from fpmatch.pointset.random_sets import RandomPair, independent_pair, random_pair
from fpmatch.pointset.similarity import Similarity
from fpmatch.pointset.unit_circle import matcher as unit_circle_matcher

needs_astroalign = pytest.mark.skipif(not is_installed("astroalign"), reason="an extra")
MATCHERS = [
    pytest.param(name, marks=[needs_astroalign] if name == "astroalign" else [])
    for name in MATCHER_NAMES
]
RHO = 0.95
LAMBDA = 0.428


def case_of(pair: RandomPair, **changes: Any) -> PointCase:
    case = PointCase(pair.p, pair.q, pair.tolerance, RHO, LAMBDA, 1_000_000, math.inf)
    return replace(case, **changes)


@pytest.fixture
def easy() -> RandomPair:
    return random_pair(20, 24, 1.0, 0.0, LAMBDA, rng=3)


@pytest.mark.parametrize("name", MATCHERS)
def test_a_match_has_the_transform_and_the_pairs(name: str, easy: RandomPair) -> None:
    match = matcher_named(name).find(case_of(easy))
    np.testing.assert_allclose(match.transform.apply(easy.p), easy.transform.apply(easy.p))
    np.testing.assert_array_equal(match.pairs, easy.pairs)


@pytest.mark.parametrize("name", MATCHERS)
def test_independent_sets_do_not_match(name: str) -> None:
    pair = independent_pair(14, 16, LAMBDA, rng=5)
    assert matcher_named(name).find(case_of(pair)).transform is None


@pytest.mark.parametrize(("paired", "matches"), [(20, True), (19, False)])
def test_the_papers_method_matches_where_it_pairs_more_than_rho(
    monkeypatch: pytest.MonkeyPatch, easy: RandomPair, paired: int, matches: bool
) -> None:
    match = PointMatch(Similarity(), easy.pairs[:paired], paired / 20, 0.0, 1)
    seen = []
    monkeypatch.setattr(
        unit_circle_matcher, "match_by_unit_circle", lambda *words: seen.append(words) or match
    )
    case = case_of(easy)
    assert (
        matcher_named("paper").find(case).transform is not None
    ) is matches  # 19 of 20 are ρ = 0.95
    (given,) = seen
    assert (given[2].matching_factor, given[2].tolerance) == (RHO, case.tolerance)


def test_the_baseline_gives_up_after_its_steps(easy: RandomPair) -> None:
    assert matcher_named("van-wamelen").find(case_of(easy, max_steps=50)).transform is None


def test_only_the_default_has_to_run_all_trials() -> None:
    complete = [n for n in MATCHER_NAMES if is_installed(n) and matcher_named(n).complete]
    assert complete == ["triangles"]


def test_an_unknown_matcher() -> None:
    with pytest.raises(MatcherError, match="unknown matcher 'his': expected one of tri"):
        matcher_named("his")


def test_a_matcher_that_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(point_matchers, "find_spec", lambda _: None)
    assert not is_installed("astroalign")
    assert is_installed("triangles")
    with pytest.raises(MatcherError, match=r"astroalign is not installed: .*fpmatch\[bench\]"):
        matcher_named("astroalign")


def fake_astroalign(monkeypatch: pytest.MonkeyPatch, find_transform: Any) -> SimpleNamespace:
    """Put a module in astroalign's place whose one function is `find_transform`."""
    fake = SimpleNamespace(
        PIXEL_TOL=2, MaxIterError=type("MaxIterError", (RuntimeError,), {}), seen=[]
    )

    def find(p: Any, q: Any, max_control_points: int) -> Any:
        fake.seen.append((fake.PIXEL_TOL, max_control_points))
        return find_transform(fake), None

    fake.find_transform = find
    monkeypatch.setitem(__import__("sys").modules, "astroalign", fake)
    spec = importlib.util.spec_from_loader("astroalign", loader=None)
    monkeypatch.setattr(point_matchers, "find_spec", lambda _: spec)
    return fake


def as_matrix(similarity: Similarity) -> SimpleNamespace:
    return SimpleNamespace(params=np.vstack([similarity.matrix, [0, 0, 1]]))


def test_astroalign_has_our_tolerance_for_the_call_and_all_points(
    monkeypatch: pytest.MonkeyPatch, easy: RandomPair
) -> None:
    fake = fake_astroalign(monkeypatch, lambda _: as_matrix(easy.transform))
    match = matcher_named("astroalign").find(case_of(easy))
    assert fake.seen == [(easy.tolerance, 24)]
    assert fake.PIXEL_TOL == 2
    np.testing.assert_array_equal(match.pairs, easy.pairs)
    assert match.transform.rotation == pytest.approx(easy.transform.rotation)


def raising(kind: Any) -> Any:
    def find(fake: SimpleNamespace) -> None:
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
def test_where_astroalign_fails_there_is_no_match(
    monkeypatch: pytest.MonkeyPatch, easy: RandomPair, found: Any
) -> None:
    fake = fake_astroalign(monkeypatch, found)
    assert matcher_named("astroalign").find(case_of(easy)).transform is None
    assert fake.PIXEL_TOL == 2


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers here")
def test_astroalign_is_stopped_whatever_it_catches(
    monkeypatch: pytest.MonkeyPatch, easy: RandomPair
) -> None:
    def slow(_: Any) -> None:
        try:
            time.sleep(30)
        except Exception as error:
            raise TypeError from error

    fake = fake_astroalign(monkeypatch, slow)
    handler = signal.getsignal(signal.SIGALRM)
    with pytest.raises(StoppedError):
        matcher_named("astroalign").find(case_of(easy, limit_s=0.01))
    assert signal.getsignal(signal.SIGALRM) is handler
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    assert fake.PIXEL_TOL == 2
