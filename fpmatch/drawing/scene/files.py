"""Pictures as the content of files, and files in a folder."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from fpmatch.base.output import atomic_write_bytes, make_folder
from fpmatch.errors import OutputError

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from numpy.typing import NDArray


def png_bytes(picture: NDArray[np.uint8]) -> bytes:
    """Encode a picture, grey (H, W), RGB (H, W, 3) or RGBA (H, W, 4), as PNG."""
    return _encoded(picture, ".png", [])


def webp_bytes(picture: NDArray[np.uint8], quality: int = 80) -> bytes:
    """Encode a picture as WebP, which is lossy and much smaller, at a quality from 1 to 100."""
    return _encoded(picture, ".webp", [cv2.IMWRITE_WEBP_QUALITY, quality])


def data_url(content: bytes, kind: str) -> str:
    """Return a picture as a URL that contains it."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def reduced(picture: NDArray[np.uint8], *, width: int, height: int) -> NDArray[np.uint8]:
    """Return a picture made smaller, where it is larger, to fit into a width and a height."""
    rows, columns = picture.shape[:2]
    factor = min(width / columns, height / rows)
    if factor >= 1:
        return picture
    size = (max(round(columns * factor), 1), max(round(rows * factor), 1))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _encoded(picture: NDArray[np.uint8], suffix: str, options: list[int]) -> bytes:
    order = {3: cv2.COLOR_RGB2BGR, 4: cv2.COLOR_RGBA2BGRA}
    channels = picture.shape[2] if picture.ndim == 3 else 1
    stored = picture if channels == 1 else cv2.cvtColor(picture, order[channels])
    done, encoded = cv2.imencode(suffix, stored, options)
    if not done:
        size = f"{picture.shape[1]} x {picture.shape[0]}"
        raise OutputError(f"a picture of {size} has no {suffix[1:].upper()} form")
    return encoded.tobytes()


def write_files(
    contents: Mapping[str, bytes], folder: str | os.PathLike[str], *, public: bool = False
) -> list[Path]:
    """Write files, by name, into a folder, made if missing; each appears complete or not at all."""
    target = Path(folder)
    make_folder(target, public=public)
    for name, content in contents.items():
        atomic_write_bytes(target / name, content, public=public)
    return [target / name for name in contents]
