"""One print of one request: its template as a file, and the stages of its extraction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fpmatch.drawing.scene.raster import data_url, reduced, webp_bytes
from fpmatch.drawing.stages.pictures import stage_picture, value_range
from fpmatch.errors import ImageError
from fpmatch.formats.record import TemplateRecord, View
from fpmatch.formats.registry import codec_of_name
from fpmatch.image.preprocess.arrays import StageRecorder
from fpmatch.server.errors import RequestError
from fpmatch.server.prints import open_upload

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.server.prints import PrintOptions, Upload

LARGEST_SIDE_SHOWN: Final = 1200
STAGE_TEXTS: Final = {
    "input": "The image at 500 dpi.",
    "normalised": "Brightness and contrast equalized, ridges dark.",
    "coherence": "How consistent the ridge orientation is; bright is consistent.",
    "mask": "The area of the print; the tinted part is excluded.",
    "orientation": "The ridge orientation.",
    "period": "The distance between ridges.",
    "enhanced": "The enhanced ridges.",
    "binary": "Ridges and valleys.",
    "skeleton": "The ridges thinned to one pixel, over the image.",
    "minutiae": "Ridge endings (circles) and bifurcations (squares).",
}
"""Explanations of the stages, by name; a stage without one is shown too."""


def extract_template(upload: Upload, reading: PrintOptions, file_format: str) -> tuple[bytes, str]:
    """Return the template of a print as the content of a file, and its suffix."""
    codec = codec_of_name(file_format)
    if codec.encode is None:
        raise RequestError(f"{codec.title} is only read, not written")
    template = open_upload(upload, reading).template
    return codec.encode(TemplateRecord("", (View(template),))).data, codec.suffixes[0]


def show_stages(upload: Upload, reading: PrintOptions) -> dict[str, Any]:
    """Return the stages of an extraction as pictures; see `fpmatch.server.models.Stages`."""
    recorder = StageRecorder()
    given = open_upload(upload, reading, recorder)
    if given.image is None:
        raise ImageError("a template has no stages of extraction", path=given.name)
    backdrop = recorder.stages["input"]
    return {
        "name": given.name,
        "stages": [
            {
                "name": name,
                "words": STAGE_TEXTS.get(name, ""),
                "range": value_range(name, array),
                "picture": _encode(stage_picture(name, array, backdrop)),
            }
            for name, array in recorder.stages.items()
        ],
    }


def _encode(picture: NDArray[np.uint8]) -> str:
    shown = reduced(picture, width=LARGEST_SIDE_SHOWN, height=LARGEST_SIDE_SHOWN)
    return data_url(webp_bytes(shown, 88), "webp")
