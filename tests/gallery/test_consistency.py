"""Prints of another finger are found among the impressions of a finger, and refused on request."""

from __future__ import annotations

import numpy as np
import pytest
from made_prints import entry_of

from fpmatch.gallery.consistency import check_fingers, refuse_disagreeing
from fpmatch.gallery.entry import Label
from fpmatch.matching._align_kernel import COMPILED
from fpmatch.minutiae import Minutiae, Template


def print_of(finger, impression, dpi=500.0):
    """Return an impression of a finger of 30 minutiae, a few of them missing."""
    rng = np.random.default_rng(finger)
    x, y = rng.uniform(20, 280, (2, 30))
    angle = rng.uniform(0, 6, 30)
    kept = np.random.default_rng([finger, impression]).permutation(30)[:27]
    zoom = dpi / 500.0
    size = round(300 * zoom)
    return Template(Minutiae(x[kept] * zoom, y[kept] * zoom, angle[kept]), size, size, dpi)


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
    told: list[int] = []
    first, second = check_fingers(gallery, progress=lambda _, done, __: told.append(done))
    assert told == [0, 3, 5]
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
    refused = refuse_disagreeing(gallery, [entry.label for entry in new])
    refused.sort(key=lambda failure: failure.source)
    assert [failure.source for failure in refused] == ["a_2.tif", "a_3.tif"]
    assert "does not match a_1" in refused[0].reason
    assert [str(entry.label) for entry in gallery.entries()] == ["a_1", "a_4", "b_1"]
    assert gallery.failures() == refused


def test_among_new_prints_alone_the_most_are_kept(gallery):
    new = entries(("a", 1, 2), ("a", 2, 1), ("a", 3, 1))
    gallery.add(new)
    (refused,) = refuse_disagreeing(gallery, [entry.label for entry in new])
    assert refused.source == "a_1.tif"
    assert refuse_disagreeing(gallery, [entry.label for entry in new[1:]]) == []


@pytest.mark.skipif(not COMPILED, reason="minutes where kernels are interpreted")
def test_very_many_impressions_are_checked_against_some(gallery):
    gallery.add(entries(*(("a", number, 1) for number in range(1, 81)), ("b", 1, 2)))
    (check,) = check_fingers(gallery)
    assert check.consistent
    assert len(check.groups[0]) == 80
