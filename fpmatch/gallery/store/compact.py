"""Stored templates: the packed templates of a gallery, about 2,700 bytes, with exact ridges.

The layout is that of `fpmatch.packed_template`. It begins with "fm", and each picture of the ridges
has 64 bits, the highest bit first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.packed_template import FIELD, RIDGES, Layout, check, pack, unpack

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.minutiae import Template

VERSION: Final = 2


def _unpack_ridges(
    data: bytes, _orientation: NDArray[np.uint8], mask: NDArray[np.bool_]
) -> NDArray[np.uint64]:
    """Return the pictures of the cells, 0 outside the mask."""
    ridges = np.zeros(mask.shape, np.uint64)
    ridges[mask] = np.frombuffer(data, ">u8")
    return ridges


LAYOUT: Final = Layout(
    magic=b"fm",
    version=VERSION,
    known={1: FIELD, VERSION: RIDGES},  # version 1 is the same without ridges
    cell_bytes=8,
    pack_ridges=lambda words: words.astype(">u8").tobytes(),
    unpack_ridges=_unpack_ridges,
)


def pack_template(template: Template) -> bytes:
    """Return a template in few bytes; an unpacked template gives the same bytes again.

    Raises TemplateError if a number is outside the bounds of `fpmatch.formats.bounds`: minutiae
    are within 32,767 pixels of the origin at 500 dpi, at most 65,535 of them, and a ridge field has
    at most a million cells.

    Examples
    --------
    >>> from fpmatch.minutiae import Minutiae, Template
    >>> template = Template(Minutiae(x=[10, 20], y=[5, 8], angle=[0, 1.6]), width=300, height=400)
    >>> data = pack_template(template)
    >>> len(data), unpack_template(data).minutiae.xy.tolist()
    (31, [[10.0, 5.0], [20.0, 8.0]])
    """
    return pack(template, LAYOUT)


def unpack_template(data: bytes) -> Template:
    """Return the template that `pack_template` packed, its numbers rounded once.

    Raises TemplateError if `data` is of another version, damaged, or no packed template at all.
    """
    return unpack(data, LAYOUT)


def check_packed(data: bytes) -> tuple[int, float]:
    """Check the checksum of a packed template; return its number of minutiae and its dpi.

    Raises TemplateError as `unpack_template`, which finds damage that was there before packing too.
    """
    return check(data, LAYOUT)
