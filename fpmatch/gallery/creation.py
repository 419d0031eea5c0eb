"""Check that a database holds a gallery, or make an empty one in it."""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING

import sqlalchemy as sa

from fpmatch.gallery.store.database import mark_overwritten
from fpmatch.gallery.store.history import keep_history
from fpmatch.gallery.store.sealing import ENCRYPTED_VERSION, create_sealing
from fpmatch.gallery.store.tables import GALLERY, VERSION, create_tables

if TYPE_CHECKING:
    from fpmatch.gallery.store.sealed_database import SealedDatabase


def check_or_create(gallery: SealedDatabase, *, create: bool, encrypt: bool) -> None:
    """Check that there is a gallery of a known version, or make an empty one.

    One that is made to `encrypt` is encrypted with the current key; another must be encrypted.
    """
    with gallery.reading() as connection:
        tables = set(sa.inspect(connection).get_table_names())
    if GALLERY.name not in tables:
        if tables and gallery.file is not None:
            raise gallery.error("not a gallery but a database of something else", "no gallery")
        if not create:
            raise gallery.error("holds no gallery; `fpmatch enrol` makes one", "missing")
        with gallery.creating() as connection:
            if not sa.inspect(connection).has_table(GALLERY.name):  # made meanwhile by another
                create_tables(connection, secrets.token_hex(16))
                keep_history(connection)
                mark_overwritten(connection)
                if encrypt:
                    create_sealing(connection, (gallery.current_key(),))
                    connection.execute(GALLERY.update().values(version=ENCRYPTED_VERSION))
    with gallery.reading() as connection:
        version = connection.scalar(sa.select(GALLERY.c.version))
    if version is None:
        raise gallery.error("damaged: its version is missing", "damaged")
    if version not in {VERSION, ENCRYPTED_VERSION}:
        raise gallery.error(
            f"a gallery of version {version}; this fpmatch reads versions {VERSION} and "
            f"{ENCRYPTED_VERSION}",
            "version",
        )
    if encrypt and version == VERSION:
        why = "is not encrypted; `fpmatch gallery rotate` encrypts it"
        raise gallery.error(why, "not encrypted")
