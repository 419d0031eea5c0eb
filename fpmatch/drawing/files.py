"""Pictures become files, whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
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


def write_whole(path: Path, content: bytes) -> None:
    """Write `content` to a neighbouring file, then give it its name.

    Parameters
    ----------
    path : Path
        The file to write or replace; its folder must exist.
    content : bytes
        What to write.

    Raises
    ------
    OutputError
        If the folder or the file cannot be written; nothing is left behind then.
    """
    if path.is_dir():
        raise OutputError(f"{path}: cannot be written: it is a folder")
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {reason(error)}") from error
    neighbour = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        neighbour.chmod(0o666 & ~_umask())
        neighbour.replace(path)
    except OSError as error:
        neighbour.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written: {reason(error)}") from error


def reason(error: OSError) -> str:
    """Return what the system says of a failure, to end a sentence with."""
    return (error.strerror or str(error)).lower()


def _umask() -> int:
    """Return the process's file mode mask, which can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
