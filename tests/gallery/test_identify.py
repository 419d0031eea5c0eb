"""The ranks of an identification are those of comparing one by one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fpmatch.engine.engine import serial
from fpmatch.errors import GalleryError, MatcherError
from fpmatch.gallery import identify as identify_module
from fpmatch.gallery import search as search_module
from fpmatch.gallery.entry import Label, NewEntry
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.identify import MIN_CANDIDATE_LIST, candidate_list_size, identify
from fpmatch.gallery.search import ConsolidatedFingers, open_search
from fpmatch.matching.calibration import Calibration, load_calibration, score_to_fmr
from fpmatch.matching.finger import fused_score, verify_finger
from fpmatch.matching.verify import verify
from fpmatch.minutiae import Minutiae, Template

TEN_PER_TEN = Calibration(((0.0, 0.0), (100.0, 100.0)), tail_scale=1.0)


@pytest.fixture
def fake(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import fake_matcher

    return fake_matcher


@pytest.fixture
def fill(tmp_path, fake):
    """Return a function that makes a gallery of the prints that a fake matcher knows by numbers."""
    opened = []

    def made(numbers):
        gallery = open_gallery(tmp_path / f"{len(opened)}.db", create=True)
        opened.append(gallery)
        gallery.add(
            [
                NewEntry(Label(str(k)), f"{k}", k.to_bytes(32, "big"), fake.template_at(x))
                for k, x in enumerate(numbers, start=1)
            ]
        )
        return gallery

    yield made
    for gallery in opened:
        gallery.close()


def test_the_most_similar_come_first_with_their_rates(fill, fake):
    search = open_search(fill([10, 50, 200, 52, 45]), fake.MATCHER)
    result = identify(search, fake.template_at(50), count=3, calibration=TEN_PER_TEN)
    assert result.compared == 5
    assert result.matcher == "fake"
    assert [(c.rank, c.number, c.similarity) for c in result.candidates] == [
        (1, 2, 100.0),
        (2, 4, 98.0),
        (3, 5, 95.0),
    ]
    third = result.candidates[2]
    assert third.score == pytest.approx(95.0)
    assert third.fmr == pytest.approx(10**-9.5)
    assert third.expected_false == pytest.approx(5 * 10**-9.5)
    assert third.comparison is None


def test_of_equals_the_first_enrolled_comes_first(fill, fake):
    search = open_search(fill([7, 3, 7, 3, 7, 3]), fake.MATCHER)
    result = identify(search, fake.template_at(5), count=4, calibration=TEN_PER_TEN)
    assert [c.number for c in result.candidates] == [1, 2, 3, 4]


def test_a_threshold_leaves_out_what_scores_less(fill, fake):
    search = open_search(fill([10, 50, 200, 52, 45]), fake.MATCHER)
    result = identify(search, fake.template_at(50), threshold=98.0, calibration=TEN_PER_TEN)
    assert [c.number for c in result.candidates] == [2, 4]
    assert len(identify(search, fake.template_at(50), calibration=TEN_PER_TEN).candidates) == 5


def test_an_empty_gallery_has_no_candidate(fill, fake):
    search = open_search(fill([]), fake.MATCHER)
    result = identify(search, fake.template_at(50), calibration=TEN_PER_TEN)
    assert (result.compared, result.candidates) == (0, ())


@pytest.mark.parametrize(
    "wrong",
    [
        *({"count": 0}, {"threshold": -1.0}, {"threshold": 101.0}),
        *({"candidate_list": 0}, {"candidate_list": "some"}, {"candidate_list": 5}),
    ],
)
def test_what_is_out_of_range_is_refused(fill, fake, wrong):
    search = open_search(fill([1]), fake.MATCHER)
    with pytest.raises(MatcherError):
        identify(search, fake.template_at(50), calibration=TEN_PER_TEN, **wrong)


def test_unknown_matchers_and_damaged_templates_are_refused(fill, fake, monkeypatch):
    gallery = fill([1])
    with pytest.raises(MatcherError, match="unknown matcher"):
        open_search(gallery, "nobody")
    monkeypatch.setattr(
        gallery, "packed_templates", lambda **_: [(1, b"fm, but no template at all")]
    )
    with pytest.raises(GalleryError, match="damaged: entry 1: "):
        open_search(gallery, fake.MATCHER)


def test_scores_are_those_of_verify_on_the_enrolled_templates(tmp_path, template):
    new = [NewEntry(Label("1"), "1.tif", bytes(32), template)]
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        gallery.add(new)
        ((_, enrolled),) = gallery.templates()
        search = open_search(gallery)
    result = identify(search, template, transforms=True)
    expected = verify(template, enrolled)
    (candidate,) = result.candidates
    assert (candidate.score, candidate.fmr) == (expected.score, expected.fmr)
    assert candidate.comparison.transform == expected.transform
    assert result.smallest_measured_fmr == expected.smallest_measured_fmr


def scattered(seed):
    """Return a template of 20 minutiae anywhere."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(20, 280, (2, 20))
    return Template(Minutiae(x, y, rng.uniform(0, 6, 20)), 300, 300)


