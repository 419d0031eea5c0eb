"""A gallery: enrolled templates in a database, safe against kills and concurrent writers."""

from __future__ import annotations

import hashlib
import secrets
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TypeVar

import sqlalchemy as sa

from fpmatch.errors import GalleryError
from fpmatch.gallery import audit
from fpmatch.gallery.creation import check_or_create
from fpmatch.gallery.database import DamagedRowError
from fpmatch.gallery.entry import EnrolmentRequest, Entry, Failure, GallerySummary
from fpmatch.gallery.rows import as_entry, as_packed, as_template, pack_entry, to_row
from fpmatch.gallery.sealed_database import SealedDatabase, as_keys
from fpmatch.gallery.tables import (
    ABOUT,
    ENTRY,
    FAILURE,
    GALLERY,
    PACKED,
    Conflicts,
    is_sound,
)
from fpmatch.printable import as_text, printable

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Collection, Iterator, Sequence
    from pathlib import Path
    from typing import Self

    from fpmatch.encryption.keys import KeyRing
    from fpmatch.gallery.entry import NewEntry
    from fpmatch.minutiae import Template

Converted = TypeVar("Converted")

ROWS_PER_READ: Final = 1000
_COUNT: Final = sa.select(sa.func.count())


def open_gallery(
    where: str | os.PathLike[str],
    *,
    create: bool = False,
    key: KeyRing | str | None = None,
    encrypt: bool = False,
) -> Gallery:
    """Open a gallery; as a context manager it is closed at the end.

    Parameters
    ----------
    where : str or path-like
        A SQLite file, or the URL of a PostgreSQL database,
        ``postgresql://user:password@host:port/database`` (extra ``fpmatch[postgres]``).
    create : bool
        Whether to make it where it is missing.
    key : KeyRing or str, optional
        Keys of an encrypted gallery, or their source, as for `fpmatch.encryption.keys.load_keys`
        (default: that in the environment). They are read when they are needed first.
    encrypt : bool
        Whether one that is made is encrypted with the current key, and another must be encrypted.

    Raises
    ------
    GalleryError
        If it is missing, no gallery, damaged, of another version, or cannot be reached.
    EncryptionError
        If there is no key for a gallery to be made.
    """
    if encrypt:
        as_keys(key)  # before a file is made
    gallery = Gallery(where, create=create, key=key)
    try:
        check_or_create(gallery, create=create, encrypt=encrypt)
        gallery.sealing()
    except BaseException:
        gallery.close()
        raise
    return gallery


