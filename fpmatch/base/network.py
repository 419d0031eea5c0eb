"""Networks in ONNX files of the package, run by OpenCV."""

from __future__ import annotations

import hashlib
import threading
from dataclasses import dataclass, field
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


@dataclass(frozen=True)
class Network:
    """A neural network in a file of the package; each thread loads its own copy, once."""

    path: Path
    sha256: str
    _own: threading.local = field(default_factory=threading.local, init=False, compare=False)

    def __call__(self, given: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the output of the network.

        Raises FpmatchError if the file is missing, damaged or of another version, or OpenCV cannot
        use it.
        """
        if not hasattr(self._own, "network"):
            try:
                digest = hashlib.sha256(self.path.read_bytes()).hexdigest()
                if digest != self.sha256:  # OpenCV may crash on a damaged file
                    why = f"damaged, or the network of another version (its SHA-256 is {digest})"
                    raise FpmatchError(why, path=self.path)
                self._own.network = cv2.dnn.readNetFromONNX(str(self.path), *_ENGINE)
            except OSError as error:
                why = f"cannot be read ({error.strerror})"
                raise FpmatchError(why, path=self.path) from error
            except cv2.error as error:
                why = f"OpenCV {cv2.__version__} cannot use it ({error.err})"
                raise FpmatchError(why, path=self.path) from error
        self._own.network.setInput(given)
        return np.asarray(self._own.network.forward(), np.float32)
