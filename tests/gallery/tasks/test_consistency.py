"""Prints of another finger are found among those of a finger, before and after enrolment."""

from dataclasses import replace

import pytest
from made_prints import entry_of, print_of

from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.gallery.tasks.consistency import check_fingers, find_unmatched
from fpmatch.gallery.tasks.enrol import Enrolment
from fpmatch.matching.constants import COMPILED


def entries(*prints):
    """Return new entries of (subject, impression, finger shown) and perhaps resolution."""
    return [
        entry_of(
            1000 * ord(subject) + number,
            print_of(shown, number, *dpi),
            Label(subject, "", str(number)),
            source=f"{subject}_{number}.tif",
        )
        for subject, number, shown, *dpi in prints
    ]


def test_a_print_of_another_finger_is_told_with_the_pair_that_disagrees(gallery):
    gallery.add(entries(("a", 1, 1), ("a", 2, 1, 1000.0), ("a", 3, 2)))
    gallery.add(entries(("b", 1, 3), ("b", 2, 3, 400.0), ("c", 1, 4)))
    reported = []
    first, second = check_fingers(gallery, progress=lambda _, done, __: reported.append(done))
    assert reported == [0, 3, 5]
    assert (first["consistent"], first["groups"]) == (False, [[1, 2], [3]])
    (pair,) = first["disagreements"]
    assert pair["ids"][1] == 3
    assert pair["score"] < 30
    second_finger = ("b", "", True, [[4, 5]], [])
    assert tuple(second.values()) == second_finger
    assert list(check_fingers(gallery, subject="c")) == []


def screened(gallery, new, *, strict=False):
    """Return a run that enrols new entries one by one."""
    screening = Enrolment(gallery, strict=strict)
    for entry in new:
        screening.add([entry])
    return screening


@pytest.mark.parametrize("together", [False, True])
def test_what_matches_nothing_of_its_finger_is_named_or_refused(gallery, together):
    gallery.add(entries(("a", 1, 1)))
    new = entries(("a", 2, 2), ("a", 3, 2), ("a", 4, 1), ("b", 1, 5), ("b", 2, 6))
    run = Enrolment(gallery, strict=True)
    if together:
        run.add(new)
    else:
        run = screened(gallery, new, strict=True)
    assert [failure.source for failure in run.failures] == ["a_2.tif", "a_3.tif", "b_2.tif"]
    assert run.failures[0].reason.startswith("refused: a_2 does not match a_1: another finger")
    assert [str(entry.label) for entry in gallery.entries()] == ["a_1", "a_4", "b_1"]
    assert sorted(gallery.failures(), key=str) == sorted(run.failures, key=str)
    assert (run.enrolled, run.added, run.unmatched) == (2, {"a": 1}, [])
    run = screened(gallery, new)
    assert (run.enrolled, run.known, run.failures) == (3, 2, [])
    assert run.added == {"a": 2}  # b is of this run alone
    assert [one.source for one in run.unmatched] == ["a_2.tif", "a_3.tif"]


def test_a_print_is_compared_with_the_last_eight_before_it_is_stored(gallery, monkeypatch):
    gallery.add(entries(*(("a", number, 1) for number in range(1, 12))))
    read, templates = [], gallery.templates
    monkeypatch.setattr(gallery, "templates", lambda of: read.extend(of) or templates(of=of))
    (new,) = entries(("a", 20, 9))
    existing = list(gallery.entries(subject="a"))
    why = find_unmatched(gallery, new.label, unpack_template(new.template), existing)
    assert why.startswith("a_20 does not match a_4 or 7 other impressions: another finger")
    assert read == list(range(4, 12))
    assert len(gallery) == 11


def test_a_print_with_too_little_skin_is_not_called_another_finger(gallery):
    gallery.add(entries(("a", 1, 1)))
    (new,) = entries(("a", 2, 2))
    few = replace(print_of(2, 2), minutiae=print_of(2, 2).minutiae.take([0, 1]))
    run = screened(gallery, [replace(new, template=pack_template(few))])
    assert run.unmatched[0].reason.startswith("a_2 cannot be compared with a_1: 2 minutiae on ")


@pytest.mark.skipif(not COMPILED, reason="minutes where kernels are interpreted")
def test_very_many_impressions_are_checked_against_some(gallery):
    gallery.add(entries(*(("a", number, 1) for number in range(1, 81)), ("b", 1, 2)))
    (check,) = check_fingers(gallery)
    assert [len(group) for group in check["groups"]] == [80]
