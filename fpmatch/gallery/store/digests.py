"""Digests of the entries of a gallery, which show damage and exchanged columns.

Each row has a digest of its columns but the number: one that was changed differs from it. It is no
signature: who may write the database can correct it.
"""

from __future__ import annotations

import hashlib
import struct
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

from fpmatch.gallery.store.database import DamagedRowError
from fpmatch.gallery.store.tables import ABOUT, ENTRY

if TYPE_CHECKING:
    from collections.abc import Mapping

_DIGEST_BYTES: Final = 6
_END: Final = 16  # bytes of a template
_BOUND: Final = itemgetter(*(column.name for column in (*ABOUT[1:], ENTRY.c.template)))
_HEAD: Final = struct.Struct("<6Qdq")  # lengths, dpi and number of minutiae


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
    if row.digest != row_digest(row._mapping):
        raise DamagedRowError(row.id, "its label, picture or template is not what was enrolled")
