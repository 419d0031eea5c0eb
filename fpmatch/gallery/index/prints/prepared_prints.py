"""Prepared prints, many of them in flat arrays, so that one probe is compared with all at once."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints._prepared_view_kernel import PreparedView
from fpmatch.gallery.store.array_file import Column
from fpmatch.matching.constants.prints import NEIGHBOUR_WORDS, ORIENTATION_WORDS
from fpmatch.matching.parameters import USUAL
from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
from fpmatch.matching.prints.prepared import (
    ROOT_WEIGHTS,
    BitDescriptors,
    Neighbourhoods,
    PreparedTemplate,
    PrintArea,
    content_key,
    root_weight_codes,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

MAX_MINUTIAE: Final = 256  # of a print, that a byte can number
# dimensions: one entry a print; one more than that. Others have the name of the array of starts.
PRINT: Final = "print"
START: Final = "start"

Prints = TypeVar("Prints", bound="PrintArrays")
PRINTS_AT_ONCE: Final = 1024  # put into arrays before these are joined
_SIZE: Final = USUAL.neighbours
QUALITIES: Final = np.arange(256) / 100.0  # of a minutia, whose steps are the template's own
# dimensions of entries that are of a minutia, or of a cell, of all prints
MINUTIA: Final = "minutiae_start"
CELL: Final = "cell_start"


def of_each(what: str, dtype: str, *shape: int) -> dict[str, Column]:
    """Return of what the entries of an array are, its type, and the shape of an entry."""
    return {"column": Column(dtype, (what, *shape))}


class PrintArrays:
    """Base of dataclasses whose fields are the arrays of many prints, one print after the other.

    A field of the dimension `START` has the first entry of each print, and the end of the last one,
    in all arrays of the dimension that has its name.
    """

    @classmethod
    def columns(cls) -> dict[str, Column]:
        """Return what each array must be, for `fpmatch.gallery.store.array_file`."""
        return {f.name: f.metadata["column"] for f in fields(cls)}  # type: ignore[arg-type]

    @classmethod
    def concatenate(cls: type[Prints], parts: Sequence[Prints]) -> Prints:
        """Return the prints of all `parts`, one after the other: of one, itself."""
        if len(parts) == 1:
            return parts[0]
        joined: dict[str, Any] = {}
        for name, column in cls.columns().items():
            arrays = [getattr(part, name) for part in parts] or [_no_entries(column)]
            if column.shape[0] == START:
                ends = np.cumsum([0, *(int(array[-1]) for array in arrays)])
                moved = [a[:-1] + end for a, end in zip(arrays, ends, strict=False)]
                joined[name] = np.concatenate([*moved, ends[-1:]]).astype(column.dtype, copy=False)
            else:
                joined[name] = np.concatenate(arrays)
        return cls(**joined)

    def take(self: Prints, which: NDArray[np.integer]) -> Prints:
        """Return a copy of the prints with the numbers `which`, shape (K,), in this order."""
        columns = self.columns()
        entries: dict[str, NDArray[np.integer]] = {PRINT: which}
        taken: dict[str, Any] = {}
        for starts in [name for name, column in columns.items() if column.shape[0] == START]:
            begin = getattr(self, starts)[which]
            length = getattr(self, starts)[which + 1] - begin
            taken[starts] = np.concatenate([[0], np.cumsum(length)]).astype(columns[starts].dtype)
            entries[starts] = np.repeat(begin - taken[starts][:-1], length)
            entries[starts] += np.arange(length.sum())
        taken |= {
            name: getattr(self, name)[entries[str(column.shape[0])]]
            for name, column in columns.items()
            if name not in taken
        }
        return type(self)(**taken)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(self.arrays().values())

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays by name."""
        return {name: getattr(self, name) for name in self.columns()}


def _no_entries(column: Column) -> NDArray[Any]:
    """Return an array of no prints."""
    return np.zeros((int(column.shape[0] == START), *map(int, column.shape[1:])), column.dtype)


