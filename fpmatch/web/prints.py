"""An uploaded print: the template that it is or that is extracted from it, and how it looks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fpmatch.drawing.ridge_picture import ridge_picture
from fpmatch.errors import ImageError
from fpmatch.formats.files import decode_record, is_of_minutiae_only
from fpmatch.image.assess import QualityRecorder
from fpmatch.image.extract import extract
from fpmatch.image.io.limits import ImageLimits
from fpmatch.image.io.read import decode_image
from fpmatch.minutiae import STANDARD_DPI, check_dpi

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.image.recorder import Recorder
    from fpmatch.minutiae import Template
    from fpmatch.web.settings import Limits
    from fpmatch.web.upload import Upload


@dataclass(frozen=True, slots=True, eq=False)
class GivenPrint:
    """Hold one print of a request.

    Parameters
    ----------
    name : str
        What it is called.
    template : Template
        Its template.
    pixels : ndarray of uint8, shape (H, W)
        How it looks: its picture, or what its template keeps of the ridges.
    kind : str
        "image" or "template".
    notes : tuple of str
        What was assumed or noticed, each a sentence's worth that follows the name.
    dpi_assumed : bool
        Whether nobody told the resolution.
    quality : PrintQuality, optional
        How good the picture is, where it was judged.
    """

    name: str
    template: Template
    pixels: NDArray[np.uint8]
    kind: str
    notes: tuple[str, ...]
    dpi_assumed: bool
    quality: PrintQuality | None = None


def open_upload(
    upload: Upload,
    limits: Limits,
    *,
    dpi: float | None = None,
    enhance: str = "learned",
    recorder: Recorder | None = None,
    judged: bool = False,
) -> GivenPrint:
    """Return the print in an upload.

    Parameters
    ----------
    upload : Upload
        An image or a template in any format, told by its content.
    limits : Limits
        What is refused.
    dpi : float, optional
        Its resolution, where the file does not tell or is wrong.
    enhance : str
        As for `fpmatch.extract`.
    recorder : Recorder, optional
        Receives the stages of the extraction.
    judged : bool
        Whether to tell the quality of a picture; then `recorder` receives nothing.

    Returns
    -------
    GivenPrint
        The print.

    Raises
    ------
    FpmatchError
        If it can be read neither as a template nor as an image, or is too large.
    """
    asked = None if dpi is None else check_dpi(dpi)
    if is_of_minutiae_only(upload.data):
        return _of_template_file(upload, limits, asked)
    bounds = ImageLimits(max_megapixels=limits.megapixels, max_file_megabytes=limits.file_megabytes)
    image = decode_image(upload.data, upload.name, limits=bounds)
    resolution = asked or image.dpi or STANDARD_DPI
    _check_size(upload.name, image.pixels.shape[1], image.pixels.shape[0], resolution, limits)
    stages = QualityRecorder() if judged else None
    template = extract(image, resolution, enhance=enhance, recorder=stages or recorder)
    quality = stages.quality(template.dpi) if stages else None
    assumed = asked is None and image.dpi is None
    notes = (*image.notes, *_assumption(assumed))
    return GivenPrint(upload.name, template, image.pixels, "image", notes, assumed, quality)


def of_template(name: str, template: Template) -> GivenPrint:
    """Return the print of a template without a picture, as galleries keep it."""
    return GivenPrint(name, template, ridge_picture(template), "template", (), False)


def _of_template_file(upload: Upload, limits: Limits, asked: float | None) -> GivenPrint:
    record = decode_record(upload.data, upload.name)
    view = record.views[0]
    template = view.at(asked).template
    _check_size(upload.name, template.width, template.height, template.dpi, limits)
    assumed = asked is None and not view.dpi_known
    several = len(record.views) > 1
    notes = (
        *record.notes,
        *((f"the first of its {len(record.views)} prints is taken",) if several else ()),
        *_assumption(assumed),
    )
    pixels = ridge_picture(template)
    return GivenPrint(upload.name, template, pixels, "template", notes, assumed)


def _assumption(assumed: bool) -> tuple[str, ...]:
    if not assumed:
        return ()
    return (f"does not tell its resolution; {STANDARD_DPI:g} dpi assumed",)


def _check_size(name: str, width: int, height: int, dpi: float, limits: Limits) -> None:
    """Refuse a print that would keep a worker busy for long."""
    megapixels = width * height * (STANDARD_DPI / dpi) ** 2 / 1e6
    if megapixels > limits.megapixels_at_500_dpi or width * height > limits.megapixels * 1e6:
        raise ImageError(
            f"{name}: {width} x {height} pixels at {dpi:g} dpi are more than this server takes: "
            f"{limits.megapixels_at_500_dpi:g} megapixels at {STANDARD_DPI:g} dpi"
        )
