"""Consistency of fingers: whether the impressions of each, enrolled and new, match each other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain, combinations
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.fingers.finger import choose_impressions
from fpmatch.gallery.store.audit import ranges
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry, Label
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

LINK_SCORE: Final = 30.0
HIGHEST_LINK_SCORE: Final = 55.0


@dataclass(frozen=True, slots=True)
class Disagreement:
    """The best-scoring pair of two groups that do not match, `one` of the larger group."""

    one: Entry
    other: Entry
    score: float

    def __str__(self) -> str:
        return (
            f"{self.other.label} (entry {self.other.id}) does not match {self.one.label} "
            f"(entry {self.one.id}), score {self.score:.1f}"
        )


@dataclass(frozen=True, slots=True)
class FingerCheck:
    """The groups of impressions of one finger that match each other, the largest first.

    `disagreements` are the best-scoring pairs of each further group and the first.
    """

    groups: tuple[tuple[Entry, ...], ...]
    disagreements: tuple[Disagreement, ...]

    @property
    def name(self) -> str:
        """Subject and finger."""
        return str(self.groups[0][0].label.of_finger)

    @property
    def consistent(self) -> bool:
        """Whether there is one group only."""
        return len(self.groups) == 1

    def as_dict(self) -> dict[str, Any]:
        """Return the check as JSON values."""
        label = self.groups[0][0].label
        return {
            "subject": label.subject,
            "finger": label.finger,
            "consistent": self.consistent,
            "groups": [[entry.id for entry in group] for group in self.groups],
            "disagreements": [
                {"ids": [pair.one.id, pair.other.id], "score": pair.score}
                for pair in self.disagreements
            ],
        }


def check_fingers(
    gallery: Gallery, *, subjects: Collection[str] | None = None, progress: Progress = no_progress
) -> Iterator[FingerCheck]:
    """Compare the impressions of each finger with each other; yield fingers by first entry.

    Small touches of one finger that share no skin do not match either: two groups are a reason to
    inspect them, no proof. Two impressions match from a score of 30, or of more, up to 55, where
    they form many pairs. Of more than 64 impressions, all are compared with 64 spread over them.
    Fingers with one impression are left out, and damaged entries.

    Only fingers of `subjects` are checked (default: all). `progress` is called with stage "check"
    and numbers of impressions. Raises GalleryError if the gallery cannot be read.
    """
    matcher, curve = get_matcher(DEFAULT_MATCHER), load_calibration(DEFAULT_MATCHER)
    fingers: dict[Label, list[Entry]] = {}
    wanted = [None] if subjects is None else subjects
    for entry in chain.from_iterable(gallery.entries(subject=one) for one in wanted):
        fingers.setdefault(entry.label.of_finger, []).append(entry)
    several = [entries for entries in fingers.values() if len(entries) > 1]
    several.sort(key=lambda entries: entries[0].id)
    done, total = 0, sum(map(len, several))
    progress("check", 0, total)
    gallery.record("check", entries=ranges(entry.id for entries in several for entry in entries))
    for entries in several:
        templates = [(entry, gallery.find_template(entry.id)) for entry in entries]
        sound = {entry: template for entry, template in templates if template is not None}
        if len(sound) > 1:
            yield _check(sound, matcher, curve)
        done += len(entries)
        progress("check", done, total)


def find_damaged(
    gallery: Gallery, *, subject: str | None = None, progress: Progress = no_progress
) -> dict[int, str]:
    """Read all entries of a gallery, or of a subject; return why some are damaged, by number.

    `progress` is called with stage "read" and numbers of entries. Raises GalleryError if the
    gallery cannot be read.
    """
    if subject is None:
        total = len(gallery)
        for done, _ in enumerate(gallery.packed_entries(), start=1):
            progress("read", min(done, total), total)
        return dict(gallery.damaged)
    numbers = gallery.numbers_of(subject)
    for number in numbers:
        if gallery.find_entry(number) is not None:
            gallery.find_template(number)
    return {number: gallery.damaged[number] for number in numbers if number in gallery.damaged}


def _check(sound: Mapping[Entry, Template], matcher: Matcher, curve: Calibration) -> FingerCheck:
    """Return the groups of readable impressions of a finger that matches link."""
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415  (slow to import)

    entries, templates = list(sound), list(sound.values())
    prepared = [matcher.prepare(template) for template in templates]
    among = set(choose_impressions(len(entries)))
    scores = np.zeros((len(entries), len(entries)))
    for i, j in combinations(range(len(entries)), 2):
        if i in among or j in among:
            similarity = matcher.compare(prepared[i], prepared[j]).similarity
            scores[i, j] = scores[j, i] = curve.score(similarity)
    _, label = connected_components(scores >= _link_score(len(entries)), directed=False)
    groups = [np.flatnonzero(label == k).tolist() for k in range(max(label) + 1)]
    groups.sort(key=lambda group: (-len(group), group[0]))
    disagreements = []
    for group in groups[1:]:
        between = scores[np.ix_(groups[0], group)]
        row, column = np.unravel_index(between.argmax(), between.shape)
        one, other = entries[groups[0][row]], entries[group[column]]
        disagreements.append(Disagreement(one, other, float(between[row, column])))
    grouped = tuple(tuple(entries[k] for k in group) for group in groups)
    return FingerCheck(grouped, tuple(disagreements))


def _link_score(count: int) -> float:
    """Return the score from which two of `count` impressions match; it grows with the pairs."""
    pairs = count * (count - 1) / 2  # one false match would join two fingers
    return min(LINK_SCORE + 10.0 * math.log10(pairs), HIGHEST_LINK_SCORE)
