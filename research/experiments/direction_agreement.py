"""Agreement of minutia directions with those that other extractors find on the same prints.

No extractor's set is the truth, but all use one convention (ISO/IEC 19794-2). Where two find a
minutia in one place, directions that mostly differ show a wrong convention, and many opposite ones
show that endings and bifurcations, or ridges and valleys, are confused.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click
import numpy as np

from fpmatch.base.text_table import text_table
from fpmatch.errors import DatasetError
from fpmatch.formats.files import load_record
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.lab.evaluation.databases.extraction import extract_datasets
from fpmatch.pointset.geometry.pairing import greedy_pairs
from research.commands import PATH, Command, workers

if TYPE_CHECKING:
    import os

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.templates.minutiae import Minutiae

MAX_DISTANCE_PX: Final = 8.0  # between positions of the same minutia
MAX_TURN_DEG: Final = 30.0  # between directions that agree
MIN_FLIP_DEG: Final = 150.0  # between opposite directions


@dataclass(frozen=True, slots=True)
class Agreement:
    """Count minutiae that two extractors found in one place; counts add up.

    `pairs`: minutiae that both found, one to one. `agreeing`, `flipped`: pairs whose directions
    agree, and whose directions are opposite.
    """

    pairs: int = 0
    agreeing: int = 0
    flipped: int = 0

    def __add__(self, other: Agreement) -> Agreement:
        return Agreement(
            self.pairs + other.pairs,
            self.agreeing + other.agreeing,
            self.flipped + other.flipped,
        )

    @property
    def agreeing_share(self) -> float:
        """Share of the pairs that agree; NaN without pairs."""
        return self.agreeing / self.pairs if self.pairs else float("nan")

    @property
    def flipped_share(self) -> float:
        """Share of the pairs that are flipped; NaN without pairs."""
        return self.flipped / self.pairs if self.pairs else float("nan")


def compare_directions(ours: Minutiae, theirs: Minutiae) -> Agreement:
    """Compare the directions of minutiae of one image that two extractors found in one place."""
    if not (len(ours) and len(theirs)):
        return Agreement()
    i, j = greedy_pairs(ours.xy, theirs.xy, MAX_DISTANCE_PX).T
    difference = np.degrees(ours.angle[i].astype(np.float64) - theirs.angle[j])
    turn = np.abs((difference + 180.0) % 360.0 - 180.0)
    agreeing, flipped = turn <= MAX_TURN_DEG, turn > MIN_FLIP_DEG
    return Agreement(len(turn), int(agreeing.sum()), int(flipped.sum()))


def measure_agreement(prints: ExtractedSet, folder: str | os.PathLike[str]) -> Agreement:
    """Measure the agreement on a whole database with another extractor's minutiae.

    `prints`: the database and our templates; prints without a template add nothing. `folder`: holds
    a file ``FFF_M.csv`` for each impression, with the columns x, y, theta. The result is over all
    impressions together. Raises a `TemplateError` if a file is missing or malformed.
    """
    total = Agreement()
    for impression, extraction in zip(prints.dataset.impressions, prints.extractions, strict=True):
        path = Path(folder, f"{impression.path.stem}.csv")
        theirs = load_record(path, file_format="minutiae-csv").single().template.minutiae
        if extraction.template is not None:
            total += compare_directions(extraction.template.minutiae, theirs)
    return total


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
