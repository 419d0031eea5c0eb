"""Bounds on the numbers of a template, and the whole numbers in which a gallery keeps minutiae.

Lengths are bounded at 500 dpi, where templates are compared. The bounds are far beyond any finger:
32,767 pixels are 1.66 m. Within them no number overflows float32, or an index in a kernel.
The area is bounded too, as whatever draws a print needs memory for its pixels.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Template

MOST_PX: Final = 2**15 - 1  # of a minutia from the origin, to either side, at 500 dpi
MOST_SIDE_PX: Final = 2**16 - 1  # of width and height, in pixels of the image
MOST_MEGAPIXELS: Final = 64.0  # of an image
MOST_MEGAPIXELS_AT_500_DPI: Final = 16.0  # of four palms
MOST_MINUTIAE: Final = 2**16 - 1
MOST_CELLS: Final = 2**20  # of a ridge field
LEAST_STEP_PX: Final = 0.1  # side of a cell at 500 dpi
MOST_STEP_PX: Final = 10_000.0
ANGLE_BITS: Final = 8
DPI_UNITS: Final = 1000
LEAST_UNIQUE: Final = 4  # minutiae; the rounded ones of different prints may be equal if fewer


def _beyond(message: str) -> TemplateError:
    return TemplateError(message, code="bounds")


def check_bounds(template: Template) -> None:
    """Raise TemplateError if a number of a template is outside its bounds."""
    zoom = STANDARD_DPI / template.dpi
    for name, article in (("x", "an"), ("y", "a")):
        values = getattr(template.minutiae, name)
        # pixel centres stay such at 500 dpi, where positions are kept as whole pixels
        scaled = np.abs((values.astype(np.float64) + 0.5) * zoom - 0.5)
        if not scaled.max(initial=0.0) < MOST_PX + 0.5:
            farthest = values[scaled.argmax()]
            raise _beyond(
                f"minutiae: {article} {name} of {farthest:g} is beyond {MOST_PX} pixels at 500 dpi"
            )
    if len(template.minutiae) > MOST_MINUTIAE:
        raise _beyond(f"more than {MOST_MINUTIAE} minutiae in one print")
    check_area(template)
    field = template.field
    if field is None:
        return
    if field.mask.size > MOST_CELLS or max(field.mask.shape) > MOST_SIDE_PX:
        raise _beyond(f"ridge_field: more than {MOST_CELLS} cells, or too many in a row")
    if not LEAST_STEP_PX <= field.step * zoom <= MOST_STEP_PX:
        raise _beyond(
            f"ridge_field: a step of {field.step:g} pixels is outside "
            f"{LEAST_STEP_PX:g} to {MOST_STEP_PX:g} at 500 dpi"
        )


def check_area(template: Template) -> None:
    """Raise TemplateError if a template has too many pixels, or too many in a row."""
    if max(template.width, template.height) > MOST_SIDE_PX:
        raise _beyond(f"a side of the print has more than {MOST_SIDE_PX} pixels")
    most = most_megapixels(template.dpi)
    if template.width * template.height > most * 1e6:
        size = f"{template.width} x {template.height} pixels at {template.dpi:g} dpi"
        raise _beyond(f"a print of {size} is too large: more than {most:.3g} megapixels")


def most_megapixels(dpi: float) -> float:
    """Return the largest area of a print: that of four palms, and at a low resolution as at 500."""
    zoom = max(1.0, dpi / STANDARD_DPI)
    return min(MOST_MEGAPIXELS, MOST_MEGAPIXELS_AT_500_DPI * zoom**2)


def check_cells(rows: int, columns: int) -> None:
    """Raise TemplateError unless a ridge field may have so many cells, before memory is taken."""
    if rows < 1 or columns < 1:
        raise _beyond("ridge_field: rows and columns must be positive")
    if rows * columns > MOST_CELLS:
        raise _beyond(f"ridge_field: more than {MOST_CELLS} cells")


def rounded_dpi(template: Template) -> int:
    """Return the resolution in thousandths."""
    return round(template.dpi * DPI_UNITS)


def rounded_minutiae(template: Template) -> NDArray[np.int64]:
    """Return x, y, angle, kind and quality of minutiae in bounds as whole numbers, shape (5, N).

    Positions are in pixels at 500 dpi, where pixel centres stay such; angles in 256ths of a turn.
    """
    m, zoom = template.minutiae, STANDARD_DPI / (rounded_dpi(template) / DPI_UNITS)
    columns = np.empty((5, len(m)), np.int64)
    for values, column in zip((m.x, m.y), columns, strict=False):
        column[:] = np.rint((values.astype(np.float64) + 0.5) * zoom - 0.5)
    columns[2] = np.rint(m.angle * (2**ANGLE_BITS / (2 * np.pi)))
    columns[2] %= 2**ANGLE_BITS
    columns[3], columns[4] = m.kind, m.quality
    return columns


def have_same_minutiae(a: Template, b: Template) -> bool:
    """Return whether two templates have the same frame and minutiae, as a gallery keeps them.

    False where a gallery cannot, or where they are so few that those of other prints may be equal.
    """
    if len(a.minutiae) != len(b.minutiae) or len(a.minutiae) < LEAST_UNIQUE:
        return False
    if (rounded_dpi(a), a.width, a.height) != (rounded_dpi(b), b.width, b.height):
        return False
    try:
        check_bounds(a)
        check_bounds(b)
    except TemplateError:
        return False
    return np.array_equal(rounded_minutiae(a), rounded_minutiae(b))
