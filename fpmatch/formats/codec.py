"""`Codec`, the interface of a format to the registry, and the conversions that formats share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.printable import count

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
    from fpmatch.templates.minutiae import Minutiae, Template


@dataclass(frozen=True, slots=True)
class Codec:
    """Read and write one template file format.

    Parameters
    ----------
    name : str
        Name of the format, as the command line takes it.
    title : str
        Full name, for messages and tables.
    suffixes : tuple of str
        File suffixes, with the dot, in lower case; files are written with the first.
    recognises : callable
        Whether a file's bytes, or its first few thousand, are of this format.
    decode : callable
        Converts bytes to a TemplateRecord under `ReadingOptions`; raises an `FpmatchError` that
        names the reason (and the line, in text formats) but not the file.
    encode : callable or None
        Converts a TemplateRecord to bytes, always the same for the same record. None for formats
        that are only read.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    decode: Callable[[bytes, ReadingOptions], TemplateRecord]
    encode: Callable[[TemplateRecord], Encoded] | None = None


def dropped_notes(view: View, *, field: bool = False) -> list[str]:
    """Return notes on dropped extended data and, if `field`, a dropped ridge field."""
    notes = ["the ridge field dropped"] if field and view.template.field is not None else []
    if view.extended is not None:
        notes.append(f"extended data of {view.extended.layout} dropped")
    return notes


def fit_minutiae(template: Template, most: int, notes: list[str]) -> Minutiae:
    """Return the minutiae of a template that a format can hold, in their order.

    Minutiae outside the image are dropped; then, if more than `most` are left, those of lowest
    quality, of equal ones the later. Each reason adds a line to `notes`.
    """
    minutiae = template.minutiae
    sides = np.array([template.width, template.height])
    inside = ((minutiae.xy >= -0.5) & (minutiae.xy <= sides)).all(axis=1)
    if not inside.all():
        outside = count(int(np.count_nonzero(~inside)), "minutia", "minutiae")
        notes.append(f"{outside} outside the print dropped")
        minutiae = minutiae.take(inside)
    if len(minutiae) > most:
        dropped = count(len(minutiae) - most, "minutia", "minutiae")
        notes.append(f"{dropped} of lowest quality dropped: {most} fit in")
        best = np.argsort(-minutiae.quality.astype(np.int32), kind="stable")[:most]
        minutiae = minutiae.take(np.sort(best))
    return minutiae


def span(x: NDArray[Any], y: NDArray[Any]) -> tuple[int, int]:
    """Return width and height of the smallest image from 0 that contains positions."""
    width, height = (int(np.clip(values.max(initial=0), 0, 2**31)) + 1 for values in (x, y))
    return width, height


def whole_steps(angle: NDArray[np.float32], steps: int) -> NDArray[np.int64]:
    """Return angles in radians, rounded to `steps` equal steps of a turn."""
    turns = angle.astype(np.float64) / (2 * np.pi)
    return np.mod(np.rint(turns * steps), steps).astype(np.int64)
