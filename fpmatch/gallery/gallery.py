"""Galleries as programs use them: opened, encrypted, and cleared of traces and free space."""

from __future__ import annotations

import secrets
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from fpmatch.errors import FpmatchError
from fpmatch.gallery.encryption.keys import load_keys
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.store import audit
from fpmatch.gallery.store.gallery import Gallery
from fpmatch.gallery.store.kept_files import PREPARED, delete_files
from fpmatch.gallery.store.rows import check_row, row_digest
from fpmatch.gallery.store.sealing import set_key
from fpmatch.gallery.store.tables import (
    ENCRYPTED_VERSION,
    ENTRY,
    GALLERY,
    METADATA,
    TABLES,
    VERSION,
    WHOLE,
    DamagedRowError,
)

if TYPE_CHECKING:
    import os
    from collections.abc import Collection

    from fpmatch.gallery.encryption.keys import KeyRing

__all__ = ["Gallery", "open_gallery"]

_ROWS_PER_READ: Final = 500
_UPDATE: Final = (
    ENTRY.update()
    .where(ENTRY.c.id == sa.bindparam("row"))
    .values(template=sa.bindparam("own"), digest=sa.bindparam("of_own"))
)


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
        Seconds that a call may wait for a file that another program holds, or for a server
        (default: 60).

    Raises
    ------
    GalleryError
        If it is missing, no gallery, damaged, of another version, or cannot be reached.
    EncryptionError
        If there is no key for a gallery to be made.
    """
    key_id = load_keys(key).current.id if encrypt else ""  # before a file is made
    gallery = Gallery(where, create=create, key=key, patience=patience)
    gallery.erase = partial(_erase_traces, gallery)
    try:
        _check_or_create(gallery, create=create, key_id=key_id)
    except BaseException:
        gallery.close()
        raise
    return gallery


def rotate(gallery: Gallery, *, progress: Progress = no_progress) -> dict[str, Any]:
    """Seal all templates of a gallery with the current one of its keys.

    The gallery is open with the key in use, if it has one, and the new one. All is one transaction:
    other programs wait for its end, and one that is killed has changed nothing. Then the files of
    the gallery are rewritten without what they had before. `progress` is called with stage "rotate"
    and numbers of entries.

    Returns, as JSON values, the "key", the number of templates that were "sealed", and of entries
    that are "damaged" and were left as they are the "id" and the "reason". Raises GalleryError if a
    key is missing; EncryptionError if the source of the keys cannot be read.
    """
    total, sealed, after = len(gallery), 0, 0
    damaged: list[dict[str, Any]] = []
    with gallery.changing() as connection:
        target, before = load_keys(gallery.key).current.id, gallery.sealing(connection)
        assert before is None or before.key  # of which all templates are read
        set_key(connection, target)
        new = gallery.sealing(connection)
        assert new is not None
        query = WHOLE.order_by(ENTRY.c.id).limit(_ROWS_PER_READ)
        progress("rotate", 0, total)
        while new != before and (rows := connection.execute(query.where(ENTRY.c.id > after)).all()):
            changes = []
            for row in rows:
                try:
                    check_row(row)
                    columns = row._asdict() if before is None else vars(before.unseal_row(row))
                except DamagedRowError as error:
                    damaged.append({"id": row.id, "reason": error.why})
                    if before is None and row_digest(row._asdict()) >= 0:
                        # not left readable; its digest stays wrong
                        own = new.seal_row(row._asdict())["template"]
                        changes.append({"row": row.id, "own": own, "of_own": row.digest})
                    continue
                own = new.seal_row(columns)
                changes.append({"row": row.id, "own": own["template"], "of_own": row_digest(own)})
            if changes:
                connection.execute(_UPDATE, changes)
            sealed, after = sealed + len(changes), rows[-1].id
            progress("rotate", min(sealed, total), total)
        audit.record(connection, "rotate keys", key=target, damaged=len(damaged))
    gallery.vacuum()  # no free page or dead row contains what was before
    delete_files(gallery)
    progress("rotate", total, total)
    return {"key": target, "sealed": sealed, "damaged": damaged}


def free_space(gallery: Gallery) -> None:
    """Rewrite the database without free space, and the index without removed prints.

    On PostgreSQL, the tables of galleries are rewritten by ``VACUUM FULL``. Raises GalleryError if
    another program holds the gallery, the disk is full, or a file cannot be deleted; the gallery is
    as before.
    """
    gallery.record("compact")
    gallery.vacuum()
    _erase_removed(gallery)


def _erase_traces(gallery: Gallery, numbers: Collection[int]) -> None:
    """Erase what the index has of entries that were just removed, by their numbers.

    Raises GalleryError (code "traces") if its files cannot be changed.
    """
    try:
        _erase_removed(gallery, numbers)
    except FpmatchError as error:
        why = f"removed, but traces may be left: {error.detail or error}"
        remedy = "`fpmatch gallery rewrite` erases them"
        raise gallery.error(f"{why}; {remedy}", "traces") from error


def _erase_removed(gallery: Gallery, numbers: Collection[int] | None = None) -> None:
    """Write the index anew where it has removed prints, some or all, and delete what is outdated.

    Those are files of prepared prints, which version 0.2 made.
    """
    from fpmatch.gallery.index.follow import erase_removed  # noqa: PLC0415  (imports matchers)

    erase_removed(gallery, numbers)
    delete_files(gallery, PREPARED)


def _check_or_create(gallery: Gallery, *, create: bool, key_id: str) -> None:
    """Check that there is a gallery of a known version, or make an empty one.

    With the id of a key it is encrypted with that key; one that exists must be encrypted.
    """
    with gallery.reading() as connection:
        tables = set(sa.inspect(connection).get_table_names())
    if GALLERY.name not in tables:
        if tables and gallery.file is not None:
            raise gallery.error("not a gallery but a database of something else", "no gallery")
        if not create:
            raise gallery.error("holds no gallery; `fpmatch enrol` makes one", "missing")
        with gallery.changing() as connection:
            if not sa.inspect(connection).has_table(GALLERY.name):  # made meanwhile by another
                METADATA.create_all(connection, TABLES, checkfirst=False)
                state = secrets.token_hex(16)
                connection.execute(GALLERY.insert().values(id=1, version=VERSION, state=state))
                if key_id:
                    set_key(connection, key_id)
    with gallery.reading() as connection:
        version = connection.scalar(sa.select(GALLERY.c.version))
        gallery.sealing(connection)
    if version is None:
        raise gallery.error("damaged: its version is missing", "damaged")
    if version not in {VERSION, ENCRYPTED_VERSION}:
        known = f"this fpmatch reads versions {VERSION} and {ENCRYPTED_VERSION}"
        raise gallery.error(f"a gallery of version {version}; {known}", "version")
    if key_id and version == VERSION:
        why = "is not encrypted; `fpmatch gallery rewrite --encrypt` encrypts it"
        raise gallery.error(why, "not encrypted")
