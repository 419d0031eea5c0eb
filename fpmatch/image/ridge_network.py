"""Enhancement by a small network: it was shown synthetic prints, and the ridges they were made of.

``scripts/train_enhancer`` trains it; OpenCV runs it. What it hands out is the same as what a bank
of oriented filters does: an image whose ridges are positive, near 0 where it cannot tell.
"""

from __future__ import annotations

import hashlib
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from numpy.typing import NDArray

NETWORK_FILE: Final = Path(__file__).with_name("ridge_network.onnx")
NETWORK_SHA256: Final = "cff0da86dbb0730cf42dac70020c704e3618df6f42faf78fde91b34d5b6bf6be"
SIDE_STEP_PX: Final = 16  # sides of what the network takes are multiples of this
_own = threading.local()  # a network of OpenCV serves one thread


def enhance_by_network(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Find the ridges of a normalised image.

    Parameters
    ----------
    pixels : ndarray of float32, shape (H, W)
        Normalised image at 500 dpi, ridges positive, 0 where invalid.

    Returns
    -------
    ndarray of float32, shape (H, W)
        Twice the probability of a ridge less one: 1 for a ridge, -1 for a valley, about 0 where
        there is no print or nothing can be told.

    Raises
    ------
    FpmatchError
        If the file of the network is missing, damaged or another, or OpenCV cannot use it.

    References
    ----------
    Ronneberger, Fischer, Brox, "U-Net: convolutional networks for biomedical image segmentation",
    MICCAI 2015.

    Examples
    --------
    >>> x = np.arange(96, dtype=np.float32)
    >>> waves = np.tile(1.4 * np.cos(2 * np.pi * x / 9), (96, 1)).astype(np.float32)
    >>> ridges = enhance_by_network(waves)
    >>> bool(np.corrcoef(ridges.ravel(), waves.ravel())[0, 1] > 0.9)
    True
    """
    height, width = pixels.shape
    rows, columns = (-(-side // SIDE_STEP_PX) * SIDE_STEP_PX for side in (height, width))
    padded = np.zeros((1, 1, rows, columns), np.float32)
    padded[0, 0, :height, :width] = pixels
    network = _network()
    network.setInput(padded)
    logits = network.forward()[0]
    of_pixels = logits.reshape(2, 2, rows // 2, columns // 2).transpose(2, 0, 3, 1)
    ridges = np.tanh(0.5 * of_pixels.reshape(rows, columns)[:height, :width])
    return np.ascontiguousarray(ridges, np.float32)


def _network() -> cv2.dnn.Net:
    """Return this thread's network."""
    if not hasattr(_own, "network"):
        _own.network = _read_network(NETWORK_FILE)
    network: cv2.dnn.Net = _own.network
    return network


def _read_network(path: Path) -> cv2.dnn.Net:
    """Read a network that is whole: OpenCV may end the process over one that is not."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FpmatchError(f"{path}: cannot be read ({error.strerror or error})") from error
    digest = hashlib.sha256(content).hexdigest()
    if digest != NETWORK_SHA256:
        raise FpmatchError(
            f"{path}: damaged, or the network of another version (its SHA-256 is {digest})"
        )
    try:
        return cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
    except cv2.error as error:
        version = cv2.__version__
        raise FpmatchError(f"{path}: OpenCV {version} cannot use it ({error.err})") from error
