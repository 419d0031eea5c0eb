"""`fpmatch gallery export`: the templates of a gallery as files."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import click

from fpmatch.cli.extract import FORMATS, OWN_FORMATS
from fpmatch.cli.progress import ProgressBars
from fpmatch.cli.words import count, first_of
from fpmatch.formats.registry import codec_of_name

_SUFFIXES: Final = {
    name: tuple(codec_of_name(one).suffixes[0] for one in names) for name, names in FORMATS.items()
}
_STAGES: Final = {"export": "writing templates"}


@click.command(
    "export",
    epilog="""\b
Examples:
  fpmatch gallery export prints.db -o templates
  fpmatch gallery export prints.db -o templates --subject 101 --format both
  fpmatch gallery export prints.db -o templates --format iso2005
""",
)
@click.argument("gallery")
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    required=True,
    type=click.Path(path_type=Path),
    help="Folder for the templates; made if missing.",
)
@click.option("--subject", metavar="NAME", help="Write those of this subject only.")
@click.option(
    "--format",
    "file_format",
    type=click.Choice(list(_SUFFIXES)),
    default="json",
    show_default=True,
    help="JSON keeps everything; CSV the minutiae, for eyes; the others are those of convert.",
)
def gallery_export(gallery: str, output: Path, subject: str | None, file_format: str) -> None:
    """Write the templates of GALLERY, a file or the URL of a PostgreSQL database, as files.

    They are named by subject, finger and impression: 101_3.json.
    """
    from fpmatch.gallery.export import export_templates
    from fpmatch.gallery.gallery import open_gallery

    lost: dict[str, list[Path]] = {}
    own = file_format in OWN_FORMATS
    with open_gallery(gallery) as opened, ProgressBars(_STAGES) as bars:
        written = export_templates(
            opened,
            output,
            suffixes=_SUFFIXES[file_format],
            subject=subject,
            progress=bars.show,
            noted=lambda path, note: lost.setdefault(note, []).append(path),
        )
    for note, paths in lost.items():
        if not own:
            click.echo(f"fpmatch: note: {first_of(paths)}: {note}", err=True)
    click.echo(f"{count(written, 'template')}: {output}")
