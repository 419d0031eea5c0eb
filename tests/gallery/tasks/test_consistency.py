"""Prints of another finger are found among the impressions of a finger, and refused on request."""

from dataclasses import replace

import pytest
from made_prints import entry_of, print_of

from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.tasks import consistency
from fpmatch.gallery.tasks.consistency import check_added, check_fingers, find_added, find_copies
from fpmatch.matching.compiled import COMPILED


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
    assert not first.consistent
    assert [[entry.id for entry in group] for group in first.groups] == [[1, 2], [3]]
    (pair,) = first.disagreements
    assert pair.other.id == 3
    assert pair.score < 30
    assert str(pair).startswith("a_3 (entry 3) does not match a_")
    assert first.as_dict()["groups"] == [[1, 2], [3]]
    assert second.consistent
    assert (second.name, second.disagreements) == ("b", ())
    assert list(check_fingers(gallery, subjects={"c"})) == []


def test_what_disagrees_with_what_was_there_is_refused(gallery):
    gallery.add(entries(("a", 1, 1)))
    new = entries(("a", 2, 2), ("a", 3, 2), ("a", 4, 1), ("b", 1, 5))
    gallery.add(new)
    found, unmatched = check_added(gallery, [entry.label for entry in new], {}, strict=True)
    refused = sorted(found.values(), key=lambda failure: failure.source)
    assert [failure.source for failure in refused] == ["a_2.tif", "a_3.tif"]
    assert "does not match a_1" in refused[0].reason
    assert [str(entry.label) for entry in gallery.entries()] == ["a_1", "a_4", "b_1"]
    assert gallery.failures() == refused
    assert unmatched == []


def test_a_print_with_too_little_skin_is_not_called_another_finger(gallery):
    gallery.add(entries(("a", 1, 1)))
    (new,) = entries(("a", 2, 2))
    few = replace(new.template, minutiae=new.template.minutiae.take([0, 1]), field=None)
    gallery.add([replace(new, template=few)])
    _, unmatched = check_added(gallery, [new.label], {"a": [2]})
    assert unmatched[0].reason.startswith("a_2 cannot be compared with a_1: 2 minutiae on ")


def added_to(gallery, new):
    """Return what `find_added` finds of new entries and those that were enrolled with them."""
    given = {entry.content for entry in new}
    return find_added(gallery, {entry.label.subject for entry in new}, given.intersection)


def test_what_joins_a_subject_is_told_however_often_a_run_was_interrupted(gallery):
    gallery.add(entries(("a", 1, 1), ("a", 2, 1), ("c", 1, 3)))
    new = entries(("a", 3, 2), ("a", 4, 1), ("a", 5, 2), ("b", 1, 5), ("b", 2, 6))
    gallery.add(new[:1])  # by the part of the run before it was interrupted
    gallery.add(new[1:])
    assert added_to(gallery, new) == {"a": [4, 5, 6]}
    last = [entry.label for entry in new[1:]]
    refused, unmatched = check_added(gallery, last, added_to(gallery, new))
    assert refused == {}
    assert [one.source for one in unmatched] == ["a_3.tif", "a_5.tif"]
    assert unmatched[0].reason.startswith("a_3 does not match a_1 or any other of 3 impressions")
    refused, unmatched = check_added(gallery, last, added_to(gallery, new), strict=True)
    assert [one.source for one in refused.values()] == ["a_5.tif", "b_2.tif"]
    assert [one.source for one in unmatched] == ["a_3.tif"]  # enrolled before: not removed
    assert [entry.id for entry in gallery.entries()] == [1, 2, 3, 4, 5, 7]


def test_a_print_that_matches_any_group_of_its_finger_is_accepted(gallery):
    gallery.add(entries(("a", 1, 1), ("a", 2, 1), ("a", 3, 2)))
    new = entries(("a", 4, 2))
    gallery.add(new)
    assert check_added(gallery, [new[0].label], added_to(gallery, new), strict=True) == ({}, [])


def test_copies_are_found_whatever_their_subject_and_file(gallery, monkeypatch):
    old = entries(("a", 1, 1), ("a", 2, 1))
    copies = [
        replace(old[0], label=Label("b"), source="b.tif", content=b"b" * 32),
        replace(old[1], label=Label("a", "", "3"), source="a_3.tif", content=b"c" * 32),
    ]
    gallery.add([*old, *copies, *entries(("d", 1, 7))])
    labels = [*(entry.label for entry in copies), Label("d", "", "1")]
    found = find_copies(gallery, labels, {27})
    assert [(str(entry.label), str(other)) for entry, other in found] == [
        ("b", "a_1"),
        ("a_3", "a_2"),
    ]
    monkeypatch.setattr(consistency, "SEARCHED_UP_TO", 1)
    monkeypatch.setattr(consistency, "SEARCHED_PER_PRINT", 1)
    assert find_copies(gallery, labels, {27}) == []


@pytest.mark.skipif(not COMPILED, reason="minutes where kernels are interpreted")
def test_very_many_impressions_are_checked_against_some(gallery):
    gallery.add(entries(*(("a", number, 1) for number in range(1, 81)), ("b", 1, 2)))
    (check,) = check_fingers(gallery)
    assert check.consistent
    assert len(check.groups[0]) == 80
