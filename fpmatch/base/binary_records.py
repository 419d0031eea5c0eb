"""Read binary files: big-endian numbers."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable


class ByteReader:
    """Read big-endian numbers from `data`, from byte `at` on.

    Raises ``error(reason)`` where the bytes end too soon.
    """

    def __init__(self, data: bytes, error: Callable[[str], Exception], at: int = 0) -> None:
        self.data, self.at, self._error = data, at, error

    @property
    def left(self) -> int:
        """Number of bytes left."""
        return max(0, len(self.data) - self.at)

    def take(self, count: int) -> bytes:
        """Return the next `count` bytes."""
        if not 0 <= count <= self.left:
            needed = f"ends after {len(self.data)} bytes, and needs {self.at + count} at least"
            raise self._error(f"cut short: it {needed}")
        start, self.at = self.at, self.at + count
        return self.data[start : self.at]

    def number(self, count: int = 1) -> int:
        """Return the next `count` bytes as an unsigned number."""
        return int.from_bytes(self.take(count), "big")

    def numbers(self, form: str) -> tuple[Any, ...]:
        """Return the next values of a `struct` format."""
        return struct.unpack(f">{form}", self.take(struct.calcsize(f">{form}")))
