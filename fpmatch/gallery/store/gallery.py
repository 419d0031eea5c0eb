"""A gallery: enrolled templates in a database, safe against kills and concurrent writers."""

from __future__ import annotations

import hashlib
import secrets
from collections import deque
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
import sqlalchemy as sa

from fpmatch.errors import GalleryError
from fpmatch.gallery.listing.entry import Failure
from fpmatch.gallery.store import audit
from fpmatch.gallery.store.database import Database
from fpmatch.gallery.store.rows import (
    as_entry,
    as_new_entry,
    as_packed,
    as_template,
    check_row,
    row_digest,
    to_row,
)
from fpmatch.gallery.store.tables import (
    ABOUT,
    ENROLLED,
    ENTRY,
    FAILURE,
    GALLERY,
    WHOLE,
    Conflict,
    DamagedRowError,
    find_conflicts,
    parts,
)
from fpmatch.printable import as_text, printable

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence
    from typing import Self

    from numpy.typing import NDArray

    from fpmatch.gallery.listing.entry import EnrolmentRequest, Entry, NewEntry
    from fpmatch.gallery.store.sealing import Sealing
    from fpmatch.templates.minutiae import Template

Converted = TypeVar("Converted")

_COUNT: Final = sa.select(sa.func.count())


class Gallery(Database):
    """A database of enrolled impressions; `fpmatch.open_gallery` opens one.

    Every method is one transaction, or one for some thousand rows where it yields: a killed
    program leaves nothing half-written, and two may enrol at the same time. Methods raise
    GalleryError where the database cannot be read or written. Those that yield skip entries that
    are damaged; `damaged` has the reason of each, by its number.
    """

    erase: Callable[[set[int]], None] = staticmethod(lambda _numbers: None)
    """Called with the numbers of what was removed; `fpmatch.open_gallery` sets it."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Gallery({self.name!r})"

    def __len__(self) -> int:
        """Return the number of impressions."""
        return self.count(_COUNT.select_from(ENTRY))

    def subjects(self) -> int:
        """Return the number of subjects."""
        return self.count(sa.select(sa.func.count(ENTRY.c.subject.distinct())))

    def count_fingers(self) -> int:
        """Return the number of fingers."""
        fingers = sa.select(ENTRY.c.subject, ENTRY.c.finger).distinct().subquery()
        return self.count(_COUNT.select_from(fingers))

    def summarize(self) -> dict[str, Any]:
        """Return the counts of entries, as JSON values, and the keys in use."""
        sealing = self.sealing()
        return {
            "version": self.count(sa.select(GALLERY.c.version)),
            "impressions": len(self),
            "subjects": self.subjects(),
            "failures": self.count(_COUNT.select_from(FAILURE)),
            "keys": [] if sealing is None else [sealing.key_id],
        }

    def content_hash(self) -> str:
        """Return a hash that differs whenever fpmatch has changed the entries."""
        with self.reading() as connection:
            state = connection.scalar(sa.select(GALLERY.c.state))
            last = connection.scalar(sa.select(sa.func.max(ENTRY.c.id)))
        return hashlib.sha256(f"{state} {last}".encode()).hexdigest()[:32]

    def digests(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the numbers of all entries, ascending, and their digests; -1 for a missing one."""
        digest = sa.func.coalesce(sa.cast(ENTRY.c.digest, sa.BigInteger), -1)
        with self.reading() as connection:
            rows = connection.execute(sa.select(ENTRY.c.id, digest).order_by(ENTRY.c.id)).all()
        numbers, digests = np.array([tuple(row) for row in rows], np.int64).reshape(-1, 2).T
        return numbers, digests

    def entries(self, *, subject: str | None = None) -> Iterator[Entry]:
        """Yield the entries, or the entries of one subject, by ascending number.

        A subject from the name of a file may be given as in that name, or as it is printed.
        """
        query = sa.select(*ABOUT)
        return self._rows(query if subject is None else query.where(_is_of(subject)), as_entry)

    def entries_of(self, numbers: Collection[int]) -> Iterator[Entry]:
        """Yield the entries of some numbers; numbers without one, and damaged ones, are skipped."""
        return self._whole_rows(as_entry, of=numbers)

    def numbers_of(self, subject: str) -> list[int]:
        """Return the numbers of a subject's entries; GalleryError (code "unknown") if none."""
        query = sa.select(ENTRY.c.id).where(_is_of(subject)).order_by(ENTRY.c.id)
        with self.reading() as connection:
            numbers = list(connection.scalars(query))
        if not numbers:
            raise self.error(f"no impression of subject {subject}", "unknown")
        return numbers

    def entries_by_subject(self, subjects: Collection[str]) -> dict[str, list[Entry]]:
        """Return the entries of each of some subjects, by ascending number."""
        of_subject: dict[str, list[Entry]] = {}
        for part in parts(subjects):
            for entry in self._rows(sa.select(*ABOUT).where(ENTRY.c.subject.in_(part)), as_entry):
                of_subject.setdefault(entry.label.subject, []).append(entry)
        return of_subject

    def impressions_of_subjects(self, numbers: Sequence[int]) -> list[tuple[int, str, str]]:
        """Return number, subject and finger of all entries of the subjects of some, by number."""
        labels = sa.select(ENTRY.c.id, ENTRY.c.subject, ENTRY.c.finger)
        of_number: dict[int, tuple[int, str, str]] = {}
        for part in parts(numbers):
            theirs = ENTRY.c.subject.in_(sa.select(ENTRY.c.subject).where(ENTRY.c.id.in_(part)))
            with self.reading() as connection:
                rows = connection.execute(labels.where(theirs)).all()
            of_number |= {row.id: (row.id, row.subject, row.finger) for row in rows}
        return [of_number[number] for number in sorted(of_number)]

    def entry(self, number: int) -> Entry:
        """Return the entry of a number; GalleryError (code "unknown") if there is none."""
        return self._one(number, self.entries_of([number]))

    def template(self, number: int) -> Template:
        """Return the template of an entry; GalleryError if there is none or it is damaged."""
        return self._one(number, self.templates(of=[number]))[1]

    def find_template(self, number: int) -> Template | None:
        """Return the template of an entry; None where it is damaged or gone."""
        return dict(self.templates(of=[number])).get(number)

    def packed_templates(self, *, of: Collection[int] | None = None) -> Iterator[tuple[int, bytes]]:
        """Yield number and packed template of all entries.

        With `of`, only entries with these numbers are read; numbers without an entry are skipped.
        """
        return self._whole_rows(as_packed, of=of)

    def templates(self, *, of: Collection[int] | None = None) -> Iterator[tuple[int, Template]]:
        """Yield number and template of entries, which are chosen as by `packed_templates`."""
        return self._whole_rows(as_template, of=of)

    def packed_entries(
        self, *, of: Collection[int] | None = None
    ) -> Iterator[tuple[int, NewEntry]]:
        """Yield number and content of entries; each template was read once to check it."""
        return self._whole_rows(as_new_entry, of=of)

    def failures(self) -> list[Failure]:
        """Return what could not be enrolled, by source."""
        with self.reading() as connection:
            rows = connection.execute(sa.select(FAILURE).order_by(FAILURE.c.source)).all()
        return [Failure(str(row.source), str(row.reason)) for row in rows]

    def check_rows(self) -> None:
        """Raise GalleryError (code "damaged") unless each entry is as it was enrolled."""
        deque(self._rows(WHOLE, check_row), maxlen=0)
        for number in self.damaged:
            raise self._damage(number)

    def find_conflicts(
        self, requests: Sequence[EnrolmentRequest | NewEntry]
    ) -> list[Conflict | None]:
        """Return for each print None if it can be enrolled, `ENROLLED`, or why it cannot."""
        with self.reading() as connection:
            return find_conflicts(connection, requests)

    def add(
        self, new: Sequence[NewEntry], failures: Sequence[Failure] = ()
    ) -> list[Conflict | None]:
        """Enrol impressions and record failures, in one transaction; return conflicts.

        The conflicts are as of `find_conflicts`: None for an impression that is enrolled now. An
        impression that is refused becomes a failure; one that is enrolled, now or before, is a
        failure no longer. A new failure replaces those of the same source.
        """
        reasons = {failure.source: failure.reason for failure in failures}
        with self.changing() as connection:
            conflicts = find_conflicts(connection, new)
            sealing, rows = self.sealing(connection), []
            for entry, conflict in zip(new, conflicts, strict=True):
                if conflict is None:
                    row = to_row(entry) if sealing is None else sealing.seal_row(to_row(entry))
                    rows.append(row | {"digest": row_digest(row)})
                elif conflict != ENROLLED:
                    reasons[entry.source] = str(conflict)
            for part in parts([*(entry.source for entry in new), *reasons]):
                connection.execute(FAILURE.delete().where(FAILURE.c.source.in_(part)))
            if reasons:
                failed = [{"source": s, "reason": r} for s, r in reasons.items()]
                connection.execute(FAILURE.insert(), failed)
            if rows:
                connection.execute(ENTRY.insert(), rows)
                self._mark_changed(connection)
            if rows or reasons:
                labels = audit.labels_of(connection, contents=[row["content"] for row in rows])
                audit.record(connection, "enrol", entries=labels, failed=len(reasons))
        return conflicts

    def clear_failures(self) -> int:
        """Remove all failures; return how many there were."""
        with self.changing() as connection:
            cleared = connection.execute(FAILURE.delete()).rowcount
            audit.record(connection, "clear failures", count=cleared)
        return cleared

    def remove(self, numbers: Collection[int]) -> int:
        """Remove entries by their numbers; return how many.

        Nothing of them is left in the file, nor in the index on this machine; what is not
        in a file, as blocks of the disk and backups, is not reached, nor is a server's storage. If
        one of the numbers is unknown, none is removed: GalleryError (code "unknown"). If traces may
        be left, GalleryError (code "traces") is raised after the removal.
        """
        removed = set(numbers)
        if not removed:
            return 0
        with self.changing() as connection:
            labels = audit.labels_of(connection, numbers=removed)
            for number in removed:
                if not connection.execute(ENTRY.delete().where(ENTRY.c.id == number)).rowcount:
                    raise self._unknown(number)
            self._mark_changed(connection)
            audit.record(connection, "remove", entries=labels)
        for number in removed & self.damaged.keys():
            del self.damaged[number]
        self.erase(removed)
        return len(removed)

    def keeps_audit(self) -> bool:
        """Return whether events are recorded now."""
        with self.reading() as connection:
            return audit.is_on(connection)

    def record(self, action: str, *, probe: bytes | str | None = None, **details: Any) -> None:
        """Append an event to the audit of this gallery, if it keeps one.

        Changes append theirs themselves. Of a probe the event contains the SHA-256: it is given in
        hexadecimal, or computed from the content. Raises GalleryError if the event cannot be
        stored: what it states must not happen then.
        """
        if not self.keeps_audit():
            return
        if probe is not None:
            digest = probe if isinstance(probe, str) else hashlib.sha256(probe).hexdigest()
            details = {"probe": digest, **details}
        try:
            with self.changing() as connection:
                audit.record(connection, action, **details)
        except GalleryError as error:
            why = f"its audit cannot store the event: {error.detail}"
            raise self.error(why, error.code) from error

    def count(self, query: sa.Select[Any]) -> int:
        """Return the number that a query selects; 0 for none."""
        with self.reading() as connection:
            return int(connection.scalar(query) or 0)

    def _mark_changed(self, connection: sa.Connection) -> None:
        connection.execute(GALLERY.update().values(state=secrets.token_hex(16)))

    def _whole_rows(
        self, convert: Callable[[Any], Converted], *, of: Collection[int] | None
    ) -> Iterator[Converted]:
        """Yield what is made of rows of all columns, unsealed; damaged ones are skipped."""
        chosen = [WHOLE] if of is None else [WHOLE.where(ENTRY.c.id.in_(p)) for p in parts(of)]
        for query in chosen:
            yield from self._rows(query, convert, whole=True)

    def _rows(
        self, query: sa.Select[Any], convert: Callable[[Any], Converted], *, whole: bool = False
    ) -> Iterator[Converted]:
        """Yield what is made of rows by number; damaged ones are skipped."""
        for rows, sealing in self.pages(query, ENTRY.c.id):
            for row in rows:
                try:
                    converted = convert(self._opened(row, sealing) if whole else row)
                except DamagedRowError as error:
                    self.damaged[row.id] = error.why
                    continue
                yield converted

    def _opened(self, row: Any, sealing: Sealing | None) -> Any:
        """Return a row of all columns with the template as it was packed."""
        check_row(row)
        if sealing is None:
            return row
        with self.naming_errors():
            return sealing.unseal_row(row)

    def _one(self, number: int, chosen: Iterator[Converted]) -> Converted:
        """Return the only one that was chosen by a number, or raise GalleryError."""
        for one in chosen:
            return one
        raise self._damage(number) if number in self.damaged else self._unknown(number)

    def _damage(self, number: int) -> GalleryError:
        return self.error(f"damaged: entry {number}: {self.damaged[number]}", "damaged")

    def _unknown(self, number: int) -> GalleryError:
        return self.error(f"no entry has the number {number}", "unknown")


def _is_of(subject: str) -> sa.ColumnElement[bool]:
    return ENTRY.c.subject.in_({as_text(subject), printable(subject)})
