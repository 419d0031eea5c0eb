"""A gallery: enrolled templates in a database, safe against kills and against each other."""

from __future__ import annotations

import hashlib
import secrets
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TypeVar

import sqlalchemy as sa

from fpmatch.errors import GalleryError, TemplateError
from fpmatch.gallery.compact import pack_template, unpack_entry
from fpmatch.gallery.duplicates import Claim, Enrolled, as_entry
from fpmatch.gallery.entry import Entry, Failure
from fpmatch.gallery.place import DamagedRowError, DatabaseUrl
from fpmatch.gallery.tables import ABOUT, ENTRY, FAILURE, GALLERY, VERSION, create_tables

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Collection, Iterator, Sequence
    from types import TracebackType
    from typing import Self

    from fpmatch.gallery.entry import NewEntry
    from fpmatch.minutiae import Template

Converted = TypeVar("Converted")

ROWS_PER_READ: Final = 1000


def open_gallery(where: str | os.PathLike[str], *, create: bool = False) -> Gallery:
    """Open a gallery.

    Parameters
    ----------
    where : str or path-like
        A SQLite file, or the URL of a PostgreSQL database,
        ``postgresql://user:password@host:port/database`` (extra ``fpmatch[postgres]``).
    create : bool
        Make it where it is missing.

    Returns
    -------
    Gallery
        A context manager that closes it.

    Raises
    ------
    GalleryError
        If it is missing, no gallery, damaged, of another version, or cannot be reached.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open_gallery(Path(folder, "gallery.db"), create=True) as gallery:
    ...         len(gallery)
    0
    """
    place = DatabaseUrl(where, create=create)
    try:
        _check_or_create(place, create=create)
    except BaseException:
        place.close()
        raise
    return Gallery(place)


