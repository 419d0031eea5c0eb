"""Numbers from `.npy` files, as ``np.save`` writes arrays; nothing that they state is trusted.

Nothing is unpickled.
"""

from __future__ import annotations

import io
import tokenize
import warnings
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAGIC: Final = b"\x93NUMPY"
_DAMAGED: Final = (ValueError, SyntaxError, TypeError, tokenize.TokenError, RecursionError)


def is_npy(data: bytes) -> bool:
    """Return whether a file begins as `.npy` files do."""
    return data.startswith(MAGIC)


def decode_npy(data: bytes) -> NDArray[np.float64]:
    """Return the real numbers, (N, K), in the bytes of a `.npy` file; else raise FpmatchError."""
    stream = io.BytesIO(data)
    try:
        with warnings.catch_warnings(action="ignore"):  # about headers of Python 2
            array: NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
    except (*_DAMAGED, MemoryError, OverflowError) as error:
        raise FpmatchError("a damaged .npy file, or one of Python objects") from error
    if stream.read(1):
        raise FpmatchError("a .npy file with more bytes than its array has")
    if array.dtype.kind not in "biuf":
        kind = array.dtype.kind
        raise FpmatchError(f"expected an array of numbers, found one of type {kind!r}")
    if array.ndim != 2:
        raise FpmatchError(f"expected an array of shape (N, K), found {array.ndim} dimensions")
    return np.array(array, dtype=np.float64, order="C")
