"""Read big-endian numbers from the bytes of an image file."""

from __future__ import annotations

import re
from typing import Final

from fpmatch.errors import ImageReadError

_MARKER: Final = re.compile(rb"\xff[^\x00]", re.DOTALL)


class ByteReader:
    """Read numbers one after the other from `data`; errors name the format `name`.

    Every method raises ImageReadError where the bytes end too soon.
    """

    def __init__(self, data: bytes, name: str) -> None:
        self._data, self._name, self._at = data, name, 0

    @property
    def left(self) -> int:
        """Number of bytes that are left."""
        return len(self._data) - self._at

    def take(self, count: int) -> bytes:
        """Return the next `count` bytes."""
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
        return self.take(marker.start() - self._at).replace(b"\xff\x00", b"\xff")
