"""Consistency of fingers: whether the impressions of each, enrolled and new, match each other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.fingers.consolidate import link_impressions, linked_groups
from fpmatch.gallery.fingers.finger import choose_impressions
from fpmatch.gallery.store.audit import ranges
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

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
    gallery: Gallery, *, subject: str | None = None, progress: Progress = no_progress
) -> Iterator[FingerCheck]:
    """Compare the impressions of each finger with each other; yield fingers by first entry.

    Small touches of one finger that share no skin do not match either: two groups are a reason to
    inspect them, no proof. Two impressions match from a score of 30, or of more, up to 55, where
    they form many pairs. Of more than 64 impressions, all are compared with 64 spread over them.
    Fingers with one impression are left out, and damaged entries.

    Only fingers of a `subject` are checked (default: all). `progress` is called with stage "check"
    and numbers of impressions. Raises GalleryError if the gallery cannot be read.
    """
    matcher, curve = get_matcher(DEFAULT_MATCHER), load_calibration(DEFAULT_MATCHER)
    fingers: dict[Label, dict[int, Entry]] = {}
    for entry in gallery.entries(subject=subject):
        fingers.setdefault(entry.label.of_finger, {})[entry.id] = entry
    several = [entries for entries in fingers.values() if len(entries) > 1]
    done, total = 0, sum(map(len, several))
    progress("check", 0, total)
    gallery.record("check", entries=ranges(number for entries in several for number in entries))
    for entries in several:
        sound = {entries[k]: template for k, template in gallery.templates(of=entries)}
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
    numbers = None if subject is None else gallery.numbers_of(subject)
    total = len(gallery if numbers is None else numbers)
    for done, _ in enumerate(gallery.packed_entries(of=numbers), start=1):
        progress("read", min(done, total), total)
    damaged = gallery.damaged.items()
    return {number: why for number, why in damaged if numbers is None or number in numbers}


def _check(sound: Mapping[Entry, Template], matcher: Matcher, curve: Calibration) -> FingerCheck:
    entries, templates = list(sound), list(sound.values())
    prepared = [matcher.prepare(template) for template in templates]
    among = set(choose_impressions(templates))
    needed = _link_score(len(entries))
    links = link_impressions(
        prepared, matcher, curve, least_score=needed, least_pairs=1, among=among
    )
    groups = linked_groups(len(entries), links)
    disagreements = []
    for group in groups[1:]:
        pairs = [(i, j) for i in groups[0] for j in group if i in among or j in among]
        scored = [
            (curve.score(matcher.compare(prepared[i], prepared[j]).similarity), i, j)
            for i, j in pairs or [(groups[0][0], group[0])]
        ]
        score, i, j = max(scored, key=lambda one: (one[0], -one[1], -one[2]))
        disagreements.append(Disagreement(entries[i], entries[j], score))
    grouped = tuple(tuple(entries[k] for k in group) for group in groups)
    return FingerCheck(grouped, tuple(disagreements))


def _link_score(count: int) -> float:
    """Return the score from which two of `count` impressions match; it grows with the pairs."""
    pairs = count * (count - 1) / 2  # one false match would join two fingers
    return min(LINK_SCORE + 10.0 * math.log10(pairs), HIGHEST_LINK_SCORE)
