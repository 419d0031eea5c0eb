"""`fpmatch gallery export`: the templates of a gallery as files."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import click

from fpmatch.cli.progress import ProgressBars
from fpmatch.cli.words import count

_SUFFIXES: Final = {"json": (".json",), "csv": (".csv",), "both": (".json", ".csv")}
_STAGES: Final = {"export": "writing templates"}


@click.command(
    "export",
    epilog="""\b
Examples:
  fpmatch gallery export prints.db -o templates
  fpmatch gallery export prints.db -o templates --subject 101 --format both
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
    help="JSON keeps everything; CSV the minutiae, for eyes and spreadsheets.",
)
def gallery_export(gallery: str, output: Path, subject: str | None, file_format: str) -> None:
    """Write the templates of GALLERY, a file or the URL of a PostgreSQL database, as files.

    They are named by subject, finger and impression: 101_3.json.
    """
    from fpmatch.gallery.export import export_templates
    from fpmatch.gallery.gallery import open_gallery

    with open_gallery(gallery) as opened, ProgressBars(_STAGES) as bars:
        written = export_templates(
            opened,
            output,
            suffixes=_SUFFIXES[file_format],
            subject=subject,
            progress=bars.show,
        )
    click.echo(f"{count(written, 'template')}: {output}")
