"""Prepared prints, many of them in flat arrays, which a file may contain (`array_file`).

They are not stored templates (`fpmatch.gallery.store.stored_template`), but what a matcher has
prepared from templates. A file of them is a cache: it has to be recomputed whenever the templates
or the matcher change.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints._prepared_view_kernel import PreparedView
from fpmatch.gallery.index.prints.print_arrays import (
    MAX_MINUTIAE,
    MAX_PX,
    PRINT,
    START,
    PrintArrays,
    of_each,
)
from fpmatch.matching.constants.prints import NEIGHBOUR_WORDS, ORIENTATION_WORDS, UNKNOWN_BIN
from fpmatch.matching.parameters import USUAL
from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
from fpmatch.matching.prints.prepared import (
    ROOT_WEIGHTS,
    BitDescriptors,
    Neighbourhoods,
    PreparedTemplate,
    content_key,
    root_weight_codes,
)
from fpmatch.matching.prints.print_area import PrintArea

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

PRINTS_AT_ONCE: Final = 1024  # put into arrays before these are joined
_SIZE: Final = USUAL.neighbours
QUALITIES: Final = np.arange(256) / 100.0  # of a minutia, whose steps are the template's own
# Beyond what is ever kept, and far from where a kernel's numbers would overflow:
MAX_CELLS: Final = 1 << 24  # of a print, and rows and columns
MAX_INDEX: Final = 1 << 16  # of a minutia in its template
STEPS_PX: Final = (1e-2, 1e6)
SCALES: Final = (1e-2, 1e2)  # 500 / dpi
UNIT_TOLERANCE: Final = 1e-3  # of the square of a unit vector's length

# dimensions of entries that are of a minutia, or of a cell, of all prints
MINUTIA: Final = "minutiae_start"
CELL: Final = "cell_start"


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

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> PreparedPrints:
        """Return the prints of the arrays, among others, that are those of `COLUMNS`.

        Raises MatcherError if a number would lead out of an array, or of what `pack` packs.
        """
        if not _is_sound(arrays):
            raise MatcherError("damaged", code="damaged")
        return cls(**{name: arrays[name] for name in COLUMNS})


COLUMNS: Final = PreparedPrints.columns()


def preparation() -> str:
    """Return the parameters on which the contents of the arrays depend."""
    return repr(USUAL)


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


def _is_sound(arrays: Mapping[str, NDArray[Any]]) -> bool:
    """Return whether every index and size in arrays from a file lies within these."""
    minutiae, cells = arrays["minutiae_start"], arrays["cell_start"]
    n, of_print, size = np.diff(minutiae), np.diff(cells), arrays["neighbour"].shape[1]
    for starts, length, most, array in (
        (minutiae, n, MAX_MINUTIAE, arrays["xy"]),
        (cells, of_print, MAX_CELLS, arrays["cell"]),
    ):
        if len(starts) != len(arrays["step"]) + 1 or starts[0] or starts[-1] != len(array):
            return False
        if (length < 0).any() or (length > most).any():
            return False
    shape = arrays["shape"].astype(np.int64)
    rising = np.diff(arrays["index"], prepend=-1) > 0
    rising[minutiae[:-1][n > 0]] = True  # the first minutia of a print
    checks = (
        (shape >= 0) & (shape <= MAX_CELLS),
        shape[:, 0] * shape[:, 1] == of_print,
        (arrays["inside"] >= 0) & (arrays["inside"] <= of_print),
        np.abs(arrays["xy"]) <= MAX_PX,
        _is_unit(arrays["direction"]),
        _is_within(arrays["step"], STEPS_PX),
        _is_within(arrays["to_500dpi"], SCALES),
        (arrays["index"] >= 0) & (arrays["index"] < MAX_INDEX) & rising,
        arrays["count"] <= size,
        _most_of_each(arrays["neighbour"].ravel(), size * minutiae) < np.maximum(n, 1),
        arrays["orientation_bins"] <= UNKNOWN_BIN,
        arrays["has_flow"] <= 1,
        arrays["has_ridges"] <= 1,
    )
    return all(bool(check.all()) for check in checks)


def _is_unit(vectors: NDArray[np.float32]) -> NDArray[np.bool_]:
    with np.errstate(over="ignore", invalid="ignore"):
        squares: NDArray[np.float32] = np.einsum("ij,ij->i", vectors, vectors)
        unit: NDArray[np.bool_] = np.abs(squares - np.float32(1.0)) < UNIT_TOLERANCE
    return unit


def _is_within(values: NDArray[np.float64], bounds: tuple[float, float]) -> NDArray[np.bool_]:
    return (values >= bounds[0]) & (values <= bounds[1])


def _most_of_each(values: NDArray[Any], starts: NDArray[np.int64]) -> NDArray[Any]:
    """Return the greatest of the values of each print; 0 for one that has none."""
    most = np.zeros(len(starts) - 1, values.dtype)
    some = np.flatnonzero(np.diff(starts))
    if len(some):
        most[some] = np.maximum.reduceat(values, starts[some])
    return most
