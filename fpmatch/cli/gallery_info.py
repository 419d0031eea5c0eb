"""`fpmatch gallery info`: a gallery in figures."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from fpmatch.cli.words import count

if TYPE_CHECKING:
    from fpmatch.gallery.summary import GallerySummary


@click.command(
    "info",
    epilog="""\b
Examples:
  fpmatch gallery info prints.db
  fpmatch gallery info postgresql://me@host/prints --json
""",
)
@click.argument("gallery")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def gallery_info(gallery: str, as_json: bool) -> None:
    """Tell what GALLERY, a file or the URL of a PostgreSQL database, holds, in figures."""
    from fpmatch.gallery.documents import summary_document
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.summary import summarise

    with open_gallery(gallery) as opened:
        summary, name = summarise(opened), opened.name
    if as_json:
        click.echo(json.dumps(summary_document(name, summary), indent=2))
    else:
        click.echo(_in_words(name, summary))


def _in_words(name: str, s: GallerySummary) -> str:
    n = max(s.impressions, 1)
    resolutions = ", ".join(f"{count} at {dpi:g} dpi" for dpi, count in s.dpi.items()) or "none"
    rows = [
        ("Impressions", f"{s.impressions} of {count(s.subjects, 'subject')}"),
        ("Resolution", resolutions),
        ("Minutiae", f"{s.minutiae}, {s.minutiae / n:.0f} an impression"),
        ("Templates", f"{s.template_bytes} bytes, {s.template_bytes / n:.0f} an impression"),
        (
            "Failures",
            f"{count(s.failures, 'picture')} could not be enrolled" if s.failures else "none",
        ),
        ("Form", f"version {s.version}"),
    ]
    return "\n".join([name, *(f"  {label:<12}{text}" for label, text in rows)])
