"""Read big-endian numbers from bytes that may end too early."""

from __future__ import annotations

from fpmatch.errors import TemplateError


class ByteReader:
    """Walk through bytes.

    Parameters
    ----------
    data : bytes
        What to read.
    start : int
        Where to begin.

    Examples
    --------
    >>> reader = ByteReader(bytes([1, 2, 3]))
    >>> reader.number(2), reader.left
    (258, 1)
    """

    def __init__(self, data: bytes, start: int = 0) -> None:
        self._data = data
        self.at = start

    @property
    def left(self) -> int:
        """How many bytes are left."""
        return max(0, len(self._data) - self.at)

    def take(self, count: int) -> bytes:
        """Return the next `count` bytes.

        Raises
        ------
        TemplateError
            If there are not so many.
        """
        if count > self.left:
            raise TemplateError(
                f"cut short: the file ends after {len(self._data)} bytes, "
                f"and needs {self.at + count} at least"
            )
        start, self.at = self.at, self.at + count
        return self._data[start : self.at]

    def number(self, count: int = 1) -> int:
        """Return the next `count` bytes as an unsigned number.

        Raises
        ------
        TemplateError
            If there are not so many.
        """
        return int.from_bytes(self.take(count), "big")
