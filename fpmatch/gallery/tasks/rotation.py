"""Encryption of all templates of a gallery with another key, or their decryption."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from fpmatch.gallery.encryption.records import is_sealed, key_id_of
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.gallery import current_key
from fpmatch.gallery.store import audit
from fpmatch.gallery.store.kept_files import delete_files
from fpmatch.gallery.store.rows import row_digest
from fpmatch.gallery.store.sealing import set_key, set_plain
from fpmatch.gallery.store.tables import ENTRY, WHOLE, DamagedRowError

if TYPE_CHECKING:
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.store.sealing import Sealing

PLAIN: Final = "plain"
_ROWS_PER_READ: Final = 500


@dataclass(frozen=True, slots=True)
class Rotation:
    """The number of templates that a rotation has sealed, and its key; "plain" for none.

    `damaged` has, by number, why an entry could not be read; it was left as it is.
    """

    key: str
    sealed: int
    damaged: dict[int, str]


def rotate(
    gallery: Gallery, *, decrypt: bool = False, progress: Progress = no_progress
) -> Rotation:
    """Seal all templates of a gallery, or `decrypt` them, with the current one of its keys.

    The gallery is open with the key in use and the new one. All is one transaction: other programs
    wait for its end, and one that is killed has changed nothing. Then the files of the gallery are
    rewritten without what they had before. `progress` is called with stage "rotate" and numbers of
    entries. Raises GalleryError if a key is missing; EncryptionError if the source of the keys
    cannot be read.
    """
    with gallery.naming_keys():
        target = PLAIN if decrypt else current_key(gallery.key)
        total, sealed, after = len(gallery), 0, 0
        damaged: dict[int, str] = {}
        progress("rotate", 0, total)
        with gallery.changing() as connection:
            before = gallery.sealing(connection)
            if before is not None:
                assert before.key  # of which all templates are read
            elif decrypt:
                raise gallery.error("is not encrypted", "not encrypted")
            if decrypt:
                set_plain(connection)
            else:
                set_key(connection, target)
            new = gallery.sealing(connection)
            query = WHOLE.order_by(ENTRY.c.id).limit(_ROWS_PER_READ)
            while rows := connection.execute(query.where(ENTRY.c.id > after)).all():
                changes = [
                    change for row in rows if (change := _sealed_anew(row, before, new, damaged))
                ]
                if changes:
                    connection.execute(_UPDATE, changes)
                sealed, after = sealed + len(changes), rows[-1].id
                progress("rotate", min(sealed, total), total)
            audit.record(connection, "rotate keys", key=target, damaged=len(damaged))
        gallery.vacuum()  # no free page or dead row contains what was before
        delete_files(gallery)
        progress("rotate", total, total)
    return Rotation(target, sealed, damaged)


_UPDATE: Final = (
    ENTRY.update()
    .where(ENTRY.c.id == sa.bindparam("row"))
    .values(template=sa.bindparam("own"), digest=sa.bindparam("of_own"))
)


def _sealed_anew(
    row: Any, before: Sealing | None, new: Sealing | None, damaged: dict[int, str]
) -> dict[str, Any] | None:
    """Return the new template and digest of a row; None for one that stays as it is.

    A digest that was wrong stays wrong.
    """
    sealed = isinstance(row.template, bytes) and is_sealed(row.template)
    try:
        if sealed and new is not None and key_id_of(row.template) == new.key_id:
            return None
        if sealed and before is None:
            raise DamagedRowError(row.id, "it is encrypted, in a gallery that is not")
        opened = row if before is None else before.unseal_row(row)
    except DamagedRowError as error:
        damaged[row.id] = error.why
        return None
    columns = {name: getattr(opened, name) for name in row._fields}
    if new is not None:
        columns = new.seal_row(columns)
    right = row.digest == row_digest(row._mapping)
    digest = row_digest(columns) if right else row.digest
    return {"row": row.id, "own": columns["template"], "of_own": digest}
