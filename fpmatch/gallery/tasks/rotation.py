"""Rotation of the keys of a gallery, while other programs search it and enrol in it.

Templates are sealed with another key in short transactions; until the last is, both keys are in
use. A rotation that was killed continues when it is started again. The same steps encrypt a gallery
that is not, or decrypt one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from fpmatch.gallery.encryption.records import MAGIC, record_head
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.store import audit
from fpmatch.gallery.store.database import DamagedRowError
from fpmatch.gallery.store.digests import row_digest
from fpmatch.gallery.store.kept_files import delete_files
from fpmatch.gallery.store.sealing import PLAIN, create_sealing, set_keys
from fpmatch.gallery.store.tables import ENTRY, GALLERY, TABLES, WHOLE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.store.sealing import Sealing

ROWS_PER_COMMIT: Final = 200
_TEMPLATE: Final = ENTRY.c.template


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

    The gallery is open with all keys in use and the new one. `progress` is called with stage
    "rotate" and numbers of entries. Raises GalleryError if a key is missing, or another rotation
    was begun meanwhile; EncryptionError if the source of the keys cannot be read.
    """
    with gallery.naming_keys():
        return _rotate(gallery, decrypt, progress)


def _rotate(gallery: Gallery, decrypt: bool, progress: Progress) -> Rotation:
    target = PLAIN if decrypt else gallery.current_key()
    had_plain = _begin(gallery, target)
    delete_files(gallery)
    sealed, damaged, after = 0, dict[int, str](), 0
    total = len(gallery)
    progress("rotate", 0, total)
    while (batch := _seal_some(gallery, target, after, damaged)) is not None:
        count, after = batch
        sealed += count
        progress("rotate", min(sealed, total), total)
    if had_plain:
        gallery.vacuum(TABLES)  # no free page or dead row contains a plain template then
        delete_files(gallery)  # of searches that began before
    _end(gallery, target, damaged)
    progress("rotate", total, total)
    return Rotation(target, sealed, damaged)


def _begin(gallery: Gallery, target: str) -> bool:
    """Let new entries be sealed with the target; return whether there may be plain ones."""
    with gallery.changing() as connection:
        sealing = gallery.sealing(connection)
        if sealing is None:
            if target == PLAIN:
                raise gallery.error("is not encrypted", "not encrypted")
            create_sealing(connection, (target, PLAIN))
            connection.execute(GALLERY.update().values(version=GALLERY.c.version + 1))
            keys: tuple[str, ...] = (target, PLAIN)
        else:
            sealing.check_keys()
            keys = (target, *(key for key in sealing.keys if key != target))
            set_keys(connection, keys)
        if sealing is None or keys != sealing.keys:
            audit.record(connection, "rotate keys", keys=list(keys))
    return PLAIN in keys and target != PLAIN


def _seal_some(
    gallery: Gallery, target: str, after: int, damaged: dict[int, str]
) -> tuple[int, int] | None:
    """Seal some templates in one transaction; return how many, and the last number seen."""
    head = MAGIC if target == PLAIN else record_head(target)
    begin = sa.func.substr(_TEMPLATE, 1, len(head))
    other = begin == head if target == PLAIN else begin != head
    with gallery.changing() as connection:
        query = WHOLE.where(ENTRY.c.id > after, other)
        sealing = _sealing(gallery, connection, target)
        rows = connection.execute(query.order_by(ENTRY.c.id).limit(ROWS_PER_COMMIT)).all()
        sealed: list[tuple[Any, bytes]] = []
        for row in rows:
            try:
                opened = sealing.unseal_row(row)
            except DamagedRowError as error:
                damaged[row.id] = error.why
                continue
            columns = {name: getattr(opened, name) for name in row._fields}
            sealed.append((row, sealing.seal_row(columns, target)["template"]))
        if sealed:
            _replace_templates(connection, sealed)
    return (len(sealed), rows[-1].id) if rows else None


def _replace_templates(connection: sa.Connection, rows: Sequence[tuple[Any, bytes]]) -> None:
    """Store other templates in rows; a digest that was wrong stays wrong."""
    update = ENTRY.update().where(ENTRY.c.id == sa.bindparam("row"))
    new = update.values(template=sa.bindparam("own"), digest=sa.bindparam("of_own"))
    changes = []
    for row, template in rows:
        right = row.digest == row_digest(row._mapping)
        digest = row_digest(row._asdict() | {"template": template}) if right else row.digest
        changes.append({"row": row.id, "own": template, "of_own": digest})
    connection.execute(new, changes)


def _end(gallery: Gallery, target: str, damaged: dict[int, str]) -> None:
    """Record that no other key is in use, once that is so."""
    with gallery.changing() as connection:
        _sealing(gallery, connection, target)
        set_keys(connection, () if target == PLAIN else (target,))
        if target == PLAIN:
            connection.execute(GALLERY.update().values(version=GALLERY.c.version - 1))
        audit.record(connection, "keys rotated", keys=[target], damaged=len(damaged))


def _sealing(gallery: Gallery, connection: sa.Connection, target: str) -> Sealing:
    """Return how a gallery is sealed, if new entries are still sealed with the target."""
    sealing = gallery.sealing(connection)
    if sealing is None or sealing.keys[0] != target:
        raise gallery.error("another rotation of its keys was begun meanwhile", "rotation")
    return sealing
