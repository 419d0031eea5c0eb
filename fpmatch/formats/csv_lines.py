"""Lines of minutiae as the CSV formats have them: their numbers and cells, read and written."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import LARGEST

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fpmatch.minutiae import Minutiae

DIGITS: Final = 9  # significant digits that give back the same float32


def lines_of(data: bytes) -> list[str]:
    """Return the lines of a file, or raise TemplateError where it is not UTF-8 text."""
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise TemplateError(f"not UTF-8 text (byte {error.start})") from error


def cells_of(number: int, line: str) -> list[str]:
    """Return the cells of line `number`, without the spaces around them."""
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise TemplateError(f"line {number}: {error}") from error


def places_in_words(minutiae: Minutiae) -> Iterator[str]:
    """Yield x, y and direction in degrees of each minutia, with commas between."""
    degrees = np.degrees(minutiae.angle.astype(np.float64))
    for place in zip(minutiae.x, minutiae.y, degrees, strict=True):
        yield ",".join(f"{float(value):.{DIGITS}g}" for value in place)


def numbers_of(number: int, place: Sequence[str], quality: str) -> tuple[float, ...]:
    """Return x, y, direction and quality of line `number`; TemplateError where one is no such."""
    try:
        x, y, angle, grade = map(float, [*place, quality])
    except ValueError as error:
        raise TemplateError(f"line {number}: {error}") from error
    if not all(abs(value) <= LARGEST for value in (x, y, angle)) or not 0 <= grade <= 100:
        raise TemplateError(f"line {number}: a value is not finite, or a quality not in 0..100")
    return x, y, angle, grade
