"""The subjects of the gallery of an open-set test."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class EnrolledSubjects:
    """The subject of each entry of a search, numbered from 0, and which of its fingers it is.

    Entries of subject -1 are of no subject. It is a `fpmatch.gallery.search.fused.Subjects`.
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
