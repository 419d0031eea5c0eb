"""Numbers from `.npy` files, as ``np.save`` writes arrays; nothing that they state is trusted.

Nothing is unpickled, and no memory is allocated for numbers that the file does not contain.
"""

from __future__ import annotations

import io
import math
import tokenize
import warnings
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAGIC: Final = b"\x93NUMPY"
_HEADERS: Final = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
_DAMAGED: Final = (ValueError, SyntaxError, TypeError, tokenize.TokenError)
_NUMBERS: Final = "biuf"  # kinds of numpy's types


def is_npy(data: bytes) -> bool:
    """Return whether a file begins as `.npy` files do."""
    return data.startswith(MAGIC)


def decode_npy(data: bytes) -> NDArray[np.float64]:
    """Return the real numbers, (N, K), in the bytes of a `.npy` file; else raise FpmatchError."""
    stream = io.BytesIO(data)
    try:
        version: Any = np.lib.format.read_magic(stream)
        if version not in _HEADERS:
            raise FpmatchError(f"a .npy file of version {version[0]}.{version[1]}, not 1.0 or 2.0")
        with warnings.catch_warnings(action="ignore"):  # about headers of Python 2
            shape, by_columns, dtype = _HEADERS[version](stream)
    except (*_DAMAGED, RecursionError, MemoryError) as error:
        raise FpmatchError("a .npy file with a damaged header") from error
    if dtype.kind not in _NUMBERS:
        what = "Python objects, which are not read" if dtype.hasobject else f"type {dtype.kind!r}"
        raise FpmatchError(f"expected an array of numbers, found one of {what}")
    if len(shape) != 2:
        dimensions = "1 dimension" if len(shape) == 1 else f"{len(shape)} dimensions"
        raise FpmatchError(f"expected an array of shape (N, K), found {dimensions}")
    stated, present = math.prod(shape) * dtype.itemsize, len(data) - stream.tell()
    if stated != present:
        words = "x".join(map(str, shape))
        raise FpmatchError(f"an array of {words} {dtype.name} has {stated} bytes, found {present}")
    flat = np.frombuffer(data, dtype, offset=stream.tell())
    array = flat.reshape(shape, order="F" if by_columns else "C")
    return np.array(array, dtype=np.float64, order="C")
