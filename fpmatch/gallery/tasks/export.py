"""Export of the templates of a gallery as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import quote

from fpmatch.base.folders import make_folder
from fpmatch.errors import OutputError
from fpmatch.formats.files import save_template
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.store.audit import ranges

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry

_LONGEST_NAME: Final = 240  # without suffix; file systems have 255 bytes
_KEPT_IN_NAMES: Final = " +,=@"  # besides letters, digits and _.-~; others are written as %XX


def export_templates(
    gallery: Gallery,
    folder: str | os.PathLike[str],
    *,
    suffixes: Sequence[str] = (".json",),
    subject: str | None = None,
    progress: Progress = no_progress,
    noted: Callable[[Path, str], None] = lambda path, note: None,
) -> int:
    """Write the templates of a gallery into a folder, under their labels; return their number.

    They are written in the formats of some `suffixes`, as of `save_template`; `subject` selects
    those of one; damaged entries are skipped, as `gallery.damaged` states. `progress` is called
    with stage "export" and numbers of templates, `noted` with a file and each note on what its
    format cannot hold. Raises OutputError if two entries would have the same file name.
    """
    names = _names(gallery.entries(subject=subject))
    for number in [number for number, name in names.items() if len(name) > _LONGEST_NAME]:
        gallery.damaged[number] = "its label is too long for the name of a file"
        del names[number]
    gallery.record("export", entries=ranges(names))
    make_folder(folder)
    progress("export", 0, len(names))
    written = 0
    for number, template in gallery.templates(of=names):
        for suffix in suffixes:
            path = Path(folder, f"{names[number]}{suffix}")
            for note in save_template(path, template):
                noted(path, note)
        written += 1
        progress("export", written, len(names))
    return written


def _names(entries: Iterable[Entry]) -> dict[int, str]:
    """Return the file name, without suffix, of each entry by its number."""
    taken: dict[str, Entry] = {}
    names = {}
    for entry in entries:
        name = quote(str(entry.label), safe=_KEPT_IN_NAMES)
        other = taken.setdefault(name.casefold(), entry)
        if other is not entry:
            raise OutputError(
                f"entries {other.id} and {entry.id} would both be written as {name}; "
                "export their subjects one by one"
            )
        names[entry.id] = name
    return names
