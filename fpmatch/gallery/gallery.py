"""Galleries as commands and programs use them: opened, and cleared of traces and free space."""

from __future__ import annotations

import secrets
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

import sqlalchemy as sa

from fpmatch.errors import FpmatchError
from fpmatch.gallery.encryption.keys import load_keys
from fpmatch.gallery.store.gallery import Gallery
from fpmatch.gallery.store.kept_files import PREPARED, delete_files, kept_files, kept_folders
from fpmatch.gallery.store.sealing import set_key
from fpmatch.gallery.store.tables import ENCRYPTED_VERSION, GALLERY, METADATA, TABLES, VERSION

if TYPE_CHECKING:
    import os
    from collections.abc import Collection

    from fpmatch.gallery.encryption.keys import KeyRing

__all__ = ["Gallery", "open_gallery"]


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


def free_space(gallery: Gallery) -> dict[str, dict[str, int]]:
    """Rewrite the database without free space, and the index without removed prints.

    Returns their bytes "before" and "after", of the "database" and of the "prepared" index. On
    PostgreSQL, the tables of galleries are rewritten by ``VACUUM FULL``. Raises GalleryError if
    another program holds the gallery, the disk is full, or a file cannot be deleted; the gallery is
    as before.
    """
    database = {"before": gallery.size()}
    index = {"before": sum(path.stat().st_size for path in kept_files(gallery))}
    gallery.record("compact")
    gallery.vacuum()
    _erase_removed(gallery)
    database["after"] = gallery.size()
    index["after"] = sum(path.stat().st_size for path in kept_files(gallery))
    return {"database": database, "prepared": index}


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

    Those are files of prepared prints, which version 0.2 made, and empty folders.
    """
    from fpmatch.gallery.index.follow import erase_removed  # noqa: PLC0415  (imports matchers)

    erase_removed(gallery, numbers)
    delete_files(gallery, PREPARED)
    for folder in kept_folders(gallery):
        with suppress(OSError):
            folder.rmdir()


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
