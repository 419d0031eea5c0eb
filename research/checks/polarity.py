"""The command ``check polarity``: how often inverted images are recognised."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import click
import cv2
import numpy as np
from numpy.typing import NDArray

from fpmatch.image.extract import assess, resample
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.image.quality.polarity import CLEAR_LEVEL, background_level
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.templates.minutiae import STANDARD_DPI
from research.commands import PATH, Command, folders
from research.markdown import markdown_table, write_marked_block
from research.training.background import other_background, ridge_target

if TYPE_CHECKING:
    from pathlib import Path

BACKGROUNDS: Final = {"own": "as they are", "none": "cropped", "dark": "dark background"}
PRESETS_SHOWN: Final = ("clean", "stretched")
SEED: Final = 977

Images = Iterator[tuple[NDArray[np.uint8], NDArray[np.bool_]]]
"""Images at 500 dpi, and masks of the print in them."""


@dataclass
class Counts:
    """Count the images of one set with one background that were taken for inverted."""

    images: int = 0
    inverted: int = 0
    negatives_inverted: int = 0

    def add(self, image: NDArray[np.uint8]) -> None:
        """Count an image and its negative."""
        self.images += 1
        self.inverted += background_level(image) <= -CLEAR_LEVEL
        self.negatives_inverted += background_level(np.asarray(255 - image)) <= -CLEAR_LEVEL


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check polarity fvc/*/* --into docs/explanation/images.md
""",
)
@folders
@click.option("--into", metavar="PAGE.md", type=PATH, help="Write the table into this page.")
@click.option("--fingers", default=5, show_default=True, help="Synthetic fingers of a preset.")
@click.pass_context
def command(
    context: click.Context, folders: tuple[Path, ...], into: Path | None, fingers: int
) -> None:
    """Count the prints with dark ridges, and their negatives, that are taken for inverted.

    The images of the FVC-style databases DIR are taken as they are, as squares that the print
    fills, and with a darkened background. Synthetic prints are added. The table is printed and,
    with --into, written between the marks of a page. The exit status is 1 where more than 1 %
    of the images of a database, as they are, are taken for inverted.
    """
    head = ["prints", "background", "images", "taken for inverted", "negatives taken for inverted"]
    table, wrong = [head], False
    sets = [(load_dataset(folder).name, _database(folder)) for folder in folders]
    sets += [(f"synthetic, {name}", _synthetic(name, fingers)) for name in PRESETS_SHOWN]
    for name, images in sets:
        for background, counts in _count(images).items():
            numbers = (counts.images, counts.inverted, counts.negatives_inverted)
            table.append([name, background, *map(str, numbers)])
            wrong |= background == BACKGROUNDS["own"] and counts.inverted > 0.01 * counts.images
    click.echo(markdown_table(table))
    if into:
        write_marked_block(into, "polarity", markdown_table(table))
    context.exit(int(wrong))


def _database(folder: Path) -> Images:
    dataset = load_dataset(folder)
    for impression in dataset.impressions:
        image = read_image(impression.path, polarity="dark")
        grey, _ = resample(image.pixels, impression.dpi or image.dpi or STANDARD_DPI)
        assessed = assess(GreyImage(grey), STANDARD_DPI)
        yield grey, assessed.stages()["mask"]


def _synthetic(preset: str, fingers: int) -> Images:
    """Yield synthetic prints, each finger once on every sensor."""
    for finger in range(1, fingers + 1):
        master = make_master(SEED, finger)
        for number, sensor in enumerate(SENSORS.values(), start=1):
            made = make_impression(master, number, PRESETS[preset], sensor)
            _, inside = ridge_target(made, master)
            grey, _ = resample(made.image, sensor.dpi)
            size = grey.shape[::-1]
            mask = cv2.resize(inside.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
            yield grey, mask.astype(bool)


def _count(images: Images) -> dict[str, Counts]:
    counts = {background: Counts() for background in BACKGROUNDS}
    rng = np.random.default_rng(SEED)
    for image, inside in images:
        for background, count in counts.items():
            count.add(other_background(image, inside, background, rng))
    return {BACKGROUNDS[background]: count for background, count in counts.items()}
