"""The command ``check resolution``: how often a wrong resolution is detected."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import click
import numpy as np

from fpmatch.image.extract import assess
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.image.quality.ridge_scale import clear_period_px
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.templates.minutiae import MM_PER_INCH, STANDARD_DPI
from research.commands import PATH, Command, folders
from research.markdown import markdown_table, write_marked_block

if TYPE_CHECKING:
    from pathlib import Path

READ_AS_500: Final = (200, 250, 300, 350, 400, 600, 700, 800, 1000)
WRONG: Final = "wrong resolution"


@dataclass
class DatabaseCheck:
    """What the images of one database show.

    `images`: how many there are. `doubted`: files whose correct resolution was doubted. `first`:
    the first image of each finger, and its resolution. `logs`: logarithms of the median period of
    the ridges in millimetres, where they are clear.
    """

    name: str
    images: int = 0
    doubted: list[str] = field(default_factory=list)
    first: list[tuple[GreyImage, float]] = field(default_factory=list)
    logs: list[float] = field(default_factory=list)


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check resolution fvc/*/* --into docs/explanation/images.md
""",
)
@folders
@click.option("--into", metavar="PAGE.md", type=PATH, help="Write the second table into this page.")
@click.pass_context
def command(context: click.Context, folders: tuple[Path, ...], into: Path | None) -> None:
    """Measure how often a wrong resolution is detected, on FVC-style databases DIR.

    The first table has the distance of the ridges of each database and its deviation (of the
    logarithm). The second has the images whose ridge period contradicts the resolution: of all
    images as they are, and of each finger's first image at wrong resolutions. The exit status is 1
    where a correct resolution is reported as wrong.
    """
    checks = [read_database(folder) for folder in folders]
    for check in checks:
        for name in check.doubted:
            click.echo(f"{check.name}: {name}: the correct resolution is reported as wrong")
    table = resolution_table(checks)
    click.echo(f"{period_table(checks)}\n\n{table}")
    if into:
        write_marked_block(into, "resolutions", table)
    context.exit(int(any(check.doubted for check in checks)))


def read_database(folder: Path) -> DatabaseCheck:
    """Assess the images of a database."""
    dataset = load_dataset(folder)
    check, fingers = DatabaseCheck(dataset.name), set()
    for impression in dataset.impressions:
        image = read_image(impression.path, polarity="dark")
        dpi = impression.dpi or image.dpi or STANDARD_DPI
        check.images += 1
        if any(reason.code == WRONG for reason in assess(image, dpi).quality.reasons):
            check.doubted.append(impression.path.name)
        if (period := clear_period_px(image.pixels)) is not None:
            check.logs.append(math.log(period * MM_PER_INCH / dpi))
        if impression.finger not in fingers:
            fingers.add(impression.finger)
            check.first.append((image, dpi))
    return check


def period_table(checks: list[DatabaseCheck]) -> str:
    """Return the table of the distances of ridges, within databases and between them."""
    rows = [["database", "prints", "clear", "median, mm", "deviation"]]
    medians = [float(np.median(check.logs)) for check in checks if check.logs]
    for check in checks:
        figures = [f"{math.exp(np.median(check.logs)):.3f}", f"{np.std(check.logs):.3f}"]
        counts = [str(check.images), str(len(check.logs))]
        rows.append([check.name, *counts, *(figures if check.logs else ["–", "–"])])
    if medians:
        between = [f"{math.exp(np.median(medians)):.3f}", f"{np.std(medians):.3f}"]
        rows.append(["between databases", "", "", *between])
    return markdown_table(rows)


def resolution_table(checks: list[DatabaseCheck]) -> str:
    """Return the table of the resolutions that ridges contradict."""
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
        rows.append([str(true), str(len(first)), str(len(likely)), _range(likely)])
    head = ["true resolution, read as 500", "images", "detected", "estimate: median (5 % to 95 %)"]
    return markdown_table([head, *rows])


def _range(values: list[float]) -> str:
    if not values:
        return "–"
    low, middle, high = (f"{q:.0f}" for q in np.percentile(values, [5, 50, 95]))
    return f"{middle} ({low} to {high})"
