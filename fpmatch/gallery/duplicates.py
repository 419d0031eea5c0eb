"""What speaks against enrolling a print: that it, or another of its name, is enrolled already."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from fpmatch.gallery.entry import Entry, Label
from fpmatch.gallery.place import DamagedRowError
from fpmatch.gallery.tables import ABOUT, ENTRY

if TYPE_CHECKING:
    from collections.abc import Sequence

DPI_TOLERANCE: Final = 0.05  # tags are read to a tenth
PRINTS_PER_QUERY: Final = 500
_LABEL: Final = (ENTRY.c.subject, ENTRY.c.finger, ENTRY.c.impression)


@dataclass(frozen=True, slots=True)
class Claim:
    """Hold what a print would be enrolled as.

    Parameters
    ----------
    label : Label
        What it is to be called.
    content : bytes
        SHA-256 of its file.
    dpi : float or None
        The resolution that it is to be taken for; None leaves it to the file.
    """

    label: Label
    content: bytes
    dpi: float | None = None


@dataclass(frozen=True, slots=True)
class Enrolled:
    """Know those entries of a gallery that some claims might collide with."""

    by_content: dict[bytes, Entry] = field(default_factory=dict)
    by_label: dict[Label, Entry] = field(default_factory=dict)

    @classmethod
    def among(cls, connection: sa.Connection, claims: Sequence[Claim]) -> Enrolled:
        """Look up the entries that have the content or the label of a claim."""
        enrolled = cls()
        for k in range(0, len(claims), PRINTS_PER_QUERY):
            part = claims[k : k + PRINTS_PER_QUERY]
            labels = [(c.label.subject, c.label.finger, c.label.impression) for c in part]
            for condition in (
                ENTRY.c.content.in_([claim.content for claim in part]),
                sa.tuple_(*_LABEL).in_(labels),
            ):
                for row in connection.execute(sa.select(*ABOUT).where(condition)):
                    enrolled.note(as_entry(row))
        return enrolled

    def note(self, entry: Entry) -> None:
        """Know one more."""
        self.by_content[entry.content] = entry
        self.by_label[entry.label] = entry

    def objection(self, claim: Claim) -> str | None:
        """Tell what speaks against a claim: nothing (None), that it is met (""), or a reason."""
        known = self.by_content.get(claim.content)
        if known is not None:
            if known.label != claim.label:
                return f"the same picture is enrolled as {known.label} already ({known.source})"
            if claim.dpi is not None and abs(claim.dpi - known.dpi) > DPI_TOLERANCE:
                return f"enrolled already, at {known.dpi:g} dpi, not {claim.dpi:g}"
            return ""
        other = self.by_label.get(claim.label)
        if other is not None:
            return f"another picture is enrolled as {claim.label} already ({other.source})"
        return None


def as_entry(row: Any) -> Entry:
    """Return a row of the columns `ABOUT` as an entry, or raise DamagedRowError."""
    words, numbers = (row.subject, row.finger, row.impression, row.source), (row.id, row.minutiae)
    if (
        not all(isinstance(word, str) for word in words)
        or not all(isinstance(number, int) for number in numbers)
        or not isinstance(row.content, bytes)
        or not isinstance(row.dpi, float)
    ):
        raise DamagedRowError(f"entry {row.id} holds what was never written")
    return Entry(row.id, Label(*words[:3]), row.source, row.content, row.dpi, row.minutiae)
