"""The subjects of an open gallery, read for the prints that were compared."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.store.gallery import Gallery


class GallerySubjects:
    """The subjects of an open gallery, as of one revision of it."""

    def __init__(self, gallery: Gallery) -> None:
        self.gallery = gallery

    def __len__(self) -> int:
        return self.gallery.subjects()

    def fingers(self) -> int:
        """Return how many fingers there are."""
        return self._fingers

    @cached_property
    def _fingers(self) -> int:
        return self.gallery.count_fingers()

    def fingers_of(self, numbers: Sequence[int]) -> dict[str, dict[str, list[int]]]:
        """Return the subjects of the entries of some numbers, with all their fingers."""
        subjects: dict[str, dict[str, list[int]]] = {}
        for number, subject, finger in self.gallery.impressions_of_subjects(numbers):
            subjects.setdefault(subject, {}).setdefault(finger, []).append(number)
        return subjects
