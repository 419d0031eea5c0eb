"""A print that a command was given: an image, whose template is extracted, or a template."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from fpmatch.cli.enhance import WAYS
from fpmatch.cli.polarity import POLARITIES
from fpmatch.cli.reading import read_print

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.cli.resolution import ResolutionChoice
    from fpmatch.image.assess import QualityRecorder
    from fpmatch.image.io.raw import RawSize
    from fpmatch.image.io.read import GreyImage
    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.minutiae import Template


@dataclass(frozen=True, slots=True)
class GivenPrint:
    """Hold the template of a print; of one given as an image that and its stages too."""

    path: Path
    template: Template
    image: GreyImage | None
    stages: QualityRecorder | None = None

    def quality(self) -> PrintQuality | None:
        """Return the quality of the image; None for a template."""
        return None if self.stages is None else self.stages.quality(self.template.dpi)

    def picture(self) -> GreyImage:
        """Return the image, or a white one of the template's size.

        Raises
        ------
        ImageError
            If the template tells a size too large for a picture.
        """
        if self.image is not None:
            return self.image
        import numpy as np

        from fpmatch.errors import ImageError
        from fpmatch.image.io.limits import DEFAULT_LIMITS
        from fpmatch.image.io.read import GreyImage

        width, height = self.template.width, self.template.height
        if width * height > DEFAULT_LIMITS.max_megapixels * 1e6:
            raise ImageError(f"{self.path}: {width} x {height} pixels are too many to draw")
        return GreyImage(np.full((height, width), 255, np.uint8), self.template.dpi, str(self.path))


def say_wrong_resolution(path: Path, quality: PrintQuality | None) -> None:
    """Say on stderr where the ridges of an image tell that its resolution is another one."""
    from fpmatch.image.quality.print_quality import WRONG_RESOLUTION

    for reason in quality.reasons if quality is not None else ():
        if reason.code == WRONG_RESOLUTION:
            click.echo(f"fpmatch: note: {path}: {reason}", err=True)


def open_print(
    path: Path,
    resolution: ResolutionChoice,
    dpi: float | None,
    raw: Sequence[RawSize] = (),
    enhance: str = WAYS[0],
    polarity: str = POLARITIES[0],
) -> GivenPrint:
    """Return the print in a file, at the resolution that holds.

    `enhance` is as for `extract`, `polarity` as for `read_image`.

    Raises
    ------
    FpmatchError
        If it can be read neither as a template nor as an image.
    """
    from fpmatch.image.io.read import GreyImage

    found = read_print(path, raw, polarity=polarity, dpi=dpi)
    if not isinstance(found, GreyImage):
        return GivenPrint(path, resolution.first_of(found, path, dpi), None)
    from fpmatch.image.assess import QualityRecorder
    from fpmatch.image.extract import extract

    stages = QualityRecorder()
    template = extract(found, resolution.of(found, dpi), enhance=enhance, recorder=stages)
    return GivenPrint(path, template, found, stages)
