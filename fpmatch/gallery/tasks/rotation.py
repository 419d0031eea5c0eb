"""Encryption of all templates of a gallery with another key."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

from fpmatch.gallery.encryption.keys import load_keys
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.store import audit
from fpmatch.gallery.store.kept_files import delete_files
from fpmatch.gallery.store.rows import check_row, row_digest
from fpmatch.gallery.store.sealing import set_key
from fpmatch.gallery.store.tables import ENTRY, WHOLE, DamagedRowError

if TYPE_CHECKING:
    from fpmatch.gallery.gallery import Gallery

_ROWS_PER_READ: Final = 500
_UPDATE: Final = (
    ENTRY.update()
    .where(ENTRY.c.id == sa.bindparam("row"))
    .values(template=sa.bindparam("own"), digest=sa.bindparam("of_own"))
)


@dataclass(frozen=True, slots=True)
class Rotation:
    """The number of templates that a rotation has sealed, and its key.

    `damaged` has, by number, why an entry could not be read; it was left as it is.
    """

    key: str
    sealed: int
    damaged: dict[int, str]


def rotate(gallery: Gallery, *, progress: Progress = no_progress) -> Rotation:
    """Seal all templates of a gallery with the current one of its keys.

    The gallery is open with the key in use, if it has one, and the new one. All is one transaction:
    other programs wait for its end, and one that is killed has changed nothing. Then the files of
    the gallery are rewritten without what they had before. `progress` is called with stage "rotate"
    and numbers of entries. Raises GalleryError if a key is missing; EncryptionError if the source
    of the keys cannot be read.
    """
    total, sealed, after = len(gallery), 0, 0
    damaged: dict[int, str] = {}
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
                    damaged[row.id] = error.why
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
    return Rotation(target, sealed, damaged)
