"""Enhancement by a small network, trained on synthetic prints and their ideal ridges.

Ronneberger, Fischer, Brox, "U-Net: convolutional networks for biomedical image segmentation",
MICCAI 2015. ``python -m research train enhancer`` trains it; OpenCV runs it.
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
    from fpmatch.image.preprocess.arrays import Floats

NETWORK_FILE: Final = Path(__file__).with_name("network.onnx")
NETWORK_SHA256: Final = "afb55ed31ea9b51a12ab0044e125623efeb70d38db7bb28c6d17f9794ce48f1a"
PATCH_PX: Final = 4  # side of a patch, one position of the network
SIDE_STEP_PX: Final = 16  # the sides of its input are multiples of this
# Of the two engines of OpenCV 5, the older one, which is that of OpenCV 4, is faster here.
_ENGINE: Final = (cv2.dnn.ENGINE_CLASSIC,) if hasattr(cv2.dnn, "ENGINE_CLASSIC") else ()
_own = threading.local()  # a network of OpenCV serves one thread


def enhance_by_network(pixels: Floats) -> Floats:
    """Enhance the ridges of a normalized image (H, W) at 500 dpi, ridges positive.

    Returns twice the probability of a ridge less one: 1 for a ridge, -1 for a valley, about 0 where
    there is no print or nothing is certain. Raises FpmatchError if the file of the network is
    missing, damaged or of another version, or OpenCV cannot use it.
    """
    height, width = pixels.shape
    rows, columns = (-(-side // SIDE_STEP_PX) * SIDE_STEP_PX for side in (height, width))
    padded = np.zeros((rows, columns), np.float32)
    padded[:height, :width] = pixels
    if not hasattr(_own, "network"):
        _own.network = _read_network(NETWORK_FILE)
    _own.network.setInput(_to_channels(padded))
    logits = _from_channels(np.asarray(_own.network.forward(), np.float32))
    return np.ascontiguousarray(np.tanh(0.5 * logits[:height, :width]), np.float32)


def _to_channels(pixels: Floats) -> Floats:
    """Return pixels (H, W) as channels (1, 16, H/4, W/4), one for each position in a patch."""
    rows, columns = (side // PATCH_PX for side in pixels.shape)
    patches = pixels.reshape(rows, PATCH_PX, columns, PATCH_PX).transpose(1, 3, 0, 2)
    return np.ascontiguousarray(patches.reshape(1, PATCH_PX**2, rows, columns))


def _from_channels(channels: Floats) -> Floats:
    """Undo `_to_channels`."""
    rows, columns = channels.shape[2:]
    patches = channels.reshape(PATCH_PX, PATCH_PX, rows, columns).transpose(2, 0, 3, 1)
    return np.ascontiguousarray(patches.reshape(PATCH_PX * rows, PATCH_PX * columns))


def _read_network(path: Path) -> cv2.dnn.Net:
    """Read a network after checking its file, because OpenCV may crash on a damaged one."""
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
        return cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8), *_ENGINE)
    except cv2.error as error:
        version = cv2.__version__
        raise FpmatchError(f"{path}: OpenCV {version} cannot use it ({error.err})") from error
