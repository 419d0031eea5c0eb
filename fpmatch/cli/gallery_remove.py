"""`fpmatch gallery remove`: take impressions out of a gallery."""

from __future__ import annotations

import click

from fpmatch.cli.words import count
from fpmatch.errors import GalleryError


@click.command(
    "remove",
    epilog="""\b
Examples:
  fpmatch gallery remove prints.db 17 18
  fpmatch gallery remove prints.db --subject 101
  fpmatch gallery remove prints.db --failures
""",
)
@click.argument("gallery")
@click.argument("numbers", metavar="[NUMBER]...", nargs=-1, type=int)
@click.option("--subject", metavar="NAME", help="Remove all impressions of this subject.")
@click.option("--failures", is_flag=True, help="Forget what could not be enrolled.")
def gallery_remove(
    gallery: str, numbers: tuple[int, ...], subject: str | None, failures: bool
) -> None:
    """Remove impressions from GALLERY, a file or the URL of a PostgreSQL database.

    Each NUMBER is one that `fpmatch gallery list` shows; all are removed, or none.
    """
    from fpmatch.gallery.gallery import open_gallery

    if not numbers and subject is None and not failures:
        raise click.UsageError("nothing to remove: give a NUMBER, --subject or --failures")
    with open_gallery(gallery) as opened:
        chosen = list(numbers)
        if subject is not None:
            found = [entry.id for entry in opened.entries(subject=subject)]
            if not found:
                raise GalleryError(f"{opened.name}: no impression of subject {subject}")
            chosen += found
        removed = opened.remove(chosen) if chosen else 0
        forgotten = opened.forget_failures() if failures else 0
        left, name = len(opened), opened.name
    said = [f"removed {count(removed, 'impression')}"] if chosen else []
    said += [f"forgot {count(forgotten, 'failure')}"] if failures else []
    click.echo(f"{', '.join(said)}; {count(left, 'impression')} left: {name}")
