"""Screening of new prints: they are compared with their fingers before they are enrolled."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.gallery.listing.entry import EnrolmentRequest, Failure, PackedEntry
from fpmatch.gallery.listing.two_prints import find_doubts
from fpmatch.gallery.store.stored_template import unpack_template
from fpmatch.gallery.store.tables import ENROLLED, Conflict
from fpmatch.gallery.tasks.consistency import LINK_SCORE
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.decision import find_shortage
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry, Label
    from fpmatch.templates.minutiae import Template

MOST_COMPARED: Final = 8  # impressions of a finger that a new one is compared with


class _Screened(NamedTuple):
    """A new print, and what is known of it before it is enrolled.

    `existed` is whether its subject was enrolled before from files that were not given, and
    `unmatched` is why it does not match its finger; `refused` is why it may not be enrolled.
    """

    entry: PackedEntry
    existed: bool = False
    unmatched: str | None = None
    refused: str | None = None


class Screening:
    """Enrol the prints of a run, and count what becomes of them.

    Prints of subjects that existed before are compared with their fingers first, and if `strict`
    all are; those are refused then that do not match, and those that are probably two prints in one
    or of no finger.
    """

    def __init__(self, gallery: Gallery, *, strict: bool = False) -> None:
        self._gallery, self._strict = gallery, strict
        self._given: set[bytes] = set()  # contents of the prints of this run
        self._doubted: set[Label] = set()  # of its prints that do not match their finger
        self.enrolled, self.known = 0, 0
        """Numbers of prints enrolled now and before."""
        self.failures: list[Failure] = []
        self.added: Counter[str] = Counter()
        """Numbers of prints that were added to subjects that existed before."""
        self.unmatched: list[Failure] = []
        """Prints that were enrolled although they do not match their finger."""

    def add(self, new: Sequence[PackedEntry | Failure], failures: Sequence[Failure] = ()) -> None:
        """Enrol prints, and record the failures, in one transaction."""
        packed = [entry for entry in new if isinstance(entry, PackedEntry)]
        failed = [*failures, *(entry for entry in new if isinstance(entry, Failure))]
        requests = [EnrolmentRequest(entry.label, entry.content, entry.dpi) for entry in packed]
        conflicts = self._gallery.find_conflicts(requests)
        for entry, conflict in zip(packed, conflicts, strict=True):
            if conflict == ENROLLED:
                self.note_known(entry.content)
        left = [one for one, no in zip(packed, conflicts, strict=True) if no != ENROLLED]
        screened = self._screen(left)
        failed += [
            Failure(one.entry.source, f"refused: {one.refused}") for one in screened if one.refused
        ]
        accepted = [one for one in screened if not one.refused]
        if accepted or failed:
            conflicts = self._gallery.add_packed([one.entry for one in accepted], failed)
            self.failures += failed
            for one, conflict in zip(accepted, conflicts, strict=True):
                self._count(one, conflict)

    def note_known(self, content: bytes) -> None:
        """Count a print that was enrolled before, by the SHA-256 of its file."""
        self.known += 1
        self._given.add(content)

    def _count(self, one: _Screened, conflict: Conflict | None) -> None:
        source = one.entry.source
        if conflict is None:
            self.enrolled += 1
            self.added.update([one.entry.label.subject] if one.existed else [])
            self.unmatched += [Failure(source, one.unmatched)] if one.unmatched else []
        elif conflict == ENROLLED:
            self.note_known(one.entry.content)
        else:
            self.failures.append(Failure(source, str(conflict)))

    def _screen(self, new: Sequence[PackedEntry]) -> list[_Screened]:
        """Return what is known of new prints, in the order in which they are enrolled."""
        self._given.update(entry.content for entry in new)
        enrolled = self._gallery.entries_by_subject({entry.label.subject for entry in new})
        earlier: dict[Label, list[tuple[Label, Template]]] = {}
        screened = []
        for entry in new:
            existing = enrolled.get(entry.label.subject, [])
            existed = any(other.content not in self._given for other in existing)
            if not (existed or self._strict):
                screened.append(_Screened(entry))
                continue
            template = unpack_template(entry.template)
            existing = [other for other in existing if other.label not in self._doubted]
            others = earlier.setdefault(entry.label.of_finger, [])
            unmatched = find_unmatched(self._gallery, entry.label, template, existing, others)
            refused = None
            if self._strict:
                refused = "; ".join(find_doubts(template)) or unmatched
            if unmatched:
                self._doubted.add(entry.label)
            elif not refused:
                others.append((entry.label, template))
            screened.append(_Screened(entry, existed, unmatched, refused))
        return screened


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
    of_finger = [entry for entry in existing if entry.label.of_finger == label.of_finger]
    stored = [
        (entry.label, gallery.find_template(entry.id)) for entry in of_finger[-MOST_COMPARED:]
    ]
    others = [(name, other) for name, other in (*stored, *earlier) if other is not None]
    others = others[-MOST_COMPARED:]
    if not others:
        return None
    matcher, curve = get_matcher(DEFAULT_MATCHER), load_calibration(DEFAULT_MATCHER)
    sides = [template, *(other for _, other in others)]
    probe, *references = [(side, matcher.prepare(side)) for side in sides]
    for reference in references:
        if curve.score(matcher.compare(probe[1], reference[1]).similarity) >= LINK_SCORE:
            return None
    lacking = find_shortage(matcher, curve, probe, references, LINK_SCORE)
    why = "another finger, or other skin of it" if lacking is None else lacking.message
    verb = "does not match" if lacking is None else "cannot be compared with"
    more = f" or {len(others) - 1} other impressions" if len(others) > 1 else ""
    return f"{label} {verb} {others[0][0]}{more}: {why}"
