"""Prepare many compact templates at a time: with the result of `prepare`, but faster."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.compact_template import LAYOUT
from fpmatch.matching.prints.prepare import (
    PreparationParameters,
    describe,
    points_at_500dpi,
    prepare,
    qualities,
)
from fpmatch.matching.prints.prepared_prints import PreparedPrints, inside_counts
from fpmatch.matching.prints.print_area import PrintAreas
from fpmatch.matching.prints.ridge_samples import restore_all
from fpmatch.matching.quantization import orientation_codes, root_weight_codes
from fpmatch.templates.minutiae import STANDARD_DPI
from fpmatch.templates.stored_columns import plain_columns
from fpmatch.templates.stored_template import ANGLES, STEPS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.compact_template import CompactTemplates
    from fpmatch.templates.stored_columns import StoredColumns

PRINTS_AT_ONCE: Final = 256  # whose arrays take a few megabytes
_CODES: Final = orientation_codes(STEPS, np.ones(len(STEPS), bool))  # of ridge orientations


def prepare_compact(templates: CompactTemplates, which: NDArray[np.integer]) -> PreparedPrints:
    """Prepare some compact templates, by their numbers: the same as to pack what `prepare` makes.

    Raises
    ------
    IndexError
        If a number is that of no print.
    TemplateError
        If a template is damaged.
    """
    numbers = np.asarray(which, np.int64)
    if len(numbers) and not 0 <= numbers.min() <= numbers.max() < len(templates):
        raise IndexError(f"a print outside of {len(templates)}")
    parts = [
        _prepared_part(templates, numbers[k : k + PRINTS_AT_ONCE])
        for k in range(0, len(numbers), PRINTS_AT_ONCE)
    ]
    return PreparedPrints.concatenate(parts)


def _prepared_part(templates: CompactTemplates, which: NDArray[np.int64]) -> PreparedPrints:
    """Prepare a few prints, those that are not plain one by one."""
    start, most = templates.content_start, PreparationParameters().max_minutiae
    columns, plain = plain_columns(templates.content, start[which], start[which + 1], LAYOUT, most)
    prepared = _prepared(columns)
    if len(plain) == len(which):
        return prepared
    others = np.setdiff1d(np.arange(len(which)), plain)
    rest = PreparedPrints.pack(prepare(templates[k]) for k in which[others].tolist())
    joined = PreparedPrints.concatenate([prepared, rest])
    return joined.take(np.argsort(np.concatenate([plain, others])))


def _prepared(given: StoredColumns) -> PreparedPrints:
    """Prepare prints of no more minutiae than take part."""
    n, zoom = np.diff(given.start), STANDARD_DPI / given.dpi
    x, y, angle, _, hundredths = given.columns
    of_each = zoom.repeat(n)
    xy = ((np.stack([x, y]) + 0.5) / of_each - 0.5).astype(np.float32)  # in the image's pixels
    points = points_at_500dpi(xy[0], xy[1], ANGLES[angle], of_each.astype(np.float32))
    usual = PreparationParameters().usual_quality
    quality = qualities(hundredths.astype(np.uint8), given.start, usual)
    areas = _areas(given)
    described, (direction_bin, neighbour_bits, orientation_bins) = describe(
        points, quality, given.start, areas
    )
    columns = np.ascontiguousarray(points.T, np.float32)
    return PreparedPrints(
        minutiae_start=given.start,
        cell_start=given.cell_start,
        xy=np.ascontiguousarray(columns[:, :2]),
        direction=np.ascontiguousarray(columns[:, 2:]),
        quality=np.rint(quality * 100.0).astype(np.uint8),
        index=(np.arange(len(x)) - given.start[:-1].repeat(n)).astype(np.int32),
        count=described.count.astype(np.uint8),
        neighbour=described.neighbour.astype(np.uint8),
        root_weight=root_weight_codes(described.frame[:, 5]),
        direction_bin=direction_bin,
        neighbour_bits=neighbour_bits,
        orientation_bins=orientation_bins,
        cell=areas.code,
        ridges=restore_all(
            given.ridges, given.orientation, given.mask, given.cell_start, given.shape
        ),
        shape=areas.shape,
        step=areas.step,
        to_500dpi=zoom,
        has_flow=areas.has_flow,
        has_ridges=areas.has_flow,
        inside=inside_counts(given.mask, given.cell_start),
    )


def _areas(given: StoredColumns) -> PrintAreas:
    """Return the print areas of compact templates, as `area_of_field` does."""
    code = np.zeros(len(given.mask), np.uint8)
    code[given.mask.view(bool)] = _CODES[given.orientation]
    known = np.ones(len(given.dpi), np.uint8)
    return PrintAreas(given.cell_start, code, given.shape, given.step, known)
