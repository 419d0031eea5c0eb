"""Read one file that holds a print, an image or a template."""

from __future__ import annotations

import stat
from functools import partial
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from fpmatch.formats.record import TemplateRecord
    from fpmatch.image.io.read import GreyImage

_LONGEST_SIGNATURE: Final = 16  # bytes


def read_print(
    path: Path, image_reader: Callable[..., GreyImage] | None = None, **how: Any
) -> GreyImage | TemplateRecord:
    """Read a file as a template if it is one, else as an image.

    Parameters
    ----------
    path : Path
        The file. One that has both an image and minutiae, as AN2 may, is read as an image.
    image_reader : callable
        Reads images (default: `fpmatch.image.io.read.read_image`).
    **how
        Options of that, such as ``polarity``.

    Returns
    -------
    GreyImage or TemplateRecord
        What it holds.

    Raises
    ------
    TemplateError, ImageReadError, ImageError
        If it cannot be read.
    """
    from fpmatch.image.io.read import read_image  # noqa: PLC0415  (takes OpenCV's time)

    read = partial(image_reader or read_image, **how)
    if _begins_like_a_picture(path):  # then no codec of templates is needed to tell
        return read(path)
    from fpmatch.formats.files import holds_minutiae_only, load_record  # noqa: PLC0415

    return load_record(path) if holds_minutiae_only(path) else read(path)


def _begins_like_a_picture(path: Path) -> bool:
    from fpmatch.image.io.registry import is_image_file  # noqa: PLC0415  (takes OpenCV's time)

    try:
        if not stat.S_ISREG(path.stat().st_mode):
            return False
        with path.open("rb") as stream:
            head = stream.read(_LONGEST_SIGNATURE)
    except (OSError, ValueError):
        return False
    return is_image_file(head)
