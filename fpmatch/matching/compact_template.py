"""Compact templates: the packed templates of an index, about 670 bytes, with samples of the ridges.

The layout is that of `fpmatch.templates.stored_template`. It begins with "fc", and has eight samples of each
cell's picture of the ridges, from which the other bits are estimated (see `ridge_samples`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.matching.prints.print_arrays import START, PrintArrays, of_each
from fpmatch.matching.prints.ridge_samples import restore_ridges, sample_ridges
from fpmatch.templates.stored_template import RIDGES, Layout, pack, unpack

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Template

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
CONTENT: Final = "content_start"  # dimension of the bytes


def compact(template: Template) -> bytes:
    """Return a template in few bytes: as a gallery stores it, but with samples of the ridges.

    Positions are rounded to whole pixels at 500 dpi, angles to 256ths of a turn, as in a gallery.
    Of the pictures of the ridges, every eighth bit is kept. An expanded template gives the same
    bytes again.

    Raises
    ------
    TemplateError
        If a number is outside the bounds of `fpmatch.templates.bounds`.

    Examples
    --------
    >>> from fpmatch.templates.minutiae import Minutiae, Template
    >>> template = Template(Minutiae(x=[10, 20], y=[5, 8], angle=[0, 1.6]), width=300, height=400)
    >>> data = compact(template)
    >>> len(data), expand(data).minutiae.xy.tolist()
    (31, [[10.0, 5.0], [20.0, 8.0]])
    """
    return pack(template, LAYOUT)


def expand(data: bytes) -> Template:
    """Return the template that `compact` packed, with the pictures of its ridges estimated.

    Raises
    ------
    TemplateError
        If the bytes are of another version, damaged, or no compact template at all.
    """
    return unpack(data, LAYOUT)


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
