"""`fpmatch extract --gallery`: the templates of a gallery as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import quote

from fpmatch.base.folders import make_folder
from fpmatch.cli.extract import OWN_FORMATS
from fpmatch.cli.notes import first_of, say_note, show_line
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import OutputError
from fpmatch.formats.files import save_template
from fpmatch.formats.registry import codec_of_name
from fpmatch.gallery.cli.notes import say_damaged
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.store.audit import ranges
from fpmatch.printable import count

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fpmatch.gallery.listing.entry import Entry

_LONGEST_NAME: Final = 240  # without suffix; file systems have 255 bytes
_KEPT_IN_NAMES: Final = " +,=@"  # besides letters, digits and _.-~; others are written as %XX


def export_gallery(place: str, output: Path, file_format: str, subject: str | None) -> int:
    """Write the templates of a gallery, or of a subject in it; return 1 where some are damaged.

    Raises OutputError if two entries would have the same file name.
    """
    formats = [codec_of_name(name) for name in OWN_FORMATS.get(file_format, (file_format,))]
    lost: dict[str, list[Path]] = {}
    written = 0
    with open_gallery(place) as gallery, ProgressBars({"export": "writing templates"}) as bars:
        names = _names(gallery.entries(subject=subject))
        for number in [number for number, name in names.items() if len(name) > _LONGEST_NAME]:
            gallery.damaged[number] = "its label is too long for the name of a file"
            del names[number]
        gallery.record("export", entries=ranges(names))
        make_folder(output)
        for number, template in gallery.templates(of=names):
            for codec in formats:
                path = Path(output, f"{names[number]}{codec.suffixes[0]}")
                for note in save_template(path, template):
                    lost.setdefault(note, []).append(path)
            written += 1
            bars.show("export", written, len(names))
        say_damaged(gallery.name, gallery.damaged)
    for note, paths in lost.items():
        if file_format not in OWN_FORMATS:
            say_note(f"{first_of(paths)}: {note}")
    show_line(f"{count(written, 'template')}: {output}")
    return 1 if gallery.damaged else 0


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
