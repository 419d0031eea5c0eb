"""A gallery: enrolled templates in a database, safe against kills and concurrent writers."""

from __future__ import annotations

import hashlib
import secrets
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from fpmatch.errors import GalleryError
from fpmatch.gallery.listing.entry import EnrolmentRequest, Entry, Failure, PackedEntry
from fpmatch.gallery.store import audit
from fpmatch.gallery.store.reader import GalleryReader
from fpmatch.gallery.store.rows import pack_entry, to_row
from fpmatch.gallery.store.sealed_database import as_keys, check_or_create
from fpmatch.gallery.store.tables import (
    ENROLLED,
    ENTRY,
    FAILURE,
    GALLERY,
    Conflict,
    Conflicts,
    parts,
)

if TYPE_CHECKING:
    import os
    from collections.abc import Collection, Iterator, Sequence
    from pathlib import Path

    import sqlalchemy as sa

    from fpmatch.gallery.encryption.keys import KeyRing
    from fpmatch.gallery.listing.entry import NewEntry


def open_gallery(
    where: str | os.PathLike[str],
    *,
    create: bool = False,
    key: KeyRing | str | None = None,
    encrypt: bool = False,
    patience: float | None = None,
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
        Keys of an encrypted gallery, or their source, as for
        `fpmatch.gallery.encryption.keys.load_keys` (default: that in the environment). They are
        read when they are needed first.
    encrypt : bool
        Whether one that is made is encrypted with the current key, and another must be encrypted.
    patience : float, optional
        Seconds that a call may wait for a file that another program holds, or for a silent server
        (default: 60).

    Raises
    ------
    GalleryError
        If it is missing, no gallery, damaged, of another version, or cannot be reached.
    EncryptionError
        If there is no key for a gallery to be made.
    """
    if encrypt:
        as_keys(key)  # before a file is made
    gallery = Gallery(where, create=create, key=key, patience=patience)
    try:
        check_or_create(gallery, create=create, encrypt=encrypt)
        gallery.sealing()
    except BaseException:
        gallery.close()
        raise
    return gallery


class Gallery(GalleryReader):
    """A database of enrolled impressions; `open_gallery` opens one.

    Every method is one transaction, or one for some thousand rows where it yields: a killed
    program leaves nothing half-written, and two may enrol at the same time. Methods raise
    GalleryError where the database cannot be read or written.
    """

    def find_conflicts(self, requests: Sequence[EnrolmentRequest]) -> list[Conflict | None]:
        """Return for each print None if it can be enrolled, `ENROLLED`, or why it cannot."""
        with self.reading() as connection:
            conflicts = Conflicts(connection, requests)
        return [conflicts.find(request) for request in requests]

    def add(
        self, new: Sequence[NewEntry], failures: Sequence[Failure] = ()
    ) -> list[Conflict | None]:
        """Enrol impressions and record failures, in one transaction; return conflicts.

        The conflicts are as of `find_conflicts`: None for an impression that is enrolled now. An
        impression that is refused becomes a failure; one that is enrolled, now or before, is a
        failure no longer. A new failure replaces those of the same source.
        """
        return self.add_packed([pack_entry(entry) for entry in new], failures)

    def add_packed(
        self, new: Sequence[PackedEntry | Failure], failures: Sequence[Failure] = ()
    ) -> list[Conflict | None]:
        """Enrol impressions whose templates are packed and checked, as `add` does.

        Those that cannot be stored are given as failures in their place.
        """
        with self.changing() as connection:
            conflicts = _conflicts_in_order(connection, new)
            judged = list(zip(new, conflicts, strict=True))
            enrolled = [to_row(e) for e, no in judged if no is None and isinstance(e, PackedEntry)]
            rows = self.sealed(connection, enrolled)
            sources = [*(e.source for e in new), *(f.source for f in failures)]
            for part in parts(sources):
                connection.execute(FAILURE.delete().where(FAILURE.c.source.in_(part)))
            reasons = {failure.source: failure.reason for failure in failures}
            refused = [(entry, no) for entry, no in judged if no is not None and no != ENROLLED]
            reasons |= {entry.source: str(conflict) for entry, conflict in refused}
            if reasons:
                connection.execute(
                    FAILURE.insert(), [{"source": s, "reason": r} for s, r in reasons.items()]
                )
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
        from fpmatch.gallery.erasure import erase_traces  # noqa: PLC0415  (imports matchers)

        with self.changing() as connection:
            labels = audit.labels_of(connection, numbers=numbers)
            for number in dict.fromkeys(numbers):
                if not connection.execute(ENTRY.delete().where(ENTRY.c.id == number)).rowcount:
                    raise self.unknown(number)
            if numbers:
                self._mark_changed(connection)
                audit.record(connection, "remove", entries=labels)
        for number in set(numbers) & self.damaged.keys():
            del self.damaged[number]
        if numbers:
            erase_traces(self, set(numbers))
        return len(set(numbers))

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

    @contextmanager
    def changing(self) -> Iterator[sa.Connection]:
        """Open a transaction during which no other one writes."""
        with self.writing() as connection:
            audit.lock(connection)
            yield connection

    def _mark_changed(self, connection: sa.Connection) -> None:
        connection.execute(GALLERY.update().values(state=secrets.token_hex(16)))


def _conflicts_in_order(
    connection: sa.Connection, new: Sequence[PackedEntry | Failure]
) -> list[Conflict | None]:
    """Return the conflict of each impression with what is enrolled and with those before it."""
    packed = [entry for entry in new if isinstance(entry, PackedEntry)]
    requests = [EnrolmentRequest(e.label, e.content, e.dpi) for e in packed]
    known, left = Conflicts(connection, requests), iter(requests)
    conflicts: list[Conflict | None] = []
    for entry in new:
        if isinstance(entry, Failure):
            conflicts.append(Conflict(entry.reason))
            continue
        conflicts.append(known.find(next(left)))
        if conflicts[-1] is None:
            known.add(Entry(0, entry.label, entry.source, entry.content, entry.dpi, 0))
    return conflicts
