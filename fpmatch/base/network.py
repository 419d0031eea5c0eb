"""Networks in ONNX files of the package, run by OpenCV."""

from __future__ import annotations

import hashlib
import threading
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

# Of the two engines of OpenCV 5, the older one, which is that of OpenCV 4, is faster here. OpenCV
# 5.0 obeys the choice where it reads a file, and not where it is given the file's content.
_ENGINE: Final = (cv2.dnn.ENGINE_CLASSIC,) if hasattr(cv2.dnn, "ENGINE_CLASSIC") else ()


class Network:
    """A neural network in a file of the package; each thread loads its own copy, once."""

    def __init__(self, path: Path, sha256: str) -> None:
        self.path, self.sha256 = path, sha256
        self._own = threading.local()

    def __call__(self, given: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the output of the network.

        Raises FpmatchError if the file is missing, damaged or of another version, or OpenCV cannot
        use it.
        """
        if not hasattr(self._own, "network"):
            self._own.network = self._read()
        self._own.network.setInput(given)
        return np.asarray(self._own.network.forward(), np.float32)

    def _read(self) -> cv2.dnn.Net:
        """Read the network after checking its file, because OpenCV may crash on a damaged one."""
        try:
            content = self.path.read_bytes()
        except OSError as error:
            why = error.strerror or error
            raise FpmatchError(f"{self.path}: cannot be read ({why})") from error
        digest = hashlib.sha256(content).hexdigest()
        if digest != self.sha256:
            raise FpmatchError(
                f"{self.path}: damaged, or the network of another version (its SHA-256 is {digest})"
            )
        try:
            return cv2.dnn.readNetFromONNX(str(self.path), *_ENGINE)
        except cv2.error as error:
            version = cv2.__version__
            raise FpmatchError(
                f"{self.path}: OpenCV {version} cannot use it ({error.err})"
            ) from error
