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
    order = {3: cv2.COLOR_RGB2BGR, 4: cv2.COLOR_RGBA2BGRA}
    channels = picture.shape[2] if picture.ndim == 3 else 1
    stored = picture if channels == 1 else cv2.cvtColor(picture, order[channels])
    done, encoded = cv2.imencode(".png", stored)
    if not done:
        raise OutputError(f"a picture of {picture.shape[1]} x {picture.shape[0]} has no PNG form")
    return encoded.tobytes()
