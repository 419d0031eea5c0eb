"""Conflicts of prints to be enrolled with entries of the same content or label."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

from fpmatch.gallery.tables import ABOUT, ENTRY, as_entry

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.entry import EnrolmentRequest, Entry, Label

ENROLLED: Final = ""
"""What `Conflicts.find` returns for a print that is enrolled already."""

DPI_TOLERANCE: Final = 0.05  # resolutions in files have one decimal
PRINTS_PER_QUERY: Final = 500
_LABEL: Final = (ENTRY.c.subject, ENTRY.c.finger, ENTRY.c.impression)


class Conflicts:
    """Entries of a gallery that have the content or the label of some requests."""

    def __init__(self, connection: sa.Connection, requests: Sequence[EnrolmentRequest]) -> None:
        self._by_content: dict[bytes, Entry] = {}
        self._by_label: dict[Label, Entry] = {}
        for k in range(0, len(requests), PRINTS_PER_QUERY):
            part = requests[k : k + PRINTS_PER_QUERY]
            labels = [(r.label.subject, r.label.finger, r.label.impression) for r in part]
            for condition in (
                ENTRY.c.content.in_([request.content for request in part]),
                sa.tuple_(*_LABEL).in_(labels),
            ):
                for row in connection.execute(sa.select(*ABOUT).where(condition)):
                    self.add(as_entry(row))

    def add(self, entry: Entry) -> None:
        """Take another entry into account."""
        self._by_content[entry.content] = entry
        self._by_label[entry.label] = entry

    def find(self, request: EnrolmentRequest) -> str | None:
        """Return why a print cannot be enrolled, `ENROLLED`, or None where it can be."""
        known = self._by_content.get(request.content)
        if known is not None:
            if known.label != request.label:
                return f"the same picture is enrolled as {known.label} already ({known.source})"
            if request.dpi is not None and abs(request.dpi - known.dpi) > DPI_TOLERANCE:
                return f"enrolled already, at {known.dpi:g} dpi, not {request.dpi:g}"
            return ENROLLED
        other = self._by_label.get(request.label)
        if other is not None:
            return f"another picture is enrolled as {request.label} already ({other.source})"
        return None
