"""The command ``check images``: detection of wrong resolutions."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING, Final

import click
import numpy as np

from fpmatch import Template, find_scale, verify
from fpmatch.image.extract import assess
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.templates.minutiae import STANDARD_DPI
from research.commands import PATH, Command, folders
from research.markdown import markdown_table, write_marked_block

if TYPE_CHECKING:
    from pathlib import Path

MAX_FALSE_ALARMS: Final = 0.01  # share of the pairs with correct resolutions
EVERY: Final = 7  # n-th genuine pair gets a wrong resolution
SCALES: Final = {"569": 569 / 500, "600": 600 / 500, "400": 400 / 500, "250": 0.5, "1000": 2.0}
READ_AS_500: Final = (200, 250, 300, 350, 400, 600, 700, 800, 1000)
WRONG: Final = "wrong resolution"


@dataclass
class DatabaseCheck:
    """The images and templates of one database.

    `name`: the database. `images`: its images. `doubted`: files whose correct resolution was
    doubted. `first`: the first image of each finger, and its resolution. `fingers`: the templates
    of each finger.
    """

    name: str
    images: int = 0
    doubted: list[str] = field(default_factory=list)
    first: list[tuple[GreyImage, float]] = field(default_factory=list)
    fingers: dict[int | str, list[Template]] = field(default_factory=dict)


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check images fvc/*/* --into docs/explanation/images.md
""",
)
@folders
@click.option("--into", metavar="PAGE.md", type=PATH, help="Write the tables into this page.")
@click.option("--every", default=EVERY, show_default=True, help="Every n-th pair is scaled.")
@click.pass_context
def command(
    context: click.Context, folders: tuple[Path, ...], into: Path | None, every: int
) -> None:
    """Measure how often a wrong resolution is detected, on FVC-style databases DIR.

    The first table has the pairs whose scale is found to differ: of all genuine pairs with correct
    resolutions, and of every seventh pair with a wrong resolution of the probe. The second table
    has the images whose ridge period contradicts the resolution: of all images as they are, and of
    each finger's first image at wrong resolutions. The tables are printed and, with --into, written
    between the marks of a page. The exit status is 1 where the correct resolution of an image is
    reported as wrong, or that of more than 1 % of the pairs.
    """
    checks = [read_database(folder) for folder in folders]
    for check in checks:
        for name in check.doubted:
            click.echo(f"{check.name}: {name}: the correct resolution is reported as wrong")
    prints = [prints for check in checks for prints in check.fingers.values()]
    scales, too_many = scale_table(prints, every)
    resolutions, doubted = resolution_table(checks)
    click.echo(f"{scales}\n\n{resolutions}")
    if into:
        write_marked_block(into, "scales", scales)
        write_marked_block(into, "resolutions", resolutions)
    context.exit(int(too_many or doubted))


def read_database(folder: Path) -> DatabaseCheck:
    """Assess the images of a database and extract their templates."""
    dataset = load_dataset(folder)
    check = DatabaseCheck(dataset.name)
    for impression in dataset.impressions:
        image = read_image(impression.path, polarity="dark")
        dpi = dataset.dpi or image.dpi or STANDARD_DPI
        check.images += 1
        found = assess(image, dpi)
        if any(reason.code == WRONG for reason in found.quality.reasons):
            check.doubted.append(impression.path.name)
        if impression.finger not in check.fingers:
            check.first.append((image, dpi))
        check.fingers.setdefault(impression.finger, []).append(found.template)
    return check


def scale_table(fingers: list[list[Template]], every: int) -> tuple[str, bool]:
    """Return the table of scales, and whether too many correct ones are reported as wrong."""
    pairs = [pair for prints in fingers for pair in combinations(prints, 2)]
    right = _scale_row("stated correctly", pairs, 1.0, set())
    some = pairs[::every]
    matching = {k for k, pair in enumerate(some) if verify(*pair).match}
    rows = [right, *(_scale_row(label, some, s, matching) for label, s in SCALES.items())]
    head = ["true resolution, stated as 500", "scale", "pairs", "match", "detected"]
    head += ["detected, of those that match with the correct one"]
    head += ["measured: median (5 % to 95 %)"]
    return markdown_table([head, *rows]), int(right[4]) > MAX_FALSE_ALARMS * len(pairs)


def _scale_row(
    label: str, pairs: list[tuple[Template, Template]], factor: float, matching: set[int]
) -> list[str]:
    """Return a row of the table: scales found where probes state another resolution."""
    matches, ratios = 0, {}
    for k, (probe, reference) in enumerate(pairs):
        decision = verify(replace(probe, dpi=probe.dpi / factor), reference)
        matches += decision.match
        found = find_scale(decision)
        if found is not None and found.differs:
            ratios[k] = found.ratio
    share = f"{len(matching & set(ratios))} of {len(matching)}" if matching else "–"
    counts = (str(len(pairs)), str(matches), str(len(ratios)))
    return [label, f"{1 / factor:.3f}", *counts, share, _range(list(ratios.values()), 3)]


def resolution_table(checks: list[DatabaseCheck]) -> tuple[str, bool]:
    """Return the table of resolutions by ridges, and whether correct ones are reported as wrong."""
    first = [one for check in checks for one in check.first]
    images, doubted = sum(one.images for one in checks), sum(len(one.doubted) for one in checks)
    rows = [["read correctly", str(images), str(doubted), "–"]]
    for true in READ_AS_500:
        likely = []
        for image, dpi in first:
            # 500 dpi stated as 1000 are like 250 dpi stated as 500, at twice the size
            stated = dpi * STANDARD_DPI / true
            reasons = assess(image, stated).quality.reasons
            probable = next((reason.dpi for reason in reasons if reason.code == WRONG), None)
            if probable is not None:
                likely.append(probable / stated * STANDARD_DPI)
        rows.append([str(true), str(len(first)), str(len(likely)), _range(likely, 0)])
    head = ["true resolution, read as 500", "images", "detected", "estimate: median (5 % to 95 %)"]
    return markdown_table([head, *rows]), doubted > 0


def _range(values: list[float], digits: int) -> str:
    if not values:
        return "–"
    low, middle, high = (f"{q:.{digits}f}" for q in np.percentile(values, [5, 50, 95]))
    return f"{middle} ({low} to {high})"
