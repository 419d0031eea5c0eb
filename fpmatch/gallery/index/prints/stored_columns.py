"""Read many stored templates at once into flat arrays, where they are plain.

A template is plain if it shows its ridges, the box around their cells is as small as can be, and no
number is outside its bounds. `unpack_template` reads the others one at a time, and
states what is wrong with a damaged one.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final
from zlib import crc32

import numpy as np

from fpmatch.gallery.store._template_column_kernel import read_cells, read_columns
from fpmatch.gallery.store.stored_template import (
    CRC,
    FIELD_HEAD,
    HEAD,
    KIND_BITS,
    MOST_BITS,
    QUALITY_BITS,
    RIDGES,
    body_bytes,
)
from fpmatch.templates.bounds import (
    ANGLE_BITS,
    DPI_UNITS,
    LEAST_STEP_PX,
    MOST_CELLS,
    MOST_PX,
    MOST_STEP_PX,
)
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI, STANDARD_DPI, MinutiaKind

if TYPE_CHECKING:
    import struct

    from numpy.typing import NDArray

    from fpmatch.gallery.store.stored_template import Layout

MOST_QUALITY: Final = 100
_TYPES: Final = {"2s": "S2", "B": "u1", "H": "<u2", "h": "<i2", "I": "<u4", "f": "<f4"}


@dataclass(frozen=True, slots=True, eq=False)
class StoredColumns:
    """The numbers of K stored templates of M minutiae and C cells, I of them inside.

    Template k has the minutiae from ``start[k]`` to ``start[k + 1]``; its cells likewise, row by
    row. Those inside the mask follow one after another, with ridges as the layout has them.
    """

    start: NDArray[np.int64]  # (K + 1,)
    columns: NDArray[np.int64]  # (5, M): x and y at 500 dpi, angle in 256ths, kind and quality
    dpi: NDArray[np.float64]  # (K,)
    cell_start: NDArray[np.int64]  # (K + 1,)
    shape: NDArray[np.int32]  # (K, 4): rows and columns, first row and first column
    step: NDArray[np.float64]  # (K,): side of a cell at 500 dpi
    mask: NDArray[np.uint8]  # (C,)
    orientation: NDArray[np.uint8]  # (I,): in 16ths of half a turn
    ridges: NDArray[np.uint8]  # (cell_bytes * I,)


def plain_columns(
    content: NDArray[np.uint8],
    start: NDArray[np.int64],
    end: NDArray[np.int64],
    layout: Layout,
    most: int,
) -> tuple[StoredColumns, NDArray[np.intp]]:
    """Read the plain ones of K templates, of `most` minutiae at most, in a layout's latest version.

    Template k has the bytes from ``start[k]`` to ``end[k]`` of `content`. Also return which of the
    templates are plain, ascending.
    """
    chosen = np.flatnonzero(_are_whole(content, start, end))
    heads = _values_at(content, start[chosen], HEAD)
    plain = _have_plain_heads(heads, layout, most)
    chosen, heads = chosen[plain], heads[plain]
    field = start[chosen] + HEAD.size + body_bytes(heads["f6"].astype(np.int64), *_bits(heads))
    plain = field + FIELD_HEAD.size + CRC.size <= end[chosen]
    chosen, heads, field = chosen[plain], heads[plain], field[plain]
    fields = _values_at(content, field, FIELD_HEAD)
    plain = _have_plain_fields(fields, _dpi(heads), end[chosen] - CRC.size - field)
    while True:
        chosen, heads, fields, field = (a[plain] for a in (chosen, heads, fields, field))
        last = end[chosen] - CRC.size
        columns, plain = _read(content, start[chosen], last, heads, fields, field, layout)
        if plain.all():
            return columns, chosen


def _are_whole(
    content: NDArray[np.uint8], start: NDArray[np.int64], end: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return which templates have a head and the right checksum."""
    whole: NDArray[np.bool_] = end - start >= HEAD.size + CRC.size
    begin, last, data = start[whole], end[whole] - CRC.size, memoryview(content)  # type: ignore[arg-type]
    of_each = zip(begin.tolist(), last.tolist(), strict=True)
    sums = np.array([crc32(data[a:b]) for a, b in of_each], np.uint32)
    whole[whole] = _values_at(content, last, CRC)["f0"] == sums
    return whole


def _values_at(content: NDArray[np.uint8], at: NDArray[np.int64], form: struct.Struct) -> Any:
    """Return the values of a `struct` format at some places, in the fields f0, f1 and so on."""
    types = [_TYPES[code] for code in re.findall(r"2s|[BHIfh]", form.format)]
    octets = content[at[:, None] + np.arange(form.size)]
    return octets.view(np.dtype([(f"f{k}", one) for k, one in enumerate(types)]))[:, 0]