class Gallery(SealedDatabase):
    """A database of enrolled impressions; `open_gallery` opens one.

    Every method is one transaction, or one for some thousand rows where it yields: a killed
    program leaves nothing half-written, and two may enrol at the same time. Methods raise
    GalleryError where the database cannot be read or written. Those that yield skip entries that
    are damaged; `damaged` has the reason of each, by its number.
    """

    def __init__(
        self,
        where: str | os.PathLike[str],
        *,
        create: bool = False,
        key: KeyRing | str | None = None,
    ) -> None:
        super().__init__(where, create=create, key=key)
        self.damaged: dict[int, str] = {}

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

    def find_conflicts(self, requests: Sequence[EnrolmentRequest]) -> list[str | None]:
        """Return for each print None if it can be enrolled, `ENROLLED`, or why it cannot."""
        with self.reading() as connection:
            conflicts = Conflicts(connection, requests)
        return [conflicts.find(request) for request in requests]

    def add(self, new: Sequence[NewEntry], failures: Sequence[Failure] = ()) -> list[str | None]:
        """Enrol impressions and record failures, in one transaction; return conflicts.

        The conflicts are as of `find_conflicts`: None for an impression that is enrolled now. An
        impression that is refused becomes a failure; one that is enrolled, now or before, is a
        failure no longer. A new failure replaces those of the same source.
        """
        packed = [pack_entry(entry) for entry in new]
        with self.changing() as connection:
            conflicts = _conflicts_in_order(connection, new, packed)
            judged = list(zip(new, packed, conflicts, strict=True))
            enrolled = [to_row(entry, template) for entry, template, no in judged if no is None]
            rows = self.sealed(connection, enrolled)
            sources = [*(e.source for e in new), *(f.source for f in failures)]
            for k in range(0, len(sources), ROWS_PER_READ):
                part = sources[k : k + ROWS_PER_READ]
                connection.execute(FAILURE.delete().where(FAILURE.c.source.in_(part)))
            reasons = {failure.source: failure.reason for failure in failures}
            reasons |= {entry.source: conflict for entry, _, conflict in judged if conflict}
            if reasons:
                connection.execute(
                    FAILURE.insert(), [{"source": s, "reason": r} for s, r in reasons.items()]
                )
            if rows:
                connection.execute(ENTRY.insert(), rows)
                _mark_changed(connection)
            if rows or reasons:
                labels = audit.labels_of(connection, contents=[row["content"] for row in rows])
                audit.record(connection, "enrol", entries=labels, failed=len(reasons))
        return conflicts

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

    def entry(self, number: int) -> Entry:
        """Return the entry of a number; GalleryError (code "unknown") if there is none."""
        if self.encrypted:  # what is shown is what was enrolled
            return self._one(PACKED, number, lambda row: as_entry(self.opened(row)))
        return self._one(sa.select(*ABOUT), number, as_entry)

    def template(self, number: int) -> Template:
        """Return the template of an entry; GalleryError if there is none or it is damaged."""
        return self._one(PACKED, number, lambda row: as_template(self.opened(row)))[1]

    def find_entry(self, number: int) -> Entry | None:
        """Return the entry of a number; None for one that is damaged, which is skipped."""
        return self._unless_damaged(self.entry, number)

    def find_template(self, number: int) -> Template | None:
        """Return the template of an entry; None for one that is damaged, which is skipped."""
        return self._unless_damaged(self.template, number)

    def packed_templates(self, *, after: int | None = None) -> Iterator[tuple[int, bytes]]:
        """Yield number and packed template of all entries, or of those of numbers over `after`."""
        yield from self._rows(PACKED, lambda row: as_packed(self.opened(row)), after=after)

    def templates(self, *, after: int | None = None) -> Iterator[tuple[int, Template]]:
        """Yield number and template of all entries, or of those of numbers over `after`."""
        yield from self._rows(PACKED, lambda row: as_template(self.opened(row)), after=after)

    def fingers(self) -> dict[int, int]:
        """Return for the number of each entry the lowest number of an entry of its finger."""
        finger = [ENTRY.c.subject, ENTRY.c.finger]
        query = sa.select(ENTRY.c.id, sa.func.min(ENTRY.c.id).over(partition_by=finger))
        with self.reading() as connection:
            return {int(row[0]): int(row[1]) for row in connection.execute(query)}

    def failures(self) -> list[Failure]:
        """Return what could not be enrolled, by source."""
        with self.reading() as connection:
            rows = connection.execute(sa.select(FAILURE).order_by(FAILURE.c.source)).all()
        return [Failure(str(row.source), str(row.reason)) for row in rows]

    def clear_failures(self) -> int:
        """Remove all failures; return how many there were."""
        with self.changing() as connection:
            cleared = connection.execute(FAILURE.delete()).rowcount
            audit.record(connection, "clear failures", count=cleared)
        return cleared

    def remove(self, numbers: Collection[int]) -> int:
        """Remove entries by their numbers; return how many.

        Nothing of them is left in the file, nor in prepared prints on this machine; what is not
        in a file, as blocks of the disk and backups, is not reached, nor is a server's storage. If
        one of the numbers is unknown, none is removed: GalleryError (code "unknown"). If traces may
        be left, GalleryError (code "traces") is raised after the removal.
        """
        from fpmatch.gallery.compaction import erase_traces  # noqa: PLC0415  (imports matchers)

        before = self.content_hash()
        with self.changing() as connection:
            labels = audit.labels_of(connection, numbers=numbers)
            for number in dict.fromkeys(numbers):
                if not connection.execute(ENTRY.delete().where(ENTRY.c.id == number)).rowcount:
                    raise self._unknown(number)
            if numbers:
                _mark_changed(connection)
                audit.record(connection, "remove", entries=labels)
        for number in set(numbers) & self.damaged.keys():
            del self.damaged[number]
        if numbers:
            erase_traces(self, before)
        return len(set(numbers))

    def content_hash(self) -> str:
        """Return a hash that differs whenever the entries have changed."""
        with self.reading() as connection:
            state = connection.scalar(sa.select(GALLERY.c.state))
            query = sa.select(sa.func.count(), sa.func.max(ENTRY.c.id)).select_from(ENTRY)
            count, last = connection.execute(query).one()
        return hashlib.sha256(f"{state} {count} {last}".encode()).hexdigest()[:32]

    def record(self, action: str, *, probe: Path | bytes | None = None, **details: Any) -> None:
        """Append an event to the audit of this gallery, if it keeps one.

        Changes append theirs themselves. Of a probe, given as file or content, the event contains
        the SHA-256. Raises GalleryError if the event cannot be stored: what it states must not
        happen then.
        """
        with self.reading() as connection:
            if not audit.is_on(connection):
                return
        if probe is not None:
            content = probe if isinstance(probe, bytes) else probe.read_bytes()
            details = {"probe": hashlib.sha256(content).hexdigest(), **details}
        try:
            with self.changing() as connection:
                audit.record(connection, action, **details)
        except GalleryError as error:
            why = f"its audit cannot store the event: {error.detail}"
            raise self.error(why, error.code) from error

    def _unknown(self, number: int) -> GalleryError:
        return self.error(f"no entry has the number {number}", "unknown")

    def _one(
        self, query: sa.Select[Any], number: int, convert: Callable[[Any], Converted]
    ) -> Converted:
        """Return the row of a number."""
        with self.reading() as connection:
            row = connection.execute(query.where(ENTRY.c.id == number)).first()
            if row is None:
                raise self._unknown(number)
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
                try:
                    converted = convert(row)
                except DamagedRowError as error:
                    self.damaged[row.id] = error.why
                    continue
                yield converted
            if len(rows) < ROWS_PER_READ:
                return
            after = rows[-1].id

    @contextmanager
    def changing(self) -> Iterator[sa.Connection]:
        """Open a transaction during which no other one writes."""
        with self.writing() as connection:
            audit.lock(connection)
            yield connection


def _is_of(subject: str) -> sa.ColumnElement[bool]:
    return ENTRY.c.subject.in_({as_text(subject), printable(subject)})


def _mark_changed(connection: sa.Connection) -> None:
    connection.execute(GALLERY.update().values(state=secrets.token_hex(16)))


def _conflicts_in_order(
    connection: sa.Connection, new: Sequence[NewEntry], packed: Sequence[bytes | str]
) -> list[str | None]:
    """Return the conflict of each impression with what is enrolled and with those before it."""
    requests = [EnrolmentRequest(e.label, e.content, e.template.dpi) for e in new]
    conflicts = Conflicts(connection, requests)
    found = []
    for entry, template, request in zip(new, packed, requests, strict=True):
        reason = template if isinstance(template, str) else conflicts.find(request)
        if reason is None:
            conflicts.add(Entry(0, entry.label, entry.source, entry.content, entry.template.dpi, 0))
        found.append(reason)
    return found
