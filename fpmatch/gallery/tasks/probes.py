"""Probes of searches: what an audit states of them, and whether one is enrolled itself."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, TypeVar

from fpmatch.errors import ImageReadError
from fpmatch.templates.bounds import have_same_minutiae

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.templates.minutiae import Template

Made = TypeVar("Made")


def read_hashed(path: Path, read: Callable[[], Made]) -> tuple[Made, str]:
    """Return what a function makes of a file, and the SHA-256 of the bytes that it read.

    Raises ImageReadError if the file is changed meanwhile; else what the function raises.
    """
    before = _sha256(path)
    made = read()
    if _sha256(path) != before:
        raise ImageReadError("was changed while it was read", path=path)
    return made, before


def _sha256(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""  # the function states the reason


def notes_on_identical(
    gallery: Gallery, probe: Template, entries: Sequence[Entry]
) -> Iterator[str]:
    """Yield a note on each entry of a gallery that is the same image as a probe."""
    for entry in entries:
        template = gallery.find_template(entry.id)
        if template is not None and have_same_minutiae(probe, template):
            yield f"the same image as entry {entry.id}, {entry.label}: its score proves nothing"
