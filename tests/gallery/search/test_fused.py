"""Identification by several fingers: the scores of subjects are those of their fingers, fused."""

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_prints import FAKE, entries_of, template_at

from fpmatch.errors import MatcherError
from fpmatch.gallery.fingers.finger import fused_score
from fpmatch.gallery.fingers.fused_fingers import assign_fingers, fuse_fingers
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search import fused as fused_module
from fpmatch.gallery.search.fused import identify_fused
from fpmatch.gallery.search.search import Search
from fpmatch.matching.calibration import Calibration, score_to_fmr

TEN_PER_TEN = Calibration(((0.0, 0.0), (100.0, 100.0)), tail_scale=1.0)
PEOPLE = {
    Label("ada", "left", "1"): 20,
    Label("ada", "right", "1"): 60,
    Label("bob", "left", "1"): 62,
    Label("bob", "right", "1"): 22,
    Label("cy", "left", "1"): 21,
    Label("cy", "left", "2"): 90,
}


def score_at(x, *references):
    """Return the score of a finger with impressions, by the fake matcher."""
    return fused_score([max(0.0, 100.0 - abs(x - other)) for other in references])


@pytest.fixture
def people(gallery):
    """Return a gallery of three people, one of whom has one finger."""
    templates = map(template_at, PEOPLE.values())
    gallery.add(entries_of(*templates, labels=list(PEOPLE)))
    return gallery


def found_in(gallery, *places, **options):
    search = Search(gallery, FAKE)
    probes = [template_at(x) for x in places]
    return identify_fused(search, probes, calibration=TEN_PER_TEN, **options)


def test_each_probe_is_compared_with_the_finger_of_its_position(people):
    result = found_in(people, 40, 80, positions=["left", "right"])
    scores = {one.subject: one.score for one in result.candidates}
    assert scores == pytest.approx(
        {
            "ada": min(100.0, fuse_fingers([score_at(40, 20), score_at(80, 60)])),
            "bob": min(100.0, fuse_fingers([score_at(40, 62), score_at(80, 22)])),
            "cy": score_at(40, 21, 90),
        }
    )
    assert [one.rank for one in result.candidates] == [1, 2, 3]
    first = result.candidates[0]
    assert first.fmr == pytest.approx(score_to_fmr(first.score))
    assert first.expected_false == 3 * first.fmr
    named = {one.subject: [(f.probe, f.number) for f in one.fingers] for one in result.candidates}
    assert named == {"ada": [(0, 1), (1, 2)], "bob": [(0, 3), (1, 4)], "cy": [(0, 5)]}
    assert (result.enrolled, result.compared, result.subjects) == (6, 6, 3)
    assert not result.preselected
    dicts = result.candidate_dicts(["a.png", "b.png"])
    assert json.loads(json.dumps(dicts)) == dicts
    assert [(f["probe"], f["finger"]) for f in dicts[0]["fingers"]] == [
        ("a.png", "left"),
        ("b.png", "right"),
    ]


def test_without_positions_any_other_finger_is_tried(people):
    result = found_in(people, 60, 20)
    swapped = found_in(people, 20, 60)
    both = np.array([[score_at(60, 20), 100.0], [100.0, score_at(20, 60)]])
    ada = next(one for one in result.candidates if one.subject == "ada")
    assert ada.score == pytest.approx(assign_fingers(both, np.ones((2, 2), bool))[0])
    assert [(f.probe, f.number) for f in ada.fingers] == [(0, 2), (1, 1)]
    assert [one.score for one in result.candidates] == [one.score for one in swapped.candidates]


def test_a_subject_without_a_finger_of_the_positions_is_no_candidate(people):
    result = found_in(people, 20, 30, positions=["right", "thumb"])
    assert {one.subject: len(one.fingers) for one in result.candidates} == {"ada": 1, "bob": 1}


def test_count_and_threshold_are_of_subjects(people):
    result = found_in(people, 20, 60, positions=["left", "right"], count=1)
    assert [one.subject for one in result.candidates] == ["ada"]
    result = found_in(people, 20, 60, positions=["left", "right"], threshold=99.0)
    assert [one.subject for one in result.candidates] == ["ada", "bob"]


def test_damaged_and_removed_entries_are_no_candidates(people):
    search = Search(people, FAKE)
    people.remove([1])
    probes = [template_at(20), template_at(60)]
    people.damaged.update({5: "damaged", 6: "damaged"})
    options = {"positions": ["left", "right"], "calibration": TEN_PER_TEN}
    result = identify_fused(search, probes, **options)
    assert {one.subject: len(one.fingers) for one in result.candidates} == {"ada": 1, "bob": 2}
    people.remove(range(2, 7))
    assert identify_fused(search, probes, **options).candidates == ()


@pytest.mark.parametrize(
    ("probes", "positions"),
    [([], []), ([1, 2], ["left"]), ([1, 2], ["left", "left"]), ([1] * 11, [])],
)
def test_positions_are_of_all_probes_and_different(people, probes, positions):
    with pytest.raises(MatcherError):
        found_in(people, *probes, positions=positions)


def test_subjects_are_compared_by_all_fingers_when_one_is_listed(people, monkeypatch):
    monkeypatch.setattr(fused_module, "CONSIDERED", 1)
    result = found_in(people, 20, 60, positions=["left", "right"], count=1)
    (ada,) = result.candidates
    assert ada.score == pytest.approx(100.0)
    assert len(ada.fingers) == 2


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.integers(0, 99), st.integers(0, 99)), min_size=1, max_size=8))
def test_agrees_with_comparing_one_by_one(gallery, enrolled):
    gallery.remove([entry.id for entry in gallery.entries()])
    labels = [Label(str(k), finger) for k in range(len(enrolled)) for finger in "ab"]
    gallery.add(entries_of(*(template_at(x) for pair in enrolled for x in pair), labels=labels))
    search = Search(gallery, FAKE)
    options = {"positions": ["a", "b"], "calibration": TEN_PER_TEN}
    probes = [template_at(30), template_at(70)]
    found = identify_fused(search, probes, **options)
    slow = sorted(
        (min(100.0, fuse_fingers([score_at(30, a), score_at(70, b)])) for a, b in enrolled),
        reverse=True,
    )
    assert [one.score for one in found.candidates] == pytest.approx(slow[:10])
    options["positions"] = ["b", "a"]
    turned = identify_fused(search, probes[::-1], **options)
    assert [(o.subject, o.score) for o in turned.candidates] == [
        (o.subject, o.score) for o in found.candidates
    ]
