"""Consistency of fingers: whether the enrolled impressions of each match each other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.fingers.consolidate import link_impressions, linked_groups
from fpmatch.gallery.fingers.finger import MOST_IMPRESSIONS, choose_impressions
from fpmatch.gallery.listing.entry import Failure
from fpmatch.gallery.listing.two_prints import find_doubts
from fpmatch.gallery.store.audit import ranges
from fpmatch.gallery.store.tables import parts
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.decision import find_reachable, find_shortage
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Container, Iterator, Mapping, Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry, Label
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

SEARCHED_UP_TO: Final = 20_000  # entries of a gallery in which copies are looked for,
SEARCHED_PER_PRINT: Final = 20  # or for each new print
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


def find_added(
    gallery: Gallery, subjects: Collection[str], given: Callable[[set[bytes]], Container[bytes]]
) -> dict[str, list[int]]:
    """Return given entries that were added to subjects that were enrolled before.

    `given` returns those of some contents that are of the given prints. By subject, the numbers are
    those of its given entries that came after one that is not given. So the result is the same for
    a run that was interrupted and continued.
    """
    added: dict[str, list[int]] = {}
    for part in parts(subjects):
        rows = gallery.contents_of(part)
        ours = given({content for _, _, content in rows})
        existing: set[str] = set()
        for number, subject, content in rows:
            if content not in ours:
                existing.add(subject)
            elif subject in existing:
                added.setdefault(subject, []).append(number)
    return added


def check_added(
    gallery: Gallery,
    new: Collection[Label],
    added: Mapping[str, Sequence[int]],
    *,
    strict: bool = False,
) -> tuple[dict[int, Failure], list[Failure]]:
    """Find impressions that match no other one of their finger; return those refused, and the rest.

    Compared are those of `added`, from `find_added`, with what their fingers had before. If
    `strict`, so are all `new` ones with the others of their fingers, and those of the new ones that
    match none are removed, and so are any that are probably two prints in one, or of no finger;
    they are returned by number. Where no impression of a finger is older, the largest group is
    kept.
    """
    fresh, labels = {number for numbers in added.values() for number in numbers}, set(new)
    subjects = {*added, *(label.subject for label in labels if strict)}

    def is_fresh(entry: Entry) -> bool:
        return entry.id in fresh or (strict and entry.label in labels)

    refused = _find_doubtful(gallery, labels) if strict else {}
    _remove(gallery, refused)
    unrelated: dict[int, Failure] = {}
    unmatched = []
    for check in check_fingers(gallery, subjects=subjects) if subjects else ():
        older = [group for group in check.groups if not all(map(is_fresh, group))]
        kept = {entry.id: entry for group in older or check.groups[:1] for entry in group}
        for entry in filter(is_fresh, chain.from_iterable(check.groups)):
            if entry.id in kept:
                continue
            why = _why_unmatched(gallery, entry, list(kept.values()), check.name)
            if strict and entry.label in labels:
                unrelated[entry.id] = Failure(entry.source, f"refused: {why}")
            else:
                unmatched.append(Failure(entry.source, f"{entry.label} {why}"))
    _remove(gallery, unrelated)
    return refused | unrelated, unmatched


def _find_doubtful(gallery: Gallery, labels: Collection[Label]) -> dict[int, Failure]:
    """Return the entries of some labels that are probably not one finger's, by number."""
    refused = {}
    for subject in {label.subject for label in labels}:
        for entry in gallery.entries(subject=subject):
            template = gallery.find_template(entry.id) if entry.label in labels else None
            if template is not None and (why := find_doubts(template)):
                refused[entry.id] = Failure(entry.source, f"refused: {'; '.join(why)}")
    return refused


def _remove(gallery: Gallery, refused: Mapping[int, Failure]) -> None:
    if refused:
        gallery.remove(refused)
        gallery.add([], list(refused.values()))


def _why_unmatched(gallery: Gallery, entry: Entry, kept: Sequence[Entry], finger: str) -> str:
    """Return the reason for an impression that does not match those that are `kept`."""
    matcher, curve = get_matcher(DEFAULT_MATCHER), load_calibration(DEFAULT_MATCHER)
    sides = [gallery.template(one.id) for one in (entry, *kept[:MOST_IMPRESSIONS])]
    probe, *references = [(side, matcher.prepare(side)) for side in sides]
    known = find_reachable(matcher, curve, probe, references)
    lacking = find_shortage(matcher, curve, known, LINK_SCORE)
    others = f" or any other of {len(kept)} impressions of {finger}" if len(kept) > 1 else ""
    why = "another finger, or other skin of it" if lacking is None else lacking.message
    verb = "does not match" if lacking is None else "cannot be compared with"
    return f"{verb} {kept[0].label}{others}: {why}"


def find_copies(
    gallery: Gallery, new: Collection[Label], counts: Collection[int]
) -> list[tuple[Entry, Label]]:
    """Return new entries that have the frame and minutiae of an earlier one, with its label.

    `counts` are the numbers of minutiae of the new ones. A gallery that is large beside them is not
    searched: none is found.
    """
    labels = set(new)
    if not labels or gallery.has_over(max(SEARCHED_UP_TO, SEARCHED_PER_PRINT * len(labels))):
        return []
    first: dict[bytes, int] = {}
    copies = []
    for number, digest in gallery.minutiae_digests(counts):
        earlier = first.setdefault(digest, number) if digest else number
        if earlier != number and (entry := gallery.find_entry(number)) and entry.label in labels:
            other = gallery.find_entry(earlier)
            copies += [] if other is None else [(entry, other.label)]
    return copies


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