@dataclass(frozen=True, eq=False)
class PreparedPrints(PrintArrays):
    """Prepared prints in flat arrays, with an entry for each minutia, each cell or each print.

    Print k has the minutiae from ``minutiae_start[k]`` to ``minutiae_start[k + 1]``, and its cells
    likewise, row by row. Its `shape` has rows and columns, first row and first column of the cells,
    `inside` the number of those inside the print area. Positions are in px at 500 dpi, y pointing
    up. Qualities, and the square roots of the weights of neighbours, are in hundredths; neighbours
    are numbered from the print's first minutia. Where `has_flow` or `has_ridges` is 0, the
    orientation, or the binary images of the ridges, are not known.
    """

    minutiae_start: NDArray[np.int64] = field(metadata=of_each(START, "<i8"))
    cell_start: NDArray[np.int64] = field(metadata=of_each(START, "<i8"))
    xy: NDArray[np.float32] = field(metadata=of_each(MINUTIA, "<f4", 2))
    direction: NDArray[np.float32] = field(metadata=of_each(MINUTIA, "<f4", 2))
    quality: NDArray[np.uint8] = field(metadata=of_each(MINUTIA, "|u1"))
    index: NDArray[np.int32] = field(metadata=of_each(MINUTIA, "<i4"))
    count: NDArray[np.uint8] = field(metadata=of_each(MINUTIA, "|u1"))
    neighbour: NDArray[np.uint8] = field(metadata=of_each(MINUTIA, "|u1", _SIZE))
    root_weight: NDArray[np.uint8] = field(metadata=of_each(MINUTIA, "|u1", _SIZE))
    direction_bin: NDArray[np.uint8] = field(metadata=of_each(MINUTIA, "|u1"))
    neighbour_bits: NDArray[np.uint16] = field(metadata=of_each(MINUTIA, "<u2", NEIGHBOUR_WORDS))
    orientation_bins: NDArray[np.uint8] = field(metadata=of_each(MINUTIA, "|u1", ORIENTATION_WORDS))
    cell: NDArray[np.uint8] = field(metadata=of_each(CELL, "|u1"))
    ridges: NDArray[np.uint64] = field(metadata=of_each(CELL, "<u8"))
    shape: NDArray[np.int32] = field(metadata=of_each(PRINT, "<i4", 4))
    step: NDArray[np.float64] = field(metadata=of_each(PRINT, "<f8"))
    to_500dpi: NDArray[np.float64] = field(metadata=of_each(PRINT, "<f8"))
    has_flow: NDArray[np.uint8] = field(metadata=of_each(PRINT, "|u1"))
    has_ridges: NDArray[np.uint8] = field(metadata=of_each(PRINT, "|u1"))
    inside: NDArray[np.int32] = field(metadata=of_each(PRINT, "<i4"))

    @classmethod
    def pack(cls, prints: Iterable[PreparedTemplate]) -> PreparedPrints:
        """Put prepared prints, which `prepare` made with its default parameters, into arrays.

        Raises MatcherError if a print has more than 256 minutiae.
        """
        left = iter(prints)
        joined: list[PreparedPrints] = []
        while few := list(islice(left, PRINTS_AT_ONCE)):
            joined.append(_packed(few))
        return cls.concatenate(joined)

    def __len__(self) -> int:
        return len(self.step)

    @cached_property
    def most_minutiae(self) -> int:
        """The most minutiae of a print."""
        return int(np.diff(self.minutiae_start).max(initial=0))

    @cached_property
    def view(self) -> PreparedView:
        """The prints as the kernels see them."""
        p = USUAL
        return PreparedView(self, QUALITIES, ROOT_WEIGHTS, (p.tolerance_px, p.tolerance_per_px))

    def __getitem__(self, k: int) -> PreparedTemplate:
        """Return print k as `prepare` made it."""
        if not 0 <= k < len(self):
            raise IndexError(f"print {k} of {len(self)}")
        minutiae = slice(*self.minutiae_start[k : k + 2].tolist())
        n = minutiae.stop - minutiae.start
        neighbourhoods = Neighbourhoods(
            count=np.zeros(n, np.int32),
            neighbour=self.neighbour[minutiae].astype(np.int32),
            frame=np.zeros((n, 6, self.neighbour.shape[1]), np.float32),
        )
        points, quality = np.zeros((4, n)), np.zeros(n)
        view = TemplateView(points, quality, neighbourhoods.count, neighbourhoods.frame)
        self.view.open(k, view)
        self.view.unpack(k, view)
        rows, columns, first_row, first_column = self.shape[k].tolist()
        cells = slice(*self.cell_start[k : k + 2].tolist())
        code = self.cell[cells].reshape(rows, columns)
        ridges = self.ridges[cells].reshape(rows, columns) if self.has_ridges[k] else None
        known = bool(self.has_flow[k])
        region = PrintArea(float(self.step[k]), code, first_row, first_column, known, ridges)
        return PreparedTemplate(
            points=points,
            quality=quality,
            index=self.index[minutiae],
            neighbourhoods=neighbourhoods,
            region=region,
            bit_descriptors=BitDescriptors(
                self.xy[minutiae],
                self.direction_bin[minutiae],
                self.neighbour_bits[minutiae],
                self.orientation_bins[minutiae],
                known,
            ),
            to_500dpi=float(self.to_500dpi[k]),
            key=content_key(points, quality, region),
        )


