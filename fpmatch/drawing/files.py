"""Pictures become the content of files."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2

from fpmatch.errors import OutputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def png_bytes(picture: NDArray[np.uint8]) -> bytes:
    """Encode a picture as PNG.

    Parameters
    ----------
    picture : ndarray of uint8, shape (H, W), (H, W, 3) or (H, W, 4)
        Grey, RGB or RGBA.

    Returns
    -------
    bytes
        The file's content.

    Raises
    ------
    OutputError
        If it cannot be encoded.

    Examples
    --------
    >>> import numpy as np
    >>> png_bytes(np.zeros((2, 2), np.uint8))[1:4]
    b'PNG'
    """
    return _encoded(picture, ".png", [])


def webp_bytes(picture: NDArray[np.uint8], quality: int = 80) -> bytes:
    """Encode a picture as WebP, which loses a little and is much smaller.

    Parameters
    ----------
    picture : ndarray of uint8, shape (H, W), (H, W, 3) or (H, W, 4)
        Grey, RGB or RGBA.
    quality : int
        From 1 to 100.

    Returns
    -------
    bytes
        The file's content.

    Raises
    ------
    OutputError
        If it cannot be encoded.

    Examples
    --------
    >>> import numpy as np
    >>> webp_bytes(np.zeros((2, 2), np.uint8))[8:12]
    b'WEBP'
    """
    return _encoded(picture, ".webp", [cv2.IMWRITE_WEBP_QUALITY, quality])


def _encoded(picture: NDArray[np.uint8], suffix: str, options: list[int]) -> bytes:
    order = {3: cv2.COLOR_RGB2BGR, 4: cv2.COLOR_RGBA2BGRA}
    channels = picture.shape[2] if picture.ndim == 3 else 1
    stored = picture if channels == 1 else cv2.cvtColor(picture, order[channels])
    done, encoded = cv2.imencode(suffix, stored, options)
    if not done:
        kind = suffix[1:].upper()
        raise OutputError(
            f"a picture of {picture.shape[1]} x {picture.shape[0]} has no {kind} form"
        )
    return encoded.tobytes()
