"""Who is enrolled and who is searched for: a third of the searches have a mate in the gallery.

A subject is one finger, or several. Its presentations are prints of all of its fingers, one each:
the first print of every finger, the second, and so on. The subjects are divided at random into
three groups. In each round one group is enrolled, with one presentation of each subject, and the
presentations of all subjects that are not enrolled are searched for: those of the other two groups
have no mate. The groups take turns, and so do the presentations of a subject, so that every pair of
presentations of a subject is a search and its mate.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.random import default_rng

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


GROUPS: Final = 3
MOST_TURNS: Final = 20  # presentations of a subject that take turns in the gallery


def subject_of(finger: int | str) -> str | None:
    """Return the subject in the name of a finger, ``subject/finger``; None where there is none."""
    subject, slash, _ = str(finger).rpartition("/")
    return subject if slash else None


def group_fingers(subjects: Sequence[object], size: int) -> list[tuple[int, ...]]:
    """Return fingers in groups of `size`, each a subject, as indices of fingers.

    Fingers of one subject, by its name in `subjects`, are grouped first; what remains of each, and
    fingers whose subject is not known (None), are grouped with their neighbours as a virtual
    subject. The last fingers that fill no group are left out.
    """
    fingers_of: dict[object, list[int]] = {}
    for finger, subject in enumerate(subjects):
        fingers_of.setdefault(finger if subject is None else (subject,), []).append(finger)
    groups, rest = [], []
    for fingers in fingers_of.values():
        whole = len(fingers) - len(fingers) % size
        groups += [tuple(fingers[k : k + size]) for k in range(0, whole, size)]
        rest += fingers[whole:]
    whole = len(rest) - len(rest) % size
    return sorted(groups + [tuple(rest[k : k + size]) for k in range(0, whole, size)])


@dataclass(frozen=True, slots=True, eq=False)
class Roles:
    """The roles of all presentations, which are numbered subject by subject.

    `subject` holds the subject of each presentation, and `place` its place among the subject's.
    `sizes` holds the number of presentations of each subject, and `group` its group.
    """

    subject: NDArray[np.intp]
    place: NDArray[np.intp]
    sizes: NDArray[np.intp]
    group: NDArray[np.intp]

    @classmethod
    def draw(cls, sizes: Sequence[Sequence[int]], seed: int = 0) -> Roles:
        """Divide subjects into groups, those of each database into groups of nearly equal size.

        `sizes` holds, for each database, the number of presentations of each subject, at least 1.
        """
        count, groups = 0, []
        for k, of_set in enumerate(sizes):
            order = default_rng([seed, k]).permutation(len(of_set))
            group = np.empty(len(of_set), np.intp)
            group[order] = (count + np.arange(len(of_set))) % GROUPS
            groups.append(group)
            count += len(of_set)
        every = np.array([size for of_set in sizes for size in of_set], np.intp)
        first = np.repeat(np.cumsum(every) - every, every)
        return cls(
            subject=np.repeat(np.arange(every.size), every),
            place=np.arange(first.size) - first,
            sizes=every,
            group=np.concatenate(groups),
        )

    @property
    def turns(self) -> int:
        """Number of turns of each group."""
        return min(int(self.sizes.max(initial=0)), MOST_TURNS)

    def enrolled(self, group: int, turn: int) -> NDArray[np.intp]:
        """Return the presentations that are enrolled when a group has its turn, by subject."""
        shown = self.place == turn % self.sizes[self.subject]
        return np.flatnonzero(shown & (self.group[self.subject] == group))

    def is_searched(self, presentation: int, turn: int) -> bool:
        """Return whether a presentation is searched for in a turn, of whichever group.

        It is not where its subject would be enrolled by it, unless the subject has no other: then
        it is searched for when the other groups are enrolled.
        """
        size = int(self.sizes[self.subject[presentation]])
        return size == 1 or turn % size != self.place[presentation]


@dataclass(frozen=True, eq=False)
class EnrolledSubjects:
    """The subject of each entry of a search, numbered from 0, and which of its fingers it is.

    Entries of subject -1 are of no subject. It is a `fpmatch.gallery.search.search.Subjects`.
    """

    numbers: NDArray[np.int64]
    subject: NDArray[np.intp]
    finger: NDArray[np.intp]

    @cached_property
    def _by_subject(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        order = np.argsort(self.subject, kind="stable")
        return order, np.searchsorted(self.subject[order], np.arange(len(self) + 1))

    def __len__(self) -> int:
        return int(self.subject.max(initial=-1)) + 1

    def fingers(self) -> int:
        """Return how many fingers there are."""
        return len({*zip(self.subject.tolist(), self.finger.tolist(), strict=True)})

    def subject_of(self, number: int) -> str | None:
        """Return the subject of the entry of a number; None if it is of none."""
        subject = int(self.subject[np.searchsorted(self.numbers, number)])
        return None if subject < 0 else str(subject)

    def fingers_of(self, numbers: Sequence[int]) -> dict[str, dict[str, list[int]]]:
        """Return the subjects of the entries of some numbers, with the entries of all fingers."""
        order, start = self._by_subject
        subjects: dict[str, dict[str, list[int]]] = {}
        for subject in np.unique(self.subject[np.searchsorted(self.numbers, numbers)]).tolist():
            if subject >= 0:
                fingers = subjects.setdefault(str(subject), {})
                for k in order[start[subject] : start[subject + 1]].tolist():
                    of_finger = fingers.setdefault(str(self.finger[k]), [])
                    of_finger.append(int(self.numbers[k]))
        return subjects