def _bits(heads: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the bits of an x and of a y."""
    return heads["f9"].astype(np.int64), heads["f10"].astype(np.int64)


def _dpi(heads: Any) -> NDArray[np.float64]:
    dpi: NDArray[np.float64] = heads["f3"] / DPI_UNITS
    return dpi


def _have_plain_heads(heads: Any, layout: Layout, most: int) -> NDArray[np.bool_]:
    """Return which templates have ridges, and numbers in their heads that are within bounds."""
    dpi = _dpi(heads)
    versions = [version for version in layout.known if version >= layout.version]
    plain = (heads["f0"] == layout.magic) & np.isin(heads["f1"], versions)
    plain &= (heads["f2"] == RIDGES) & (dpi >= MIN_DPI) & (dpi <= MAX_DPI)
    plain &= (heads["f4"] > 0) & (heads["f5"] > 0) & (heads["f6"] <= most)
    within: NDArray[np.bool_] = plain & (np.maximum(*_bits(heads)) <= MOST_BITS)
    return within


def _have_plain_fields(
    fields: Any, dpi: NDArray[np.float64], left: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return which ridge fields lie within their bounds, their masks within the bytes `left`."""
    with np.errstate(invalid="ignore"):  # a step may be anything, also no number
        step, *sides = (fields[f"f{k}"].astype(np.float64) for k in range(7))
    rows, columns, top, first, height, width = sides
    plain = (rows * columns <= MOST_CELLS) & (top + height <= rows) & (first + width <= columns)
    plain &= (FIELD_HEAD.size + height * width / 8 <= left) & (height * width > 0)
    side = _side(step, dpi)
    within: NDArray[np.bool_] = plain & (side >= LEAST_STEP_PX) & (side <= MOST_STEP_PX)
    return within


def _side(step: NDArray[np.float64], dpi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the side of cells at 500 dpi, rounded as `unpack_template` rounds it."""
    zoom = STANDARD_DPI / dpi
    return step / zoom * zoom


def _read(
    content: NDArray[np.uint8],
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    heads: Any,
    fields: Any,
    field: NDArray[np.int64],
    layout: Layout,
) -> tuple[StoredColumns, NDArray[np.bool_]]:
    """Read templates with plain heads and fields, and return which are plain themselves."""
    start, bits = _starts(heads["f6"]), _bits(heads)
    columns = np.empty((5, int(start[-1])), np.int64)
    of_all = (np.full(len(heads), width) for width in (ANGLE_BITS, KIND_BITS, QUALITY_BITS))
    widths = np.stack([*bits, *of_all], axis=1)
    read_columns(content, first + HEAD.size, widths, start, columns)
    columns[:2] += np.repeat(np.stack([heads["f7"], heads["f8"]]), np.diff(start), axis=1)
    beyond = (np.abs(columns[:2]) > MOST_PX).any(axis=0)
    beyond |= (columns[3] > max(MinutiaKind)) | (columns[4] > MOST_QUALITY)
    plain = np.diff(np.concatenate([[0], np.cumsum(beyond)])[start]) == 0

    height, width = (fields[name].astype(np.int64) for name in ("f5", "f6"))
    cell_start, each = _starts(height * width), np.full(len(heads), layout.cell_bytes)
    mask, orientation = np.empty((2, int(cell_start[-1])), np.uint8)
    after, tight = np.empty(len(heads), np.int64), np.empty(len(heads), np.uint8)
    place = field + FIELD_HEAD.size, last, cell_start, width, each
    inside = read_cells(content, *place, mask, orientation, after, tight)
    plain &= (after >= 0) & (tight > 0)
    ridges = [content[a:b] for a, b in zip(after.tolist(), last.tolist(), strict=True)]
    stored = StoredColumns(
        start=start,
        columns=columns,
        dpi=_dpi(heads),
        cell_start=cell_start,
        shape=np.stack([height, width, fields["f3"], fields["f4"]], axis=1).astype(np.int32),
        step=_side(fields["f0"].astype(np.float64), _dpi(heads)),
        mask=mask,
        orientation=orientation[:inside],
        ridges=np.concatenate([np.empty(0, np.uint8), *ridges]),
    )
    return stored, plain


def _starts(lengths: NDArray[Any]) -> NDArray[np.int64]:
    """Return where parts of these lengths begin, one after another, and where the last one ends."""
    starts: NDArray[np.int64] = np.concatenate([[0], np.cumsum(lengths, dtype=np.int64)])
    return starts
