"""Networks in ONNX files of the package, run by OpenCV."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Final

import cv2

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from pathlib import Path

# Of the two engines of OpenCV 5, the older one, which is that of OpenCV 4, is faster here. OpenCV
# 5.0 obeys the choice where it reads a file, and not where it is given the file's content.
_ENGINE: Final = (cv2.dnn.ENGINE_CLASSIC,) if hasattr(cv2.dnn, "ENGINE_CLASSIC") else ()


def read_network(path: Path, sha256: str) -> cv2.dnn.Net:
    """Read a network after checking its file, because OpenCV may crash on a damaged one.

    A network serves one thread. Raises FpmatchError if the file is missing, damaged or of another
    version, or OpenCV cannot use it.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FpmatchError(f"{path}: cannot be read ({error.strerror or error})") from error
    digest = hashlib.sha256(content).hexdigest()
    if digest != sha256:
        raise FpmatchError(
            f"{path}: damaged, or the network of another version (its SHA-256 is {digest})"
        )
    try:
        return cv2.dnn.readNetFromONNX(str(path), *_ENGINE)
    except cv2.error as error:
        version = cv2.__version__
        raise FpmatchError(f"{path}: OpenCV {version} cannot use it ({error.err})") from error