@pytest.fixture
def search(tmp_path):
    """Return a search of 12 prints, whose numbers are those of their seeds."""
    with open_gallery(tmp_path / "scattered.db", create=True) as gallery:
        gallery.add(
            [
                NewEntry(Label(str(k)), f"{k}", k.to_bytes(32, "big"), scattered(k))
                for k in range(1, 13)
            ]
        )
        return open_search(gallery, engine=serial())


def test_a_shortlist_finds_what_comparing_all_finds(search):
    whole = identify(search, scattered(7), count=1, transforms=True)
    short = identify(search, scattered(7), count=1, transforms=True, candidate_list=3)
    assert (whole.enrolled, whole.compared, whole.preselected) == (12, 12, False)
    assert (short.enrolled, short.compared, short.preselected) == (12, 3, True)
    (one,), (other,) = whole.candidates, short.candidates
    assert (one.number, one.score, one.expected_false) == (
        *(other.number, other.score, other.expected_false),
    )
    assert one.comparison.pairs.tolist() == other.comparison.pairs.tolist()


def test_a_shortlist_has_room_for_all_candidates(search):
    assert len(identify(search, scattered(7), count=5, candidate_list=2).candidates) == 5
    everything = identify(search, scattered(7), candidate_list=12)
    assert not everything.preselected
    assert everything == identify(search, scattered(7), candidate_list="off")


def test_a_small_gallery_is_compared_as_a_whole_and_a_large_one_is_not(search, monkeypatch):
    assert candidate_list_size(search) is None
    monkeypatch.setattr(identify_module, "EXHAUSTIVE_UP_TO", 11)
    assert candidate_list_size(search) == MIN_CANDIDATE_LIST
    monkeypatch.setattr(identify_module, "MIN_CANDIDATE_LIST", 2)
    assert candidate_list_size(search) == 2
    monkeypatch.setattr(identify_module, "PENETRATION_RATE", 0.5)
    assert candidate_list_size(search) == 6
    assert candidate_list_size(search, "off") is None
    assert identify(search, scattered(7)).compared == 10  # as many as there are candidates


def test_a_matcher_without_shortlists_compares_all(fill, fake, monkeypatch):
    monkeypatch.setattr(identify_module, "EXHAUSTIVE_UP_TO", 1)
    search = open_search(fill([1, 2, 3]), fake.MATCHER)
    assert candidate_list_size(search) is None
    with pytest.raises(MatcherError, match="fake supports no candidate list"):
        search.candidate_list(1.0, 2)


@pytest.fixture
def fingers(tmp_path, fake):
    """Return a search of finger a with three impressions and b and c of the same subject."""
    labels = [("x", "a", "1"), ("x", "b", "1"), ("x", "a", "2"), ("x", "c", "1"), ("x", "a", "3")]
    with open_gallery(tmp_path / "fingers.db", create=True) as gallery:
        gallery.add(
            [
                NewEntry(Label(*label), f"{k}", k.to_bytes(32, "big"), fake.template_at(x))
                for k, (label, x) in enumerate(zip(labels, (10, 50, 52, 90, 55), strict=True), 1)
            ]
        )
        yield open_search(gallery, fake.MATCHER)


def test_a_finger_comes_once_by_the_score_of_its_impressions(fingers, fake):
    found = identify(fingers, fake.template_at(52), calibration=TEN_PER_TEN)
    assert (found.enrolled, found.fingers) == (5, 3)
    assert [(c.number, c.impressions) for c in found.candidates] == [(2, 1), (3, 3), (4, 1)]
    finger = found.candidates[1]
    assert finger.score == pytest.approx(fused_score([58.0, 100.0, 97.0]))
    assert (finger.similarity, finger.impression_score) == (100.0, 100.0)
    assert finger.expected_false == 3 * finger.fmr


def test_impressions_can_be_listed_by_themselves(fingers, fake):
    found = identify(fingers, fake.template_at(52), calibration=TEN_PER_TEN, impressions=True)
    assert [c.number for c in found.candidates] == [3, 2, 5, 4, 1]
    assert [c.score for c in found.candidates] == [100.0, 98.0, 97.0, 62.0, 58.0]
    assert found.candidates[0].expected_false == pytest.approx(5e-10)
    few = identify(fingers, fake.template_at(52), calibration=TEN_PER_TEN, count=2)
    assert [c.number for c in few.candidates] == [2, 3]


