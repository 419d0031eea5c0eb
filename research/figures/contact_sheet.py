"""The command ``contact-sheet``: prints on one page, all at one scale, to compare by eye."""

from __future__ import annotations

from itertools import accumulate, zip_longest
from typing import TYPE_CHECKING, Final, NamedTuple

import click
import cv2
import numpy as np

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.drawing.scene.fonts import wrapped
from fpmatch.drawing.scene.items import Item, Path, Pen, Text
from fpmatch.drawing.scene.palette import PANEL_EDGE, TEXT_MUTED
from fpmatch.drawing.scene.raster import paint_over, png_bytes
from fpmatch.image.io.read import read_image
from fpmatch.lab.evaluation.databases.dataset import with_unique_names
from fpmatch.lab.evaluation.run import load_datasets
from fpmatch.templates.minutiae import STANDARD_DPI, check_dpi
from research.commands import PATH, Command, folders

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path as FilePath

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.dataset import Dataset

DEFAULT_DPI: Final = 250.0  # of the sheet: half of what most sensors give
GREYS: Final = 64  # the eye sees no difference, and the file is a third smaller
_GAP: Final = 14
_CAPTION_SIZE: Final = 12.0
_LEADING: Final = 15
_PAPER: Final = 255
_EDGE: Final = Pen(PANEL_EDGE, width=1.0)


class PrintTile(NamedTuple):
    """One print of a sheet: its picture (H, W), its resolution, and what to write below it."""

    pixels: NDArray[np.uint8]
    dpi: float
    caption: str = ""


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research contact-sheet fvc/fvc2002/* -o sheet.png
""",
)
@folders
@click.option("-o", "--out", type=PATH, required=True, help="The PNG file to write.")
@click.option(
    "--each", "count", type=click.IntRange(1), default=6, show_default=True,
    help="Prints of a database.",
)  # fmt: skip
@click.option("--across", is_flag=True, help="A column a database, not a row.")
@click.option("--others", is_flag=True, help="Other fingers of every database.")
@click.option("--dpi", default=DEFAULT_DPI, show_default=True, help="Resolution of the sheet.")
def command(
    folders: tuple[FilePath, ...], out: FilePath, count: int, across: bool, others: bool, dpi: float
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


def print_sheet(
    rows: Sequence[Sequence[PrintTile]], *, dpi: float = DEFAULT_DPI
) -> NDArray[np.uint8]:
    """Draw prints row by row, at one scale, each above its caption; rows may differ in length."""
    check_dpi(dpi)
    sizes = [[_size_at(tile, dpi) for tile in row] for row in rows]
    widths = [max(w for w, _ in column) for column in zip_longest(*sizes, fillvalue=(0, 0))]
    captions = [
        [
            wrapped(tile.caption, _CAPTION_SIZE, width)
            for tile, width in zip(row, widths, strict=False)
        ]
        for row in rows
    ]
    heights = [
        max((height for _, height in row), default=0) + _LEADING * max(map(len, lines), default=0)
        for row, lines in zip(sizes, captions, strict=True)
    ]
    lefts = list(accumulate((width + _GAP for width in widths), initial=_GAP))
    tops = list(accumulate((height + _GAP for height in heights), initial=_GAP))
    page = np.full((tops[-1], lefts[-1]), _PAPER, np.uint8)
    items: list[Item] = []
    for row, row_sizes, lines, y in zip(rows, sizes, captions, tops, strict=False):
        for tile, (width, height), caption, x in zip(row, row_sizes, lines, lefts, strict=False):
            page[y : y + height, x : x + width] = _scaled(tile.pixels, (width, height))
            corners = ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
            items.append(Path(corners, _EDGE, closed=True))
            items += [
                Text(x, y + height + n * _LEADING, line, _CAPTION_SIZE, TEXT_MUTED)
                for n, line in enumerate(caption, start=1)
            ]
    painted = paint_over(np.repeat(page[:, :, None], 3, axis=2), tuple(items))
    return np.asarray(cv2.cvtColor(painted, cv2.COLOR_RGB2GRAY), np.uint8)


def _size_at(tile: PrintTile, dpi: float) -> tuple[int, int]:
    """Return the width and height of a print on a sheet of this resolution."""
    height, width = tile.pixels.shape
    return max(round(width * dpi / tile.dpi), 1), max(round(height * dpi / tile.dpi), 1)


def _scaled(pixels: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    shrinks = size[0] < pixels.shape[1]
    interpolation = cv2.INTER_AREA if shrinks else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(pixels, size, interpolation=interpolation), np.uint8)


def _with_fewer_greys(sheet: NDArray[np.uint8]) -> NDArray[np.uint8]:
    levels = np.rint(sheet * ((GREYS - 1) / 255))
    return np.asarray(np.rint(levels * (255 / (GREYS - 1))), np.uint8)
