"""The command ``check resolution``: how often a resolution that is not stated is found."""

from __future__ import annotations

import math
from collections import Counter
from functools import cache
from itertools import combinations
from typing import TYPE_CHECKING, Final

import click
import cv2
import numpy as np

from fpmatch.image.io.grey import GreyImage
from fpmatch.image.io.read import read_image
from fpmatch.image.quality.ridge_scale import (
    clear_period_px,
    common_dpi,
    likely_dpi,
    sensors_of,
)
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.matching.verify import DEFAULT_THRESHOLD
from fpmatch.prints.pair import verify_given
from fpmatch.prints.reading import GivenPrint, make_given_print
from fpmatch.templates.minutiae import MM_PER_INCH, STANDARD_DPI
from research.commands import PATH, Command, folders
from research.markdown import markdown_table, write_marked_block

if TYPE_CHECKING:
    from pathlib import Path

    Pair = tuple[GivenPrint, GivenPrint]

TRUE_DPI: Final = (250, 363, 500, 569, 1000)
TOLERANCE: Final = 0.03  # of a resolution: 508 and 512 dpi are 500
LOW_SCORE: Final = 20.0  # of the impostors that are counted


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check resolution fvc/*/* --into docs/explanation/images.md
""",
)
@folders
@click.option("--into", metavar="PAGE.md", type=PATH, help="Write the table into this page.")
@click.option("--impressions", default=2, show_default=True, help="Impressions of each finger.")
def command(folders: tuple[Path, ...], into: Path | None, impressions: int) -> None:
    """Measure how often the resolution of prints that state none is found.

    The prints of the FVC-style databases DIR are resampled to each usual resolution. Counted are
    those whose resolution the ridges alone indicate, and of pairs that match those whose
    resolution is right. Pairs of one finger, and each print with the first of the next finger, are
    compared as with the resolution stated, as with 500 dpi assumed, and with none; also with the
    resolution of the reference stated, which is then 500 dpi.

    A table before lists for each database the distance of its ridges, its deviation (of the
    logarithm), the resolutions that all its prints together have when theirs is withheld, and how
    many prints of 500 dpi have which resolution each alone.
    """
    together = _together(folders)
    click.echo(together)
    if into:
        write_marked_block(into, "together", together)
    rows = [_row(folders, true, impressions) for true in TRUE_DPI]
    head = ["true resolution", "prints", "right by the ridges", "500 dpi assumed"]
    head += ["pairs", "match: stated", "500 assumed", "none stated", "right at a match"]
    head += ["match with one of 500 dpi: stated", "500 assumed", "none stated", "right at a match"]
    head += [f"impostors of {LOW_SCORE:g} and more: stated", "none stated"]
    table = markdown_table([head, *rows])
    click.echo(table)
    if into:
        write_marked_block(into, "withheld", table)


def _together(folders: tuple[Path, ...]) -> str:
    """Return the table of the distances of ridges, and of the resolutions that they indicate."""
    head = ["database", "prints", "clear", "median, mm", "deviation"]
    rows = [[*head, *(f"withheld {dpi} dpi" for dpi in TRUE_DPI), "each alone, withheld 500 dpi"]]
    medians = []
    for folder in folders:
        at = {dpi: [one for of in _images(folder, dpi) for one in of] for dpi in TRUE_DPI}
        periods = {dpi: _clear_periods(images) for dpi, images in at.items()}
        standard = int(STANDARD_DPI)
        logs = np.log(np.array(periods[standard]) * MM_PER_INCH / STANDARD_DPI)
        medians.append(float(np.median(logs)))
        found = [" and ".join(f"{common_dpi(p):g}" for p in sensors_of(periods[d])) for d in at]
        numbers = [str(len(at[standard])), str(len(logs))]
        figures = [f"{math.exp(medians[-1]):.3f}", f"{logs.std():.3f}"]
        alone = Counter(likely_dpi(image.pixels) for image in at[standard])
        each = ", ".join(f"{count} of {dpi:g}" for dpi, count in alone.most_common())
        rows.append([load_dataset(folder).name, *numbers, *figures, *found, each])
    spread = [f"{math.exp(np.median(medians)):.3f}", f"{np.std(medians):.3f}"]
    rows.append(["between databases", "", "", *spread, *[""] * (len(TRUE_DPI) + 1)])
    return markdown_table(rows)


def _clear_periods(images: list[GreyImage]) -> list[float]:
    periods = (clear_period_px(image.pixels) for image in images)
    return [period for period in periods if period is not None]


def _row(folders: tuple[Path, ...], true: int, impressions: int) -> list[str]:
    """Return the row of one resolution."""
    sizes: dict[int, list[list[list[GivenPrint]]]] = {
        dpi: [_fingers(folder, dpi, impressions) for folder in folders]
        for dpi in {true, int(STANDARD_DPI)}
    }
    ours, at_500 = sizes[true], sizes[int(STANDARD_DPI)]
    prints = [print_ for fingers in ours for of in fingers for print_ in of]
    right = sum(_is_right(print_, true) for print_ in prints)
    assumed = sum(print_.dpi_assumed for print_ in prints)
    genuine, mixed, impostors = [], [], []
    for fingers, others in zip(ours, at_500, strict=True):
        for finger, of in enumerate(fingers):
            genuine += list(combinations(of, 2))
            mixed += [(of[k], others[finger][m]) for k, m in combinations(range(len(of)), 2)]
            impostors += [(one, fingers[(finger + 1) % len(fingers)][0]) for one in of]
    row = [str(true), *map(str, (len(prints), right, assumed, len(genuine)))]
    for pairs, reference_dpi in ((genuine, None), (mixed, STANDARD_DPI)):
        stated = sum(
            _score(pair, true, reference_dpi or true) >= DEFAULT_THRESHOLD for pair in pairs
        )
        as_500 = sum(
            _score(pair, STANDARD_DPI, STANDARD_DPI) >= DEFAULT_THRESHOLD for pair in pairs
        )
        unstated = [verify_given(pair[0], _at(pair[1], reference_dpi)) for pair in pairs]
        matches = [one for one in unstated if one.verification.match]
        is_right = sum(
            _is_right(one.probe, true) and _is_right(one.reference, reference_dpi or true)
            for one in matches
        )
        row += [str(number) for number in (stated, as_500, len(matches), is_right)]
    as_stated = [_score(pair, true, true) >= LOW_SCORE for pair in impostors]
    none = [verify_given(*pair, threshold=LOW_SCORE).verification.match for pair in impostors]
    _at.cache_clear()  # of prints with their stages
    return [*row, f"{np.mean(as_stated):.2%}", f"{np.mean(none):.2%}"]


def _fingers(folder: Path, dpi: int, impressions: int) -> list[list[GivenPrint]]:
    """Return the first prints of each finger, resampled and without their resolution."""
    return [
        [make_given_print(image, image.source) for image in of]
        for of in _images(folder, dpi, impressions)
    ]


def _images(folder: Path, dpi: int, impressions: int | None = None) -> list[list[GreyImage]]:
    """Return the first images of each finger (default: all), resampled, without resolution."""
    dataset = load_dataset(folder)
    fingers: dict[int | str, list[GreyImage]] = {}
    for impression in dataset.impressions:
        of = fingers.setdefault(impression.finger, [])
        if len(of) == impressions:
            continue
        image = read_image(impression.path, polarity="dark", dpi=dataset.dpi)
        zoom = dpi / (dataset.dpi or image.dpi or STANDARD_DPI)
        how = cv2.INTER_AREA if zoom < 1 else cv2.INTER_CUBIC
        pixels = cv2.resize(image.pixels, None, fx=zoom, fy=zoom, interpolation=how)
        of.append(GreyImage(np.asarray(pixels, np.uint8), source=impression.path.name))
    return list(fingers.values())


def _is_right(print_: GivenPrint, true: float) -> bool:
    return abs(print_.template.dpi / true - 1) < TOLERANCE


@cache
def _at(print_: GivenPrint, dpi: float | None) -> GivenPrint:
    """Return a print with its resolution stated, or as it is."""
    if dpi is None or print_.image is None:
        return print_
    return make_given_print(print_.image, print_.name, dpi=dpi)


def _score(pair: Pair, probe_dpi: float, reference_dpi: float) -> float:
    sides = _at(pair[0], probe_dpi), _at(pair[1], reference_dpi)
    return verify_given(*sides).verification.score