COLUMNS: Final = PreparedPrints.columns()


def _packed(prints: Sequence[PreparedTemplate]) -> PreparedPrints:
    """Return some prints, one at least."""
    n, cells = [len(print_) for print_ in prints], [p.region.code.size for p in prints]
    if max(n) > MAX_MINUTIAE:
        raise MatcherError(f"a print of {max(n)} minutiae; {MAX_MINUTIAE} can be packed")
    neighbourhoods, areas = [p.neighbourhoods for p in prints], [p.region for p in prints]
    bits = [p.bit_descriptors for p in prints]
    points = np.concatenate([p.points for p in prints], axis=1)
    cell = np.concatenate([area.code.reshape(-1) for area in areas])
    cell_start = np.cumsum([0, *cells], dtype=np.int64)
    columns: dict[str, Any] = {
        "minutiae_start": np.cumsum([0, *n], dtype=np.int64),
        "cell_start": cell_start,
        "xy": points[:2].T,
        "direction": points[2:].T,
        "quality": np.rint(np.concatenate([p.quality for p in prints]) * 100.0),
        "index": np.concatenate([p.index for p in prints]),
        "count": np.concatenate([one.count for one in neighbourhoods]),
        "neighbour": np.concatenate([one.neighbour for one in neighbourhoods]),
        "root_weight": root_weight_codes(
            np.concatenate([one.frame[:, 5] for one in neighbourhoods])
        ),
        "direction_bin": np.concatenate([one.direction_bin for one in bits]),
        "neighbour_bits": np.concatenate([one.neighbour_bits for one in bits]),
        "orientation_bins": np.concatenate([one.orientation_bins for one in bits]),
        "cell": cell,
        "ridges": np.concatenate(
            [
                np.zeros(area.code.size, np.uint64) if r is None else r.reshape(-1)
                for area, r in ((area, area.ridges) for area in areas)
            ]
        ),
        "shape": [(*area.code.shape, area.first_row, area.first_column) for area in areas],
        "step": [area.step for area in areas],
        "to_500dpi": [print_.to_500dpi for print_ in prints],
        "has_flow": [area.has_flow for area in areas],
        "has_ridges": [area.ridges is not None for area in areas],
        "inside": inside_counts(cell, cell_start),
    }
    arrays = {k: np.ascontiguousarray(columns[k], c.dtype) for k, c in COLUMNS.items()}
    return PreparedPrints(**arrays)


def inside_counts(cell: NDArray[np.uint8], start: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return how many cells of each print are not 0; those of print k begin at ``start[k]``."""
    counted = np.zeros(len(cell) + 1, np.int32)
    np.cumsum(cell > 0, out=counted[1:])
    counts: NDArray[np.int32] = counted[start[1:]] - counted[start[:-1]]
    return counts
