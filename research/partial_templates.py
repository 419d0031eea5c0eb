"""Parts of templates, as if only a part of the finger had touched the sensor."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import RidgeField, Template

MARGIN_PX: Final = 6.0  # minutiae this near the border of a part are not found, at 500 dpi
DISC_MARGIN_PX: Final = 8.0  # ridges beyond the outermost minutia of a fragment, at 500 dpi


def fragment(template: Template, size: int, rng: np.random.Generator) -> Template:
    """Keep a minutia drawn at random and its nearest neighbours, `size` minutiae in all."""
    m = template.minutiae
    if not len(m):
        return template
    centre = int(rng.integers(len(m)))
    distance = np.hypot(m.x - m.x[centre], m.y - m.y[centre])
    order = np.argsort(distance, kind="stable")[:size]
    kept = replace(template, minutiae=m.take(np.sort(order)))
    if template.field is None:
        return kept
    radius = float(distance[order[-1]]) + DISC_MARGIN_PX * template.dpi / STANDARD_DPI
    x, y = _block_centres(template.field)
    inside = (x - m.x[centre]) ** 2 + (y - m.y[centre]) ** 2 <= radius**2
    return replace(kept, field=_masked(template.field, inside))


def thinned(template: Template, size: int, rng: np.random.Generator) -> Template:
    """Keep `size` minutiae, drawn from all of the print, and all ridges.

    Examples
    --------
    >>> from fpmatch.templates.minutiae import Minutiae, Template
    >>> whole = Template(Minutiae(x=[10, 20, 90], y=[10, 10, 90], angle=[0, 1, 2]), 100, 100)
    >>> len(thinned(whole, 2, np.random.default_rng(1)).minutiae)
    2
    """
    m = template.minutiae
    kept = rng.choice(len(m), min(size, len(m)), replace=False)
    return replace(template, minutiae=m.take(np.sort(kept)))


def window(template: Template, side_px: float, rng: np.random.Generator) -> Template:
    """Keep what lies in an upright square of `side_px` pixels at 500 dpi."""
    px = template.dpi / STANDARD_DPI
    m, field = template.minutiae, template.field
    x, y = (m.x, m.y) if field is None else (axis[field.mask] for axis in _block_centres(field))
    if not len(x):
        return template
    k = int(rng.integers(len(x)))
    middle_x, middle_y = float(x[k]), float(y[k])
    half, margin = side_px * px / 2, MARGIN_PX * px

    def within(x: NDArray[np.floating], y: NDArray[np.floating], half: float) -> NDArray[np.bool_]:
        near: NDArray[np.bool_] = (np.abs(x - middle_x) < half) & (np.abs(y - middle_y) < half)
        return near

    kept = replace(template, minutiae=m.take(within(m.x, m.y, half - margin)))
    if field is None:
        return kept
    return replace(kept, field=_masked(field, within(*_block_centres(field), half)))


def _block_centres(field: RidgeField) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x and y of the centres of the blocks, shape (rows, columns) each."""
    y, x = (np.indices(field.mask.shape) + 0.5) * field.step
    return x, y


def _masked(field: RidgeField, inside: NDArray[np.bool_]) -> RidgeField:
    return replace(field, mask=field.mask & inside)
