"""What the readers of image formats share: `Picture`, their result, and `ByteReader`."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from fpmatch.errors import ImageReadError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_MARKER: Final = re.compile(rb"\xff[^\x00]", re.DOTALL)


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """Hold a decoded picture.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (H, W)
        Grey values, 0 black to 255 white.
    dpi : float or None
        Resolution that the file tells in dots per inch; None where it tells no usable one.
    format : str
        Name of the format, for people.
    notes : tuple of str
        What was done or noticed on reading, in words.
    """

    pixels: NDArray[np.uint8] = field(repr=False)
    dpi: float | None = None
    format: str = ""
    notes: tuple[str, ...] = ()


class ByteReader:
    """Read big-endian numbers one after the other from bytes that may end too soon.

    Parameters
    ----------
    data : bytes
        What to read.
    name : str
        What the bytes are, for messages.
    """

    def __init__(self, data: bytes, name: str) -> None:
        self._data, self._name, self._at = data, name, 0

    @property
    def left(self) -> int:
        """Number of bytes that are left."""
        return len(self._data) - self._at

    def take(self, count: int) -> bytes:
        """Return the next `count` bytes.

        Raises
        ------
        ImageReadError
            If there are not so many.
        """
        if not 0 <= count <= self.left:
            raise ImageReadError(f"damaged {self._name} image (it ends too soon)")
        start, self._at = self._at, self._at + count
        return self._data[start : self._at]

    def rest(self) -> bytes:
        """Return all bytes that are left."""
        return self.take(self.left)

    def u8(self) -> int:
        """Return the next number of 8 bits."""
        return self.take(1)[0]

    def u16(self) -> int:
        """Return the next number of 16 bits."""
        return int.from_bytes(self.take(2), "big")

    def u32(self) -> int:
        """Return the next number of 32 bits."""
        return int.from_bytes(self.take(4), "big")

    def entropy_coded(self) -> bytes:
        """Return the bytes up to the next marker, 0xFF and not 0, without their stuffing."""
        marker = _MARKER.search(self._data, self._at)
        if marker is None:
            raise ImageReadError(f"damaged {self._name} image (it ends too soon)")
        coded = self._data[self._at : marker.start()]
        self._at = marker.start()
        return coded.replace(b"\xff\x00", b"\xff")
