"""One print of one request: its template as a file, and the stages of its extraction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.drawing.files import webp_bytes
from fpmatch.drawing.stages.pictures import stage_picture, value_range
from fpmatch.errors import ImageError
from fpmatch.formats.record import TemplateRecord, View
from fpmatch.formats.registry import codec_of_name
from fpmatch.image.recorder import StageRecorder
from fpmatch.web.errors import RequestError
from fpmatch.web.pair import data_url
from fpmatch.web.prints import open_upload

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.web.settings import Limits
    from fpmatch.web.upload import Upload

LARGEST_SIDE_SHOWN: Final = 1200
# What the pictures of the stages show; stages without words are shown all the same.
WORDS: Final = {
    "input": "The picture, at 500 dpi.",
    "normalised": "Brightness and contrast evened out, ridges dark.",
    "coherence": "How clearly the ridges run in one direction; bright is clear.",
    "mask": "Where there is a print; the tinted part is left out.",
    "orientation": "The direction in which the ridges run.",
    "period": "The distance from ridge to ridge.",
    "enhanced": "The ridges, cleaned.",
    "binary": "Ridge or valley, nothing between.",
    "skeleton": "The ridges thinned to one pixel, over the picture.",
    "minutiae": "Where ridges end (circles) and fork (squares).",
}


def extract_template(
    upload: Upload, dpi: float | None, enhance: str, file_format: str, limits: Limits
) -> tuple[bytes, str]:
    """Return the template of a print as a file.

    Parameters
    ----------
    upload : Upload
        An image, or a template to convert.
    dpi : float or None
        Its resolution.
    enhance : str
        How ridges are found.
    file_format : str
        Name of a template format that can be written.
    limits : Limits
        What is refused.

    Returns
    -------
    content : bytes
        The file.
    suffix : str
        Its suffix, with the dot.

    Raises
    ------
    FpmatchError
        If the print cannot be read, or the format cannot hold it or is not known.
    """
    codec = codec_of_name(file_format)
    if codec.encode is None:
        raise RequestError(f"{codec.title} is only read, not written")
    template = open_upload(upload, limits, dpi=dpi, enhance=enhance).template
    return codec.encode(TemplateRecord("", (View(template),))).data, codec.suffixes[0]


def show_stages(upload: Upload, dpi: float | None, enhance: str, limits: Limits) -> dict[str, Any]:
    """Return the stages of an extraction as pictures.

    Parameters
    ----------
    upload, dpi, enhance, limits
        As for `extract_template`.

    Returns
    -------
    dict
        ``name``, and ``stages``, each with ``name``, ``words``, ``range`` and ``picture``.

    Raises
    ------
    FpmatchError
        If the upload is no picture of a print.
    """
    recorder = StageRecorder()
    given = open_upload(upload, limits, dpi=dpi, enhance=enhance, recorder=recorder)
    if given.kind != "image":
        raise ImageError(f"{given.name}: a template has no stages, only a picture has")
    backdrop = recorder.stages["input"]
    return {
        "name": given.name,
        "stages": [
            {
                "name": name,
                "words": WORDS.get(name, ""),
                "range": value_range(name, array),
                "picture": _encoded(stage_picture(name, array, backdrop)),
            }
            for name, array in recorder.stages.items()
        ],
    }


def _encoded(picture: NDArray[np.uint8]) -> str:
    factor = LARGEST_SIDE_SHOWN / max(picture.shape[:2])
    if factor < 1:
        height, width = picture.shape[:2]
        size = (max(round(width * factor), 1), max(round(height * factor), 1))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    return data_url(webp_bytes(picture, 88), "webp")
