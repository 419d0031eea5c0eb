"""Reading of a gallery: entries, templates and counts; damaged entries are skipped."""

from __future__ import annotations

import hashlib
from collections import deque
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
import sqlalchemy as sa

from fpmatch.errors import GalleryError
from fpmatch.gallery.listing.entry import Failure, GallerySummary
from fpmatch.gallery.store.database import DamagedRowError
from fpmatch.gallery.store.digests import check_row
from fpmatch.gallery.store.rows import as_entry, as_packed, as_packed_entry, as_template
from fpmatch.gallery.store.sealed_database import SealedDatabase
from fpmatch.gallery.store.stored_template import stored_minutiae_digest
from fpmatch.gallery.store.tables import ABOUT, ENTRY, FAILURE, GALLERY, WHOLE, is_sound, parts
from fpmatch.printable import as_text, printable

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence
    from typing import Self

    from numpy.typing import NDArray

    from fpmatch.gallery.listing.entry import Entry, PackedEntry
    from fpmatch.templates.minutiae import Template

Converted = TypeVar("Converted")

ROWS_PER_READ: Final = 1000
_COUNT: Final = sa.select(sa.func.count())


class GalleryReader(SealedDatabase):
    """Read a gallery in transactions short enough to block no one for long.

    Methods raise GalleryError where the database cannot be read. Those that yield skip entries that
    are damaged; `damaged` has the reason of each, by its number.
    """

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Gallery({self.name!r})"

    def __len__(self) -> int:
        """Return the number of impressions."""
        with self.reading() as connection:
            return int(connection.scalar(_COUNT.select_from(ENTRY)) or 0)

    def has_over(self, count: int) -> bool:
        """Return whether there are more than some impressions, in a time that grows with these."""
        some = sa.select(sa.literal(1)).select_from(ENTRY).limit(count + 1).subquery()
        with self.reading() as connection:
            return int(connection.scalar(_COUNT.select_from(some)) or 0) > count

    def summary(self) -> GallerySummary:
        """Count what is in the gallery."""
        of_dpi = sa.select(ENTRY.c.dpi, sa.func.count()).group_by(ENTRY.c.dpi).order_by(ENTRY.c.dpi)
        totals = sa.select(
            sa.func.count(),
            sa.func.count(ENTRY.c.subject.distinct()),
            sa.func.coalesce(sa.func.sum(ENTRY.c.minutiae), 0),
            sa.func.coalesce(sa.func.sum(sa.func.length(ENTRY.c.template)), 0),
        ).select_from(ENTRY)
        with self.reading() as connection:
            sealing = self.sealing(connection)
            sound = is_sound(connection.dialect.name)
            version = int(connection.scalar(sa.select(GALLERY.c.version)) or 0)
            impressions, subjects, minutiae, size = map(
                int, connection.execute(totals.where(sound)).one()
            )
            damaged = int(connection.scalar(_COUNT.select_from(ENTRY)) or 0) - impressions
            by_dpi = {float(dpi): count for dpi, count in connection.execute(of_dpi.where(sound))}
            failures = int(connection.scalar(_COUNT.select_from(FAILURE)) or 0)
        sizes = impressions, subjects, minutiae, size, by_dpi
        keys = () if sealing is None else sealing.keys
        return GallerySummary(version, *sizes, failures, damaged, keys)

    def entries(self, *, subject: str | None = None) -> Iterator[Entry]:
        """Yield the entries, or those of one subject, by ascending number.

        A subject from the name of a file may be given as in that name, or as it is printed.
        """
        query = sa.select(*ABOUT)
        if subject is not None:
            query = query.where(_is_of(subject))
        yield from self._rows(query, as_entry)

    def numbers_of(self, subject: str) -> list[int]:
        """Return the numbers of a subject's entries; GalleryError (code "unknown") if none."""
        query = sa.select(ENTRY.c.id).where(_is_of(subject)).order_by(ENTRY.c.id)
        with self.reading() as connection:
            numbers = list(connection.scalars(query))
        if not numbers:
            raise self.error(f"no impression of subject {subject}", "unknown")
        return numbers

    def contents_of(self, subjects: Collection[str]) -> list[tuple[int, str, bytes]]:
        """Return number, subject and content of the entries of some subjects, by number."""
        query = sa.select(ENTRY.c.id, ENTRY.c.subject, ENTRY.c.content)
        with self.reading() as connection:
            rows = connection.execute(query.where(ENTRY.c.subject.in_(subjects))).all()
        return sorted((row.id, row.subject, row.content) for row in rows)

    def enrolled_contents(self, contents: Collection[bytes]) -> set[bytes]:
        """Return those of some contents that entries have."""
        query, enrolled = sa.select(ENTRY.c.content), set[bytes]()
        for part in parts(contents):
            with self.reading() as connection:
                enrolled.update(connection.scalars(query.where(ENTRY.c.content.in_(part))))
        return enrolled

    def subjects(self) -> int:
        """Return the number of subjects."""
        query = sa.select(sa.func.count(ENTRY.c.subject.distinct())).select_from(ENTRY)
        with self.reading() as connection:
            return int(connection.scalar(query) or 0)

    def digests(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the numbers of all entries, ascending, and their digests; -1 for a missing one."""
        digest = sa.func.coalesce(sa.cast(ENTRY.c.digest, sa.BigInteger), -1)
        with self.reading() as connection:
            rows = connection.execute(sa.select(ENTRY.c.id, digest).order_by(ENTRY.c.id)).all()
        numbers, digests = np.array([tuple(row) for row in rows], np.int64).reshape(-1, 2).T
        return numbers, digests

    def count_fingers(self) -> int:
        """Return the number of fingers."""
        fingers = sa.select(ENTRY.c.subject, ENTRY.c.finger).distinct().subquery()
        with self.reading() as connection:
            return int(connection.scalar(_COUNT.select_from(fingers)) or 0)

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

    def entries_of(self, numbers: Collection[int]) -> Iterator[Entry]:
        """Yield the entries of some numbers; numbers without one, and damaged ones, are skipped."""
        for some in parts(numbers):
            yield from self._whole_rows(as_entry, where=ENTRY.c.id.in_(some))

    def entry(self, number: int) -> Entry:
        """Return the entry of a number; GalleryError (code "unknown") if there is none."""
        return self._one(WHOLE, number, lambda row: as_entry(self.opened(row)))

    def template(self, number: int) -> Template:
        """Return the template of an entry; GalleryError if there is none or it is damaged."""
        return self._one(WHOLE, number, lambda row: as_template(self.opened(row)))[1]

    def find_entry(self, number: int) -> Entry | None:
        """Return the entry of a number; None for one that is damaged, which is skipped."""
        return self._unless_damaged(self.entry, number)

    def find_template(self, number: int) -> Template | None:
        """Return the template of an entry; None for one that is damaged, which is skipped."""
        return self._unless_damaged(self.template, number)

    def _whole_rows(
        self,
        convert: Callable[[Any], Converted],
        *,
        after: int | None = None,
        where: sa.ColumnElement[bool] | None = None,
    ) -> Iterator[Converted]:
        """Yield what is made of rows of all columns, opened; damaged ones are skipped."""
        query = WHOLE if where is None else WHOLE.where(where)
        return self._rows(query, lambda row: convert(self.opened(row)), after=after)

    def packed_templates(
        self, *, after: int | None = None, of: Collection[int] | None = None
    ) -> Iterator[tuple[int, bytes]]:
        """Yield number and packed template of all entries, or of those of numbers over `after`.

        With `of`, only entries with these numbers are read; numbers without an entry are skipped.
        """
        if of is None:
            yield from self._whole_rows(as_packed, after=after)
        for some in parts(of or ()):
            yield from self._whole_rows(as_packed, where=ENTRY.c.id.in_(some))

    def templates(self, *, after: int | None = None) -> Iterator[tuple[int, Template]]:
        """Yield number and template of all entries, or of those of numbers over `after`."""
        return self._whole_rows(as_template, after=after)

    def minutiae_digests(self, counts: Collection[int]) -> Iterator[tuple[int, bytes]]:
        """Yield number and digest of the minutiae of the entries with some numbers of minutiae."""
        for number, data in self._whole_rows(as_packed, where=ENTRY.c.minutiae.in_(counts)):
            yield number, stored_minutiae_digest(data)

    def packed_entries(self) -> Iterator[tuple[int, PackedEntry]]:
        """Yield number and content of all entries; each template was read once to check it."""
        return self._whole_rows(lambda row: (row.id, as_packed_entry(row)))

    def failures(self) -> list[Failure]:
        """Return what could not be enrolled, by source."""
        with self.reading() as connection:
            rows = connection.execute(sa.select(FAILURE).order_by(FAILURE.c.source)).all()
        return [Failure(str(row.source), str(row.reason)) for row in rows]

    def content_hash(self) -> str:
        """Return a hash that differs whenever fpmatch has changed the entries."""
        with self.reading() as connection:
            state = connection.scalar(sa.select(GALLERY.c.state))
            last = connection.scalar(sa.select(sa.func.max(ENTRY.c.id)))
        return hashlib.sha256(f"{state} {last}".encode()).hexdigest()[:32]

    def last_number(self) -> int:
        """Return the greatest number of an entry; 0 if there is none."""
        with self.reading() as connection:
            return connection.scalar(sa.select(sa.func.max(ENTRY.c.id))) or 0

    def check_rows(self) -> None:
        """Raise GalleryError (code "damaged") unless each entry is as it was enrolled."""
        deque(self._rows(WHOLE, check_row), maxlen=0)
        for number, why in self.damaged.items():
            raise self.error(f"damaged: entry {number}: {why}", "damaged")

    def unknown(self, number: int) -> GalleryError:
        """Return the error about a number that no entry has."""
        return self.error(f"no entry has the number {number}", "unknown")

    def _one(
        self, query: sa.Select[Any], number: int, convert: Callable[[Any], Converted]
    ) -> Converted:
        """Return the row of a number."""
        with self.reading() as connection:
            row = connection.execute(query.where(ENTRY.c.id == number)).first()
            if row is None:
                raise self.unknown(number)
            try:
                return convert(row)
            except DamagedRowError as error:
                self.damaged[number] = error.why
                raise

    def _unless_damaged(self, read: Callable[[int], Converted], number: int) -> Converted | None:
        try:
            return read(number)
        except GalleryError as error:
            if error.code != "damaged" or number not in self.damaged:
                raise
            return None

    def _rows(
        self,
        query: sa.Select[Any],
        convert: Callable[[Any], Converted],
        *,
        after: int | None = None,
    ) -> Iterator[Converted]:
        """Yield rows by number, in transactions short enough to block no one for long.

        Damaged ones are skipped.
        """
        query = query.order_by(ENTRY.c.id).limit(ROWS_PER_READ)
        while True:
            further = query if after is None else query.where(ENTRY.c.id > after)
            with self.reading() as connection:
                rows = connection.execute(further).all()
            for row in rows:
                if isinstance(row.id, int):
                    if after is not None and row.id <= after:
                        raise self.error("damaged: its entries are not in order", "damaged")
                    after = row.id
                try:
                    converted = convert(row)
                except DamagedRowError as error:
                    self.damaged[row.id] = error.why
                    continue
                yield converted
            if len(rows) < ROWS_PER_READ:
                return
            after = rows[-1].id


def _is_of(subject: str) -> sa.ColumnElement[bool]:
    return ENTRY.c.subject.in_({as_text(subject), printable(subject)})