def test_impressions_outside_the_shortlist_count_as_no_match(tmp_path):
    with open_gallery(tmp_path / "few.db", create=True) as gallery:
        gallery.add(
            [
                NewEntry(Label("x", "", f"{k}"), f"{k}", k.to_bytes(32, "big"), scattered(k))
                for k in range(1, 5)
            ]
        )
        search = open_search(gallery, engine=serial())
    (found,) = identify(search, scattered(3), count=1, candidate_list=1).candidates
    assert (found.number, found.impressions) == (3, 4)
    assert found.score == pytest.approx(fused_score([found.impression_score, 0.0, 0.0, 0.0]))


@pytest.fixture
def touches(tmp_path, fingers_of_touches):
    """Return an open gallery of three fingers of four touches each, and the touch left over."""
    with open_gallery(tmp_path / "touches.db", create=True) as gallery:
        new = [
            NewEntry(Label(f"{k}", "", f"{n}"), f"{k}_{n}", bytes([k, n, *[0] * 30]), one)
            for k, finger in enumerate(fingers_of_touches)
            for n, one in enumerate(finger[1:])
        ]
        assert gallery.add(new) == [None] * 12
        yield gallery


@pytest.fixture
def fingers_of_touches():
    """Return windows of three prints: five of each, which share a part of their minutiae."""
    made = []
    for k in range(3):
        whole = scattered(40 + k)
        m = whole.minutiae
        windows = [(abs(m.x - 150 - 18 * n) < 90) for n in (0, -2, -1, 1, 2)]
        made.append([Template(m.take(np.flatnonzero(one)), 300, 300) for one in windows])
    return made


def test_candidates_are_compared_with_what_their_impressions_show_together(
    touches, fingers_of_touches
):
    search = open_search(touches, engine=serial())
    together = ConsolidatedFingers(touches, search)
    curve = load_calibration(search.matcher.name)
    for k, finger in enumerate(fingers_of_touches):
        probe = finger[0]
        plain = identify(search, probe)
        found = identify(search, probe, consolidated=together)
        assert {c.number for c in found.candidates} == {c.number for c in plain.candidates}
        assert [c.rank for c in found.candidates] == [1, 2, 3]
        assert [c.score for c in found.candidates] == sorted(
            (c.score for c in found.candidates), reverse=True
        )
        best = found.candidates[0]
        assert touches.entry(best.number).label.subject == f"{k}"
        stored = [touches.template(4 * k + n) for n in range(1, 5)]
        expected = verify_finger(probe, stored, calibration=curve).verification.score
        assert best.score == expected
        assert best.expected_false == 3 * best.fmr == 3 * score_to_fmr(best.score)


def test_a_threshold_holds_for_the_score_with_the_consolidated_template(
    touches, fingers_of_touches
):
    search = open_search(touches, engine=serial())
    together = ConsolidatedFingers(touches, search)
    probe = fingers_of_touches[1][0]
    best, *_ = identify(search, probe, consolidated=together).candidates
    for threshold, left in ((best.score, 1), (min(best.score + 0.01, 100), best.score == 100)):
        found = identify(search, probe, consolidated=together, threshold=threshold)
        assert len(found.candidates) == left


def test_a_finger_of_one_impression_keeps_its_score(fingers, fake, tmp_path):
    together = ConsolidatedFingers(open_gallery(tmp_path / "fingers.db"), fingers, TEN_PER_TEN)
    probe = fake.template_at(52)
    plain = identify(fingers, probe, calibration=TEN_PER_TEN)
    single = [c for c in plain.candidates if c.impressions == 1]
    assert [(c.number, c.score) for c in together.rerank(52.0, single)] == [
        (c.number, c.score) for c in single
    ]


def test_only_so_many_fingers_are_kept(touches, fingers_of_touches, monkeypatch):
    monkeypatch.setattr(search_module, "FINGERS_KEPT", 1)
    search = open_search(touches, engine=serial())
    together = ConsolidatedFingers(touches, search)
    first, second = (
        identify(search, fingers_of_touches[2][0], consolidated=together) for _ in range(2)
    )
    assert [c.score for c in first.candidates] == [c.score for c in second.candidates]
    assert together._finger.cache_info().currsize == 1


def test_single_impressions_are_not_consolidated(touches, fingers_of_touches):
    search = open_search(touches, engine=serial())
    with pytest.raises(MatcherError, match="single impressions"):
        identify(
            search,
            fingers_of_touches[0][0],
            impressions=True,
            consolidated=ConsolidatedFingers(touches, search),
        )
