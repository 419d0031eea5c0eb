"""Partial probes: square windows of prints, like those of a small sensor."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.gallery.batch.comparer import NO_TEMPLATE
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.lab.evaluation.databases.extraction import extract_image
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from fpmatch.formats.record import TemplateRecord
    from fpmatch.gallery.listing.prints import ExtractedPrint
    from fpmatch.lab.evaluation.databases.extraction import Extractor
    from fpmatch.lab.evaluation.report.results import SetResult
    from fpmatch.templates.minutiae import Template


def crop_about_centroid(image: GreyImage, template: Template, side_px: float) -> GreyImage:
    """Cut a square about the centroid of a print out of its image; the side is as for `crop_at`.

    The mask of the template's ridge field, else its minutiae, give the area of the print; with
    neither there is an `ImageError`.
    """
    return crop_at(image, *_centroid(image, template), side_px, template.dpi)


def crop_at(image: GreyImage, x: float, y: float, side_px: float, dpi: float) -> GreyImage:
    """Cut a square with its middle at (x, y), in pixels of the image, out of an image of `dpi`.

    The side is in pixels at 500 dpi. The square is moved inwards where it would reach beyond the
    image, and smaller where the image is narrower.
    """
    side = max(1, round(side_px * dpi / STANDARD_DPI))
    height, width = image.pixels.shape
    left, top = (
        int(np.clip(round(middle - side / 2), 0, max(0, length - side)))
        for middle, length in ((x, width), (y, height))
    )
    pixels = np.ascontiguousarray(image.pixels[top : top + side, left : left + side])
    return replace(image, pixels=pixels)


def _centroid(image: GreyImage, template: Template) -> tuple[float, float]:
    field = template.field
    if field is not None and field.mask.any():
        rows, columns = np.nonzero(field.mask)
        return float((columns.mean() + 0.5) * field.step), float((rows.mean() + 0.5) * field.step)
    if len(template.minutiae):
        return float(template.minutiae.x.mean()), float(template.minutiae.y.mean())
    raise ImageError(f"{image.source}: no print found that a square could be cut out of")


def extract_crop(
    path: Path,
    dpi: float | None,
    side_px: float,
    enhance: str | None = None,
    reader: Callable[[Path], GreyImage | TemplateRecord] = read_image,
) -> ExtractedPrint:
    """Extract a template from a square of an image file; see `crop_about_centroid`."""
    image = reader(path)
    if not isinstance(image, GreyImage):
        raise ImageError("a template has no image to cut a square out of", path=path)
    whole = extract_image(path, dpi, enhance, lambda _: image)
    square = crop_about_centroid(image, whole.template, side_px)
    return replace(whole, template=extract_image(path, dpi, enhance, lambda _: square).template)


def crop_extractor_of(
    side_px: float, enhance: str, reader: Callable[[Path], GreyImage | TemplateRecord] = read_image
) -> Extractor:
    """Return what extracts a template from a square of an image file."""
    return partial(extract_crop, side_px=side_px, enhance=enhance, reader=reader)


def failed_crops(sets: Sequence[SetResult]) -> list[Path]:
    """List the images whose square gave no template though the whole print did."""
    paths = []
    for row in sets:
        there = np.array([e.template is not None for e in row.extracted.extractions])
        pairs, reason = row.pairs, row.outcomes["reason"]
        both = there[pairs.probe] & there[pairs.reference]
        failed = np.unique(pairs.probe[both & (reason == NO_TEMPLATE)])
        paths += [row.extracted.dataset.impressions[k].path for k in failed.tolist()]
    return paths
