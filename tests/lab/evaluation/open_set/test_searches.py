import numpy as np
import pytest

from fpmatch.errors import DatasetError
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.whole import WholeSearch
from fpmatch.lab.evaluation.open_set.background import load_background, no_background
from fpmatch.lab.evaluation.open_set.roles import GROUPS, Roles
from fpmatch.lab.evaluation.open_set.run import (
    IdentificationTest,
    evaluate_identification,
    load_subjects,
)
from fpmatch.lab.evaluation.open_set.searches import NO_CHANCE, NO_SCORE, NOT_LISTED, search_all
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.registry import get_matcher
from fpmatch.templates.minutiae import Minutiae, Template
from tests.lab.evaluation.made_sets import extracted_set

MATCHER = get_matcher("unit-circle")
CALIBRATION = load_calibration("unit-circle")


def disturbed(finger, impression, count=14):
    """Return a print of a finger, some of whose minutiae are elsewhere in each impression."""
    rng = np.random.default_rng(finger)
    x, y, angle = rng.uniform(20, 280, count), rng.uniform(20, 280, count), rng.uniform(0, 6, count)
    rng = np.random.default_rng([finger, impression])
    moved = rng.random(count) < 0.35
    x = np.where(moved, rng.uniform(20, 280, count), x + rng.normal(0, 2, count))
    y = np.where(moved, rng.uniform(20, 280, count), y + rng.normal(0, 2, count))
    return Template(Minutiae(x, y, angle), 300, 300)


def extracted(fingers, impressions, missing=(), name="made"):
    named = [(f, i) for f in fingers for i in range(1, impressions + 1)]
    return extracted_set({one: None if one in missing else disturbed(*one) for one in named}, name)


def rounds(roles):
    return [(turn, group) for turn in range(roles.turns) for group in range(GROUPS)]


@pytest.fixture
def made():
    return extracted(range(1, 8), 3, missing={(2, 1), (5, 3)})


def test_every_round_is_a_search_of_its_own_gallery(made):
    presentations = [one for subject in load_subjects(made, 1) for one in subject]
    roles = Roles.draw([[3] * 7])
    others = WholeSearch.of([disturbed(k, 1) for k in range(50, 60)], MATCHER)
    whole = others.with_prints([t for (t,) in presentations if t])
    number = {}
    for k, (template,) in enumerate(presentations):
        if template is not None:
            number[k] = 11 + len(number)
    background = no_background(MATCHER)
    background = type(background)(others, np.arange(10), np.zeros(10, int))
    found = search_all(presentations, roles, background, CALIBRATION)
    mated, nonmated = [], []
    for k, (template,) in enumerate(presentations):
        for turn, group in rounds(roles):
            enrolled = roles.enrolled(group, turn).tolist()
            if not roles.is_searched(k, turn):
                continue
            skipped = {n for e, n in number.items() if e not in enrolled}
            listed = []
            if template is not None:
                result = identify(whole, template, count=100, skipped=skipped)
                listed = [(c.number, c.score, c.expected_false) for c in result.candidates]
            mates = [e for e in enrolled if roles.subject[e] == roles.subject[k]]
            if not mates:
                nonmated.append((k, *(listed[0][1:] if listed else (NO_SCORE, NO_CHANCE))))
                continue
            own = number.get(mates[0])
            of_mate = [(s, c) for n, s, c in listed if n == own]
            for score, chance in of_mate or [(NO_SCORE, NO_CHANCE)]:
                rank = sum(s >= score for _, s, _ in listed) if of_mate else NOT_LISTED
                mated.append((k, score, rank, chance))
    columns = found.nonmated, found.highest, found.least_chance
    assert list(zip(*(c.tolist() for c in columns), strict=True)) == nonmated
    columns = found.mated, found.score, found.rank, found.chance
    assert list(zip(*(c.tolist() for c in columns), strict=True)) == mated
    assert len(mated) * 2 == len(nonmated)
    assert set(found.enrolled.tolist()) == {12, 13}


@pytest.mark.parametrize(
    ("fingers", "impressions", "size", "why"),
    [(2, 3, 1, "2 subjects of 1 finger"), (5, 1, 1, "two impressions"), (1, 2, 2, "fewer than 2")],
)
def test_too_few_subjects_are_refused(fingers, impressions, size, why):
    few = extracted(range(fingers), impressions)
    with pytest.raises(DatasetError, match=why):
        evaluate_identification([few], test=IdentificationTest(fingers=size))


@pytest.fixture
def people(tmp_path):
    """Return a gallery of two people with two fingers, and one with one, two prints of each."""
    place = tmp_path / "people.db"
    labels = [
        Label(subject, finger, str(k))
        for subject, finger in (("ada", "l"), ("ada", "r"), ("bob", "l"), ("bob", "r"), ("cy", ""))
        for k in (1, 2)
    ]
    with open_gallery(place, create=True) as gallery:
        gallery.add(
            [
                NewEntry(label, f"{n}.png", n.to_bytes(32, "big"), disturbed(70 + n // 2, n % 2))
                for n, label in enumerate(labels)
            ]
        )
    return place


def test_the_background_is_a_gallery_whose_subjects_count_once(people, made):
    before = people.read_bytes()
    filled = load_background(people, MATCHER, engine=serial())
    one, two = filled.of_subjects(1), filled.of_subjects(2)
    assert one.subject.tolist() == [0] * 4 + [1] * 4 + [2] * 2
    assert two.subject.tolist() == [0] * 4 + [1] * 4 + [-1] * 2
    assert two.finger.tolist() == [0, 0, 1, 1] * 2 + [0, 0]
    for size, background, subjects in ((1, one, 3), (2, two, 2)):
        test = IdentificationTest(size, fpirs=(0.2,), bootstrap=0)
        report = evaluate_identification([made], background, test=test)
        assert report.background == subjects
        assert report.enrolled[0] > subjects
        assert f"{subjects} of them background" in report.as_text()
    assert people.read_bytes() == before
