"""The command ``check conventions``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import click

from fpmatch.errors import DatasetError
from fpmatch.evaluation.databases.dataset import load_dataset
from fpmatch.evaluation.databases.extraction import extract_datasets
from fpmatch.text_table import text_table
from research.commands import PATH, Command, workers
from research.experiments.direction_agreement import Agreement, measure_agreement

if TYPE_CHECKING:
    from pathlib import Path

MIN_AGREEING_SHARE: Final = 0.85
MAX_FLIPPED_SHARE: Final = 0.08


def within_limits(agreement: Agreement) -> bool:
    """Return whether enough directions agree and few enough are flipped."""
    return (
        agreement.agreeing_share >= MIN_AGREEING_SHARE
        and agreement.flipped_share <= MAX_FLIPPED_SHARE
    )


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check conventions fvc/fvc2002 minutiae
""",
)
@click.argument("prints", type=PATH)
@click.argument("minutiae", type=PATH)
@workers
@click.pass_context
def command(context: click.Context, prints: Path, minutiae: Path, workers: int | None) -> None:
    """Compare minutia directions with those of other extractors on the same prints.

    PRINTS holds databases, such as DB1_B/101_1.tif; MINUTIAE the extractors' minutiae, such as
    mindtct/fvc2002/DB1_B/101_1.csv, where fvc2002 is the name of PRINTS. Of the minutiae that both
    find within 8 px, at least 85 % must agree in direction within 30 degrees, and at most 8 % may
    be flipped (over 150 degrees apart); otherwise the exit status is 1.
    """
    folders = _minutiae_folders(prints, minutiae)
    sets = extract_datasets([load_dataset(prints / name) for name in folders], workers=workers)
    rows = [["database", "extractor", "pairs", "within 30°", "flipped", ""]]
    status = 0
    for (name, extractors), extracted in zip(folders.items(), sets, strict=True):
        for folder in extractors:
            found = measure_agreement(extracted, folder)
            status |= not within_limits(found)
            rows.append(
                [
                    *(name, folder.parent.parent.name, str(found.pairs)),
                    *(f"{found.agreeing_share:.1%}", f"{found.flipped_share:.1%}"),
                    "" if within_limits(found) else "outside the limits",
                ]
            )
    click.echo(text_table(rows, left=2))
    context.exit(status)


def _minutiae_folders(prints: Path, minutiae: Path) -> dict[str, list[Path]]:
    """Return for each database the folders of the extractors that have minutiae of it."""
    name = prints.resolve().name
    found: dict[str, list[Path]] = {}
    for folder in sorted(minutiae.glob(f"*/{name}/*")):
        if folder.is_dir() and (prints / folder.name).is_dir():
            found.setdefault(folder.name, []).append(folder)
    if not found:
        raise DatasetError(f"{minutiae}: contains no minutiae EXTRACTOR/{name}/DATABASE")
    return found