class Gallery:
    """Enrolled impressions; `open_gallery` opens one.

    Every method is a transaction of its own or, where it yields, one for some thousand rows:
    nothing is left half-written by a killed program, and two may enrol at once.
    """

    def __init__(self, place: DatabaseUrl) -> None:
        self._place = place

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the database."""
        self._place.close()

    @property
    def name(self) -> str:
        """The file, or the URL without its password."""
        return self._place.name

    @property
    def place(self) -> DatabaseUrl:
        """Where it lies."""
        return self._place

    def __len__(self) -> int:
        """Return the number of impressions."""
        with self._place.reading() as connection:
            return int(connection.scalar(sa.select(sa.func.count()).select_from(ENTRY)) or 0)

    def find_conflicts(self, claims: Sequence[Claim]) -> list[str | None]:
        """Tell what speaks against enrolling some prints.

        Parameters
        ----------
        claims : sequence of Claim
            What they would be enrolled as.

        Returns
        -------
        list of str or None
            For each, None where nothing does; "" where it is enrolled already; else the reason,
            in words.
        """
        with self._place.reading() as connection:
            enrolled = Enrolled.among(connection, claims)
        return [enrolled.objection(claim) for claim in claims]

    def add(self, new: Sequence[NewEntry], failures: Sequence[Failure] = ()) -> list[str | None]:
        """Enrol impressions, and keep what failed, all at once.

        Parameters
        ----------
        new : sequence of NewEntry
            What to enrol. One that is refused is kept as a failure; one that is enrolled, or was
            before, is a failure no longer.
        failures : sequence of Failure
            What could not be enrolled; replaces what was kept of the same source.

        Returns
        -------
        list of str or None
            For each what `find_conflicts` says of it: None where it is enrolled now.

        Raises
        ------
        GalleryError
            If the gallery cannot be written; then nothing of it all is.
        """
        packed = [_pack(entry) for entry in new]
        with self._changing() as connection:
            find_conflicts = _judge(connection, new, packed)
            judged = list(zip(new, packed, find_conflicts, strict=True))
            rows = [{**_row(c), "template": template} for c, template, no in judged if no is None]
            refused = [Failure(c.source, reason) for c, _, reason in judged if reason]
            sources = [*(c.source for c in new), *(f.source for f in failures)]
            for k in range(0, len(sources), ROWS_PER_READ):
                part = sources[k : k + ROWS_PER_READ]
                connection.execute(FAILURE.delete().where(FAILURE.c.source.in_(part)))
            reasons = {f.source: f.reason for f in (*failures, *refused)}
            if reasons:
                connection.execute(
                    FAILURE.insert(), [{"source": s, "reason": r} for s, r in reasons.items()]
                )
            if rows:
                connection.execute(ENTRY.insert(), rows)
                _mark_changed(connection)
        return find_conflicts

    def entries(self, *, subject: str | None = None) -> Iterator[Entry]:
        """Yield the entries, in the order of their numbers; those of one subject if it is given."""
        query = sa.select(*ABOUT)
        if subject is not None:
            query = query.where(ENTRY.c.subject == subject)
        yield from self._rows(query, as_entry)

    def entry(self, number: int) -> Entry:
        """Return the entry of a number.

        Raises
        ------
        GalleryError
            If there is none.
        """
        with self._place.reading() as connection:
            row = connection.execute(sa.select(*ABOUT).where(ENTRY.c.id == number)).first()
            if row is None:
                raise GalleryError(f"{self.name}: no entry has the number {number}")
            return as_entry(row)

    def template(self, number: int) -> Template:
        """Return the template of the entry of a number.

        Raises
        ------
        GalleryError
            If there is none, or it is damaged.
        """
        query = sa.select(ENTRY.c.id, ENTRY.c.template).where(ENTRY.c.id == number)
        with self._place.reading() as connection:
            row = connection.execute(query).first()
            if row is None:
                raise GalleryError(f"{self.name}: no entry has the number {number}")
            found, data = _packed(row)
        return unpack_entry(data, found, self.name)

    def packed_templates(self, *, after: int = 0) -> Iterator[tuple[int, bytes]]:
        """Yield number and packed template of the entries whose number is greater than `after`."""
        query = sa.select(ENTRY.c.id, ENTRY.c.template)
        yield from self._rows(query, _packed, after=after)

    def templates(self, *, after: int = 0) -> Iterator[tuple[int, Template]]:
        """Yield number and template of the entries, in the order of their numbers.

        Raises
        ------
        GalleryError
            If a template is damaged.
        """
        for number, data in self.packed_templates(after=after):
            yield number, unpack_entry(data, number, self.name)

    def fingers(self) -> dict[int, int]:
        """Return by the number of each entry the lowest of the entries of the same finger.

        A finger is what entries of one subject and one finger's name show.
        """
        same = [ENTRY.c.subject, ENTRY.c.finger]
        query = sa.select(ENTRY.c.id, sa.func.min(ENTRY.c.id).over(partition_by=same))
        with self._place.reading() as connection:
            return {int(row[0]): int(row[1]) for row in connection.execute(query)}

    def failures(self) -> list[Failure]:
        """Return what could not be enrolled, by source."""
        with self._place.reading() as connection:
            rows = connection.execute(sa.select(FAILURE).order_by(FAILURE.c.source)).all()
        return [Failure(row.source, row.reason) for row in rows]

    def forget_failures(self) -> int:
        """Remove the list of what could not be enrolled; return how many there were."""
        with self._changing() as connection:
            return connection.execute(FAILURE.delete()).rowcount

    def remove(self, numbers: Collection[int]) -> int:
        """Remove entries.

        Parameters
        ----------
        numbers : collection of int
            Their numbers.

        Returns
        -------
        int
            How many there were.

        Raises
        ------
        GalleryError
            If there is no entry of one of the numbers; then none is removed.
        """
        with self._changing() as connection:
            for number in dict.fromkeys(numbers):
                if not connection.execute(ENTRY.delete().where(ENTRY.c.id == number)).rowcount:
                    raise GalleryError(f"{self.name}: no entry has the number {number}")
            if numbers:
                _mark_changed(connection)
        return len(set(numbers))

    def content_hash(self) -> str:
        """Return a word that is another one whenever the entries have changed."""
        with self._place.reading() as connection:
            state = connection.scalar(sa.select(GALLERY.c.state))
            count, last = connection.execute(
                sa.select(sa.func.count(), sa.func.max(ENTRY.c.id)).select_from(ENTRY)
            ).one()
        return hashlib.sha256(f"{state} {count} {last}".encode()).hexdigest()[:32]

    def _rows(
        self, query: sa.Select[Any], convert: Callable[[Any], Converted], *, after: int = 0
    ) -> Iterator[Converted]:
        """Yield rows by number, in transactions short enough to keep nobody waiting."""
        query = query.order_by(ENTRY.c.id).limit(ROWS_PER_READ)
        while True:
            with self._place.reading() as connection:
                rows = connection.execute(query.where(ENTRY.c.id > after)).all()
                converted = [convert(row) for row in rows]
            yield from converted
            if len(rows) < ROWS_PER_READ:
                return
            after = rows[-1].id

    @contextmanager
    def _changing(self) -> Iterator[sa.Connection]:
        """Open a transaction that writes while no other does."""
        with self._place.writing() as connection:
            connection.execute(sa.select(GALLERY.c.id).with_for_update())
            yield connection


def _check_or_create(place: DatabaseUrl, *, create: bool) -> None:
    """Check that there is a gallery of this version, or make an empty one."""
    with place.reading() as connection:
        tables = set(sa.inspect(connection).get_table_names())
    if GALLERY.name not in tables:
        if tables and place.file is not None:
            raise GalleryError(f"{place.name}: not a gallery but a database of something else")
        if not create:
            raise GalleryError(f"{place.name}: holds no gallery; `fpmatch enrol` makes one")
        with place.creating() as connection:
            if not sa.inspect(connection).has_table(GALLERY.name):  # nor has somebody made it since
                create_tables(connection, secrets.token_hex(16))
    with place.reading() as connection:
        version = connection.scalar(sa.select(GALLERY.c.version))
    if version is None:
        raise GalleryError(f"{place.name}: damaged: it does not tell its version")
    if version != VERSION:
        raise GalleryError(
            f"{place.name}: a gallery of version {version}; this fpmatch reads version {VERSION}"
        )


def _mark_changed(connection: sa.Connection) -> None:
    connection.execute(GALLERY.update().values(state=secrets.token_hex(16)))


def _judge(
    connection: sa.Connection, new: Sequence[NewEntry], packed: Sequence[bytes | str]
) -> list[str | None]:
    """Return what speaks against each, one after the other."""
    claims = [Claim(c.label, c.content, c.template.dpi) for c in new]
    enrolled = Enrolled.among(connection, claims)
    find_conflicts = []
    for entry, template, claim in zip(new, packed, claims, strict=True):
        objection = template if isinstance(template, str) else enrolled.objection(claim)
        if objection is None:
            enrolled.note(Entry(id=0, **_described(entry)))
        find_conflicts.append(objection)
    return find_conflicts


def _packed(row: Any) -> tuple[int, bytes]:
    """Return the number and the packed template of a row."""
    if not (isinstance(row.id, int) and isinstance(row.template, bytes)):
        raise DamagedRowError(f"entry {row.id} has no template")
    return row.id, row.template


def _pack(entry: NewEntry) -> bytes | str:
    """Return the packed template, or why there is none."""
    try:
        return pack_template(entry.template)
    except TemplateError as error:
        return str(error)


def _described(entry: NewEntry) -> dict[str, Any]:
    """Return what an entry says of a new entry, but for its number."""
    return {
        "label": entry.label,
        "source": entry.source,
        "content": entry.content,
        "dpi": entry.template.dpi,
        "minutiae": len(entry.template.minutiae),
    }


def _row(entry: NewEntry) -> dict[str, Any]:
    """Return a new entry as a row, but for its template."""
    described = _described(entry)
    label = described.pop("label")
    return {
        **described,
        "subject": label.subject,
        "finger": label.finger,
        "impression": label.impression,
    }
