"""Compact templates: the stored templates of an index, about 670 bytes, with samples of the ridges.

They are stored as `fpmatch.gallery.store.stored_template` describes, with eight samples of each
cell's picture of the ridges, from which the other bits are estimated (see `ridge_samples`). A small
print, of which a comparison looks at more bits, has few cells: it is stored as a gallery stores it.
`prepare_compact` prepares many at a time, with the result of `prepare`, but faster.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints, inside_counts
from fpmatch.gallery.index.prints.print_arrays import START, PrintArrays, of_each
from fpmatch.gallery.index.prints.ridge_samples import (
    restore_all,
    restore_ridges,
    sample_ridges,
    spread_samples,
)
from fpmatch.gallery.index.prints.stored_columns import plain_columns
from fpmatch.gallery.store.stored_template import (
    GALLERY_LAYOUT,
    RIDGES,
    STEPS,
    Layout,
    pack_template,
    unpack_template,
)
from fpmatch.matching.constants.comparison import SMALL_AREA_PX2
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.parameters import USUAL
from fpmatch.matching.prints.print_area import orientation_codes
from fpmatch.templates.bounds import DPI_UNITS, rounded_dpi
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import TypeAlias

    from numpy.typing import NDArray

    from fpmatch.gallery.index.prints.stored_columns import StoredColumns
    from fpmatch.templates.minutiae import Template

    _Make: TypeAlias = Callable[[StoredColumns, Layout], PreparedPrints]

VERSION: Final = 1
LAYOUT: Final = Layout(
    magic=b"fc",
    version=VERSION,
    known={VERSION: RIDGES},
    cell_bytes=1,
    pack_ridges=lambda words: sample_ridges(words).tobytes(),
    unpack_ridges=lambda data, steps, mask: restore_ridges(
        np.frombuffer(data, np.uint8), steps, mask
    ),
)
LAYOUTS: Final = (LAYOUT, GALLERY_LAYOUT)  # of the usual prints, and of small ones
CONTENT: Final = "content_start"  # dimension of the bytes
PRINTS_AT_ONCE: Final = 256  # prepared; their arrays take a few megabytes
_CODES: Final = orientation_codes(STEPS, np.ones(len(STEPS), bool))  # of ridge orientations


def compact(template: Template) -> bytes:
    """Return a template in few bytes: as a gallery stores it, but a usual print's ridges sampled.

    An expanded template gives the same bytes again. Raises TemplateError as `pack_template`.

    Examples
    --------
    >>> from fpmatch.templates.minutiae import Minutiae, Template
    >>> template = Template(Minutiae(x=[10, 20], y=[5, 8], angle=[0, 1.6]), width=300, height=400)
    >>> data = compact(template)
    >>> len(data), expand(data).minutiae.xy.tolist()
    (31, [[10.0, 5.0], [20.0, 8.0]])
    """
    return pack_template(template, GALLERY_LAYOUT if _is_small(template) else LAYOUT)


def _is_small(template: Template) -> bool:
    """Return whether a print shows its ridges, and is small to the matcher."""
    field = template.field
    if field is None or field.ridges is None:
        return False
    with np.errstate(over="ignore"):  # rounded as it is stored
        step = float(np.float32(field.step * (STANDARD_DPI / rounded_dpi(template) * DPI_UNITS)))
    return int(np.count_nonzero(field.mask)) * (step * step) <= SMALL_AREA_PX2


def expand(data: bytes) -> Template:
    """Return the template that `compact` packed, a usual print's pictures of ridges estimated.

    Raises TemplateError if the bytes are of another version, damaged, or no compact template.
    """
    small = data.startswith(GALLERY_LAYOUT.magic)
    return unpack_template(data, GALLERY_LAYOUT if small else LAYOUT)


@dataclass(frozen=True, eq=False)
class CompactTemplates(PrintArrays):
    """The compact templates of many prints in one array of bytes, and where each starts."""

    content_start: NDArray[np.int64] = field(metadata=of_each(START, "<i8"))
    content: NDArray[np.uint8] = field(metadata=of_each(CONTENT, "|u1"))

    @classmethod
    def pack(cls, templates: Iterable[Template]) -> CompactTemplates:
        """Pack templates; raises TemplateError as `compact`."""
        return cls.of_bytes(map(compact, templates))

    @classmethod
    def of_bytes(cls, packed: Iterable[bytes]) -> CompactTemplates:
        """Join templates that are compact."""
        parts = list(packed)
        start = np.cumsum([0, *map(len, parts)], dtype=np.int64)
        return cls(start, np.frombuffer(b"".join(parts), np.uint8))

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> CompactTemplates:
        """Return the prints of the arrays, among others, that are those of `COLUMNS`.

        Raises MatcherError if a start lies outside the content; a print has a checksum of its own.
        """
        start, content = arrays["content_start"], arrays["content"]
        if (
            not len(start)
            or start[0]
            or start[-1] != len(content)
            or (start[1:] < start[:-1]).any()
        ):
            raise MatcherError("damaged", code="damaged")
        return cls(start, content)

    def __len__(self) -> int:
        return len(self.content_start) - 1

    def __getitem__(self, k: int) -> Template:
        """Return template k; raises TemplateError as `expand`."""
        if not 0 <= k < len(self):
            raise IndexError(f"print {k} of {len(self)}")
        return expand(self.content[slice(*self.content_start[k : k + 2])].tobytes())


COLUMNS: Final = CompactTemplates.columns()


def prepare_compact(templates: CompactTemplates, which: NDArray[np.integer]) -> PreparedPrints:
    """Prepare some compact templates, by their numbers: the same as to pack what `prepare` makes.

    Raises IndexError if a number is that of no print, TemplateError if a template is damaged.
    """
    return PreparedPrints.pack(MATCHER.prepare(templates[k]) for k in which.tolist())


def print_areas(
    templates: CompactTemplates, which: NDArray[np.integer], *, estimate_ridges: bool
) -> PreparedPrints:
    """Return the areas of some prints, without minutiae and orientations of plain ones.

    Unless the other bits of the ridges are estimated, only samples are right: enough where neither
    of two prints that are compared is small. Raises as `prepare_compact`.
    """
    return _in_parts(templates, which, partial(_without_minutiae, estimate_ridges))


def _in_parts(
    templates: CompactTemplates, which: NDArray[np.integer], make: _Make
) -> PreparedPrints:
    numbers = np.asarray(which, np.int64)
    if len(numbers) and not 0 <= numbers.min() <= numbers.max() < len(templates):
        raise IndexError(f"a print outside of {len(templates)}")
    parts = [
        _part(templates, numbers[k : k + PRINTS_AT_ONCE], make)
        for k in range(0, len(numbers), PRINTS_AT_ONCE)
    ]
    return PreparedPrints.concatenate(parts)


def _part(templates: CompactTemplates, which: NDArray[np.int64], make: _Make) -> PreparedPrints:
    """Make a few prints, those that are plain in neither layout one by one."""
    start, most = templates.content_start, USUAL.max_minutiae
    left, parts, order = np.arange(len(which)), [], []
    for layout in LAYOUTS:
        begin, end = start[which[left]], start[which[left] + 1]
        columns, plain = plain_columns(templates.content, begin, end, layout, most)
        parts.append(make(columns, layout))
        if len(plain) == len(which):
            return parts[-1]
        order.append(left[plain])
        left = np.delete(left, plain)
    parts.append(PreparedPrints.pack(MATCHER.prepare(templates[k]) for k in which[left].tolist()))
    return PreparedPrints.concatenate(parts).take(np.argsort(np.concatenate([*order, left])))


def _without_minutiae(
    estimate_ridges: bool, given: StoredColumns, layout: Layout
) -> PreparedPrints:
    ridges, known = np.zeros(len(given.mask), np.uint64), np.ones(len(given.dpi), np.uint8)
    if estimate_ridges or layout is GALLERY_LAYOUT:
        ridges = _ridges(given, layout)
    else:
        ridges[given.mask > 0] = spread_samples(given.ridges)
    return replace(
        PreparedPrints.pack(()),
        minutiae_start=np.zeros_like(given.cell_start),
        cell_start=given.cell_start,
        cell=given.mask,
        ridges=ridges,
        shape=given.shape,
        step=given.step,
        to_500dpi=STANDARD_DPI / given.dpi,
        has_flow=known,
        has_ridges=known,
        inside=inside_counts(given.mask, given.cell_start),
    )


def _ridges(given: StoredColumns, layout: Layout) -> NDArray[np.uint64]:
    """Return the pictures of all cells, 0 outside the masks."""
    if layout is GALLERY_LAYOUT:
        return layout.unpack_ridges(given.ridges.tobytes(), given.orientation, given.mask > 0)
    return restore_all(given.ridges, given.orientation, given.mask, given.cell_start, given.shape)
