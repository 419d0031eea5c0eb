"""Rows of entries: the one place where templates are packed for a row, and read from one."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import GalleryError, TemplateError
from fpmatch.gallery.compact import pack_template, unpack_template
from fpmatch.gallery.database import DamagedRowError
from fpmatch.gallery.entry import Entry, Label

if TYPE_CHECKING:
    from fpmatch.gallery.entry import NewEntry
    from fpmatch.minutiae import Template

_KINDS: Final = (int, str, str, str, str, bytes, float, int)  # of the columns of an `Entry`


def pack_entry(entry: NewEntry) -> bytes | str:
    """Return the template of a new entry as its row will hold it, or why it cannot be stored."""
    try:
        packed = pack_template(entry.template)
        unpack_template(packed)
    except TemplateError as error:
        return str(error)
    return packed


def to_row(entry: NewEntry, packed: bytes | str) -> dict[str, Any]:
    """Return the columns of a new entry, whose template `pack_entry` packed."""
    return {
        **asdict(entry.label),
        "source": entry.source,
        "content": entry.content,
        "dpi": entry.template.dpi,
        "minutiae": len(entry.template.minutiae),
        "template": packed,
    }


def as_entry(row: Any) -> Entry:
    """Return a row of the columns `ABOUT` as an entry, or raise DamagedRowError."""
    number, subject, finger, impression, *rest = row
    for value, kind in zip(row, _KINDS, strict=True):
        if not isinstance(value, kind):
            raise DamagedRowError(f"entry {number} has a column of another type")
    return Entry(number, Label(subject, finger, impression), *rest)


def as_packed(row: Any) -> tuple[int, bytes]:
    """Return number and packed template of a row, or raise DamagedRowError."""
    if not (isinstance(row.id, int) and isinstance(row.template, bytes)):
        raise DamagedRowError(f"entry {row.id} has no template")
    return row.id, row.template


def unpack_entry(data: bytes, number: int, gallery: str) -> Template:
    """Unpack the template of an entry; a damaged one is a GalleryError that names both."""
    try:
        return unpack_template(data)
    except TemplateError as error:
        why = f"damaged: entry {number}: {error}"
        raise GalleryError(why, path=gallery, code="damaged") from error
