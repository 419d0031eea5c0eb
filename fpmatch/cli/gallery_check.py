"""`fpmatch gallery check`: fingers whose impressions do not match each other."""

from __future__ import annotations

import json

import click

from fpmatch.cli.progress import ProgressBars
from fpmatch.cli.words import count


@click.command(
    "check",
    epilog="""\b
Examples:
  fpmatch gallery check prints.db
  fpmatch gallery check prints.db --subject 101 --json

Exit status: 0 when the impressions of every finger hang together by matches, 1 when those of some
do not, 2 when the gallery cannot be checked.
""",
)
@click.argument("gallery")
@click.option("--subject", metavar="NAME", help="Check the fingers of this subject only.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON array.")
@click.pass_context
def gallery_check(ctx: click.Context, /, gallery: str, subject: str | None, as_json: bool) -> None:
    """Compare the impressions of each finger in GALLERY with each other.

    Told are fingers whose impressions fall into groups that do not match each other, with the pair
    of each group that comes nearest to a match: other fingers may have been enrolled with them.
    Touches of a small sensor that share no skin do not match either.
    """
    from fpmatch.errors import GalleryError
    from fpmatch.gallery.consistency import check_fingers
    from fpmatch.gallery.gallery import open_gallery

    with open_gallery(gallery) as opened, ProgressBars({"check": "comparing"}) as bars:
        if subject is not None and next(opened.entries(subject=subject), None) is None:
            raise GalleryError(f"{opened.name}: no impression of subject {subject}")
        wanted = None if subject is None else {subject}
        checks = list(check_fingers(opened, subjects=wanted, progress=bars.show))
    doubtful = [check for check in checks if not check.consistent]
    if as_json:
        click.echo(json.dumps([check.as_dict() for check in checks], indent=2))
    else:
        for check in doubtful:
            sizes = ", ".join(str(len(group)) for group in check.groups)
            click.echo(f"{check.name}: groups of {sizes} impressions do not match each other")
            for pair in check.disagreements:
                click.echo(f"  {pair}")
        several = count(len(checks), "finger")
        click.echo(f"{several} with several impressions checked, {len(doubtful)} doubtful")
    ctx.exit(1 if doubtful else 0)
