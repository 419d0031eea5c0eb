"""Rows of entries: how templates are packed for a row, and read from one that is checked.

Each row has a digest of its columns but the number: one that was changed, or has columns of
another row, differs from it. It is no signature: who may write the database can correct it.
"""

from __future__ import annotations

import hashlib
import struct
from dataclasses import asdict
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import TemplateError
from fpmatch.gallery.listing.entry import Entry, Label, NewEntry
from fpmatch.gallery.store.stored_template import check_packed, pack_template, unpack_template
from fpmatch.gallery.store.tables import ABOUT, ENTRY, DamagedRowError
from fpmatch.templates.bounds import MOST_MINUTIAE
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fpmatch.templates.minutiae import Template

_KINDS: Final = {
    **dict.fromkeys(("id", "minutiae"), int),
    **dict.fromkeys(("subject", "finger", "impression", "source"), str),
    **{"content": bytes, "dpi": float},
}
_OWN: Final = ("source", "content", "dpi", "minutiae", "template")
_DIGEST_BYTES: Final = 6
_END: Final = 16  # bytes of a template
_BOUND: Final = itemgetter(*(column.name for column in (*ABOUT[1:], ENTRY.c.template)))
_HEAD: Final = struct.Struct("<6Qdq")  # lengths, dpi and number of minutiae


def new_entry(label: Label, source: str, content: bytes, template: Template) -> NewEntry:
    """Return an impression to be enrolled; `content` is the SHA-256 of the file `source`.

    Raises TemplateError if the template cannot be stored: packed, it was read once, and what is
    within the bounds can be prepared. Raises GalleryError as `Label.check` does.
    """
    packed = pack_template(template)
    unpack_template(packed)
    return NewEntry(label, source, content, template.dpi, len(template.minutiae), packed)


def to_row(entry: NewEntry) -> dict[str, Any]:
    """Return the columns of a new entry but its digest."""
    return asdict(entry.label) | {name: getattr(entry, name) for name in _OWN}


def row_digest(row: Mapping[str, Any]) -> int:
    """Return the digest of the columns of an entry, as they are stored; -1 for impossible ones.

    Of the template it has the length and the end, which is a checksum of the rest, or authenticates
    it.
    """
    *names, content, dpi, minutiae, template = _BOUND(row)
    try:
        head = _HEAD.pack(*map(len, names), len(content), len(template), dpi, minutiae)
        text = "".join(names).encode("utf-8", "surrogatepass")
        whole = b"".join((head, text, content, template[-_END:]))
    except (TypeError, struct.error):
        return -1
    return int.from_bytes(hashlib.sha256(whole).digest()[:_DIGEST_BYTES], "little")


def check_row(row: Any) -> None:
    """Raise DamagedRowError if a row of all columns has another digest than its own."""
    digest = row_digest(row._mapping)
    if digest < 0 or row.digest != digest:
        raise DamagedRowError(row.id, "its label, picture or template is not what was enrolled")


def as_entry(row: Any) -> Entry:
    """Return a row of the columns `ABOUT` as an entry, or raise DamagedRowError."""
    for name, kind in _KINDS.items():
        if not isinstance(getattr(row, name), kind):
            raise DamagedRowError(row.id, f"its {name} is of another type")
    if not (MIN_DPI <= row.dpi <= MAX_DPI and 0 <= row.minutiae <= MOST_MINUTIAE):
        raise DamagedRowError(row.id, "its dpi or its number of minutiae is impossible")
    label = Label(row.subject, row.finger, row.impression)
    return Entry(row.id, label, row.source, row.content, row.dpi, row.minutiae)


def as_packed(row: Any) -> tuple[int, bytes]:
    """Return number and packed template of a row whose digest is right.

    Raises DamagedRowError if the checksum of the template is wrong.
    """
    try:
        check_packed(row.template)
    except TemplateError as error:
        raise DamagedRowError(row.id, str(error)) from error
    return row.id, row.template


def as_template(row: Any) -> tuple[int, Template]:
    """Return number and template of a row whose digest is right, or raise DamagedRowError."""
    try:
        return row.id, unpack_template(row.template)
    except TemplateError as error:
        raise DamagedRowError(row.id, str(error)) from error


def as_new_entry(row: Any) -> tuple[int, NewEntry]:
    """Return number and content of a row whose digest is right, for another gallery.

    Raises DamagedRowError if the entry cannot be enrolled.
    """
    entry = as_entry(row)
    as_template(row)
    about = (entry.label, entry.source, entry.content, entry.dpi, entry.minutiae)
    return row.id, NewEntry(*about, row.template)
