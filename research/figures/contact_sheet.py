"""The command ``contact-sheet``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import click
import numpy as np

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.drawing.scene.raster import png_bytes
from fpmatch.image.io.read import read_image
from fpmatch.lab.evaluation.databases.dataset import with_unique_names
from fpmatch.lab.evaluation.run import load_datasets
from fpmatch.templates.minutiae import STANDARD_DPI
from research.commands import PATH, Command, folders
from research.figures.print_sheet import DEFAULT_DPI, PrintTile, print_sheet

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.dataset import Dataset

GREYS: Final = 64  # the eye sees no difference, and the file is a third smaller


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research contact-sheet fvc/fvc2002/* -o sheet.png
""",
)
@folders
@click.option("-o", "--out", type=PATH, required=True, help="The PNG file to write.")
@click.option("--each", "count", default=6, show_default=True, help="Prints of a database.")
@click.option("--across", is_flag=True, help="A column a database, not a row.")
@click.option("--others", is_flag=True, help="Other fingers of every database.")
@click.option("--dpi", default=DEFAULT_DPI, show_default=True, help="Resolution of the sheet.")
def command(
    folders: tuple[Path, ...], out: Path, count: int, across: bool, others: bool, dpi: float
) -> None:
    """Draw prints of FVC-style databases DIR on one sheet, all at one scale.

    A row shows one print of each of a database's first fingers: the first impression of the first
    finger, the second of the second, and so on, so that many placements are seen.
    """
    check_writable(out)
    datasets = with_unique_names(load_datasets(folders))
    step = count if others else 0
    rows = [tiles_of(dataset, count, n * step) for n, dataset in enumerate(datasets)]
    if across:
        rows = [list(row) for row in zip(*rows, strict=False)]
    sheet = png_bytes(_with_fewer_greys(print_sheet(rows, dpi=dpi)))
    atomic_write_bytes(out, sheet, public=True)
    click.echo(f"{out}: {out.stat().st_size // 1000} kB")


def tiles_of(dataset: Dataset, count: int, start: int = 0) -> list[PrintTile]:
    """Return prints of `count` fingers from the one at `start`, of each another impression."""
    fingers = sorted({i.finger for i in dataset.impressions})
    tiles = []
    for n in range(count):
        finger = fingers[(start + n) % len(fingers)]
        impressions = [i for i in dataset.impressions if i.finger == finger]
        path = impressions[n % len(impressions)].path
        image = read_image(path)
        dpi = dataset.dpi or image.dpi or STANDARD_DPI
        tiles.append(PrintTile(image.pixels, dpi, f"{dataset.name}, {path.stem}"))
    return tiles


def _with_fewer_greys(sheet: NDArray[np.uint8]) -> NDArray[np.uint8]:
    levels = np.rint(sheet * ((GREYS - 1) / 255))
    return np.asarray(np.rint(levels * (255 / (GREYS - 1))), np.uint8)
