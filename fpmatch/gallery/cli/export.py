"""`fpmatch extract --gallery`: the templates of a gallery as files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fpmatch.cli.extract import OWN_FORMATS
from fpmatch.cli.notes import first_of, say_note, show_line
from fpmatch.cli.progress import ProgressBars
from fpmatch.formats.registry import codec_of_name
from fpmatch.gallery.cli.notes import say_damaged
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.tasks.export import export_templates
from fpmatch.printable import count

if TYPE_CHECKING:
    from pathlib import Path


def export_gallery(gallery: str, output: Path, file_format: str, subject: str | None) -> int:
    """Write the templates of a gallery, or of a subject in it; return 1 where some are damaged."""
    formats = [codec_of_name(name) for name in OWN_FORMATS.get(file_format, (file_format,))]
    lost: dict[str, list[Path]] = {}
    with open_gallery(gallery) as opened, ProgressBars({"export": "writing templates"}) as bars:
        written = export_templates(
            opened,
            output,
            suffixes=[codec.suffixes[0] for codec in formats],
            subject=subject,
            progress=bars.show,
            noted=lambda path, note: lost.setdefault(note, []).append(path),
        )
        say_damaged(opened.name, opened.damaged)
    for note, paths in lost.items():
        if file_format not in OWN_FORMATS:
            say_note(f"{first_of(paths)}: {note}")
    show_line(f"{count(written, 'template')}: {output}")
    return 1 if opened.damaged else 0
