"""Screening of new prints: they are compared with their fingers before they are enrolled."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final

from fpmatch.gallery.listing.entry import Failure
from fpmatch.gallery.listing.two_prints import find_doubts
from fpmatch.gallery.store.stored_template import unpack_template
from fpmatch.gallery.store.tables import ENROLLED
from fpmatch.gallery.tasks.consistency import LINK_SCORE
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.decision import find_reachable, find_shortage
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry, Label, PackedEntry
    from fpmatch.templates.minutiae import Template

MOST_COMPARED: Final = 8  # impressions of a finger that a new one is compared with


class Enrolment:
    """Enrol the prints of a run, and count what becomes of them.

    Prints of subjects that existed before are compared with their fingers first, and if `strict`
    all are; those are refused then that do not match, and those that are probably two prints in one
    or of no finger.
    """

    def __init__(self, gallery: Gallery, *, strict: bool = False) -> None:
        self._gallery, self._strict = gallery, strict
        self._given: set[bytes] = set()  # contents of the prints of this run
        self._doubted: set[Label] = set()  # of its prints that do not match their finger
        self._unsaved: list[Failure] = []  # which the gallery does not contain yet
        self.enrolled, self.known = 0, 0
        """Numbers of prints enrolled now and before."""
        self.failures: list[Failure] = []
        """Prints that could not be enrolled, with reasons."""
        self.noted: dict[str, tuple[Path, ...]] = {}
        """Notes, and the prints that each is about."""
        self.added: Counter[str] = Counter()
        """Numbers of prints that were added to subjects which other files enrolled before."""
        self.unmatched: list[Failure] = []
        """Prints that were enrolled although they do not match their finger."""

    def __repr__(self) -> str:
        counts = f"enrolled={self.enrolled}, known={self.known}, failures={self.failures}"
        return f"Enrolment({counts}, added={dict(self.added)}, unmatched={self.unmatched})"

    @property
    def counted(self) -> int:
        """The number of prints whose outcome is known."""
        return self.enrolled + self.known + len(self.failures)

    def fail(self, source: str, why: str) -> None:
        """Count a print that cannot be enrolled; `add` records it in the gallery."""
        self.failures.append(Failure(source, why))
        self._unsaved.append(self.failures[-1])

    def note_known(self, content: bytes) -> None:
        """Count a print that was enrolled before, by the SHA-256 of its file."""
        self.known += 1
        self._given.add(content)

    def add(self, new: Sequence[PackedEntry]) -> None:
        """Enrol prints, and record the failures until now, in one transaction."""
        accepted = self._screen(new)
        failed, self._unsaved = self._unsaved, []
        if not (accepted or failed):
            return
        conflicts = self._gallery.add_packed([entry for entry, *_ in accepted], failed)
        for (entry, existed, unmatched), conflict in zip(accepted, conflicts, strict=True):
            if conflict is None:
                self.enrolled += 1
                self.added.update([entry.label.subject] if existed else [])
                self.unmatched += [Failure(entry.source, unmatched)] if unmatched else []
            elif conflict == ENROLLED:
                self.note_known(entry.content)
            else:
                self.failures.append(Failure(entry.source, str(conflict)))

    def _screen(self, new: Sequence[PackedEntry]) -> list[tuple[PackedEntry, bool, str | None]]:
        """Return the new prints that are not refused, in the order in which they are enrolled.

        With each is stated if its subject was enrolled before from files that were not given, and
        why it does not match its finger.
        """
        self._given.update(entry.content for entry in new)
        enrolled = self._gallery.entries_by_subject({entry.label.subject for entry in new})
        earlier: dict[Label, list[tuple[Label, Template]]] = {}
        accepted: list[tuple[PackedEntry, bool, str | None]] = []
        for entry in new:
            existing = enrolled.get(entry.label.subject, [])
            existed = any(other.content not in self._given for other in existing)
            known = any(other.content == entry.content for other in existing)
            if known or not (existed or self._strict):
                accepted.append((entry, False, None))
                continue
            template = unpack_template(entry.template)
            existing = [other for other in existing if other.label not in self._doubted]
            others = earlier.setdefault(entry.label.of_finger, [])
            unmatched = find_unmatched(self._gallery, entry.label, template, existing, others)
            refused = ("; ".join(find_doubts(template)) or unmatched) if self._strict else None
            if unmatched:
                self._doubted.add(entry.label)
            elif not refused:
                others.append((entry.label, template))
            if refused:
                self.fail(entry.source, f"refused: {refused}")
            else:
                accepted.append((entry, existed, unmatched))
        return accepted


def find_unmatched(
    gallery: Gallery,
    label: Label,
    template: Template,
    existing: Sequence[Entry],
    earlier: Sequence[tuple[Label, Template]] = (),
) -> str | None:
    """Return why a print matches none of up to eight impressions of its finger; None if it does.

    `existing` are the entries of its subject; `earlier` are prints of its finger that are enrolled
    together with it.
    """
    same = {one.id: one.label for one in existing if one.label.of_finger == label.of_finger}
    stored = gallery.templates(of=[*same][-MOST_COMPARED:])
    others = [*((same[number], other) for number, other in stored), *earlier][-MOST_COMPARED:]
    if not others:
        return None
    matcher, curve = get_matcher(DEFAULT_MATCHER), load_calibration(DEFAULT_MATCHER)
    sides = [template, *(other for _, other in others)]
    probe, *references = [(side, matcher.prepare(side)) for side in sides]
    for reference in references:
        if curve.score(matcher.compare(probe[1], reference[1]).similarity) >= LINK_SCORE:
            return None
    known = find_reachable(matcher, curve, probe, references)
    lacking = find_shortage(matcher, curve, known, LINK_SCORE)
    why = "another finger, or other skin of it" if lacking is None else lacking.message
    verb = "does not match" if lacking is None else "cannot be compared with"
    more = f" or {len(others) - 1} other impressions" if len(others) > 1 else ""
    return f"{label} {verb} {others[0][0]}{more}: {why}"
