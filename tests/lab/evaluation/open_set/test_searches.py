from dataclasses import replace

import numpy as np
import pytest

from fpmatch.errors import DatasetError
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.fingers.fused_fingers import fuse_fingers
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.whole import WholeSearch
from fpmatch.lab.evaluation.open_set import searches
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
            number[k] = 10 + len(number)
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
    assert not found.preselected


@pytest.mark.parametrize(("fingers", "function"), [(1, "identify"), (2, "identify_fused")])
def test_all_mates_are_looked_for_because_all_impressions_are_in_one_gallery(
    fingers, function, made, monkeypatch
):
    asked = []

    def noted(*args, **options):
        asked.append(options["all_mates"])
        return original(*args, **options)

    original = getattr(searches, function)
    monkeypatch.setattr(searches, function, noted)
    presentations = [one for subject in load_subjects(made, fingers) for one in subject]
    roles = Roles.draw([[3] * (7 // fingers)])
    search_all(presentations, roles, no_background(MATCHER), CALIBRATION)
    assert asked
    assert all(asked)


def test_two_fingers_are_fused_and_a_missing_one_is_left_out(made):
    subjects = load_subjects(made, 2)
    assert [len(shown) for shown in subjects] == [3, 3, 3]  # the seventh finger is left out
    presentations = [one for subject in subjects for one in subject]
    roles = Roles.draw([[3] * 3])
    found = search_all(presentations, roles, no_background(MATCHER), CALIBRATION)
    alone = WholeSearch.of([disturbed(3, 2), disturbed(4, 2)], MATCHER)
    scores = [
        CALIBRATION.scores(alone.similarities(MATCHER.prepare(disturbed(f, 1)), np.array([k])))[0]
        for k, f in enumerate((3, 4))
    ]
    third = presentations.index((disturbed(3, 1), disturbed(4, 1)))
    of_mates = found.score[found.mated == third]
    assert float(fuse_fingers(scores)) in of_mates.tolist()
    by_fmr = found.enrolled.max() * 10 ** (-0.1 * found.score)
    assert (found.chance <= by_fmr * (1 + 1e-9)).all()
    assert 0 < len(found.mated) == len(found.nonmated) / 2


def test_a_test_has_a_row_a_database_and_one_of_all(made):
    second = extracted(range(20, 26), 2, name="second")
    test = IdentificationTest(fpirs=(0.1, 0.5), bootstrap=20)
    report = evaluate_identification([made, second], test=test)
    assert [row.name for row in report.sets] == ["made", "second"]
    assert [(row.subjects, row.prints, row.failures) for row in report.sets] == [
        (7, 21, 2),
        (6, 12, 0),
    ]
    assert report.pooled.mated == sum(row.rates.mated for row in report.sets)
    assert report.pooled.nonmated == 2 * report.pooled.mated
    again = evaluate_identification([made, second], test=test)
    assert again == report
    assert report.as_text().splitlines()[0] == "1 finger a subject, 4 to 5 subjects in the gallery"
    assert report.as_json()["pooled"]["fnir_at_fpir"][0]["fpir"] == 0.1


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
        assert report.loss is None
    assert people.read_bytes() == before


def test_a_large_background_is_searched_by_its_index_with_a_loss(people, made, monkeypatch):
    monkeypatch.setattr("fpmatch.gallery.search.opening.EXHAUSTIVE_UP_TO", 4)
    filled = load_background(people, MATCHER, engine=serial())
    test = IdentificationTest(fpirs=(0.2,), bootstrap=0, loss=0.002)
    report = evaluate_identification([made], filled.of_subjects(1), test=test)
    assert report.as_json()["loss"] == 0.002
    caption = replace(report, preselected=True).as_text().partition("\n")[0]
    assert caption.endswith(
        "only prints that the index passed on were compared, with a loss of 0.2 %"
    )


def test_the_background_is_a_folder_of_templates(tmp_path, made):
    from fpmatch.formats.files import save_template

    folder = tmp_path / "folder"
    folder.mkdir()
    for finger in (81, 82):
        save_template(folder / f"{finger}_1.xyt", disturbed(finger, 1))
    filled = load_background(folder, MATCHER, engine=serial())
    assert filled.of_subjects(1).subject.tolist() == [0, 1]
    assert filled.of_subjects(2).subject.tolist() == [0, 0]
    report = evaluate_identification([made], filled.of_subjects(1))
    assert report.background == 2


def test_prints_that_are_added_to_a_search_follow_its_own():
    few, more = ([disturbed(k, 1) for k in some] for some in ([1, 2], [3]))
    one, other = WholeSearch.of(few, MATCHER), WholeSearch.of(more, MATCHER)
    both = one.with_prints(more)
    assert both.numbers.tolist() == both.fingers.tolist() == [0, 1, 2]
    probe = MATCHER.prepare(disturbed(3, 1))

    def similarities(search):
        return search.similarities(probe, np.arange(len(search))).tolist()

    found = similarities(both)
    assert found == similarities(one) + similarities(other)
    plain = WholeSearch(MATCHER, one.numbers, one.fingers, [one.print_at(k) for k in range(2)])
    assert similarities(plain.with_prints(more)) == found
    assert similarities(WholeSearch.of([], MATCHER)) == []
