"""An uploaded print, its template, and its pixels."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from fpmatch.errors import ImageError
from fpmatch.formats.record import TemplateRecord
from fpmatch.gallery.listing.prints import with_note_on_two_prints
from fpmatch.image.io.grey import ImageLimits
from fpmatch.image.quality.print_quality import why_no_minutiae
from fpmatch.image.quality.ridge_scale import likely_dpi
from fpmatch.prints.reading import decode_print, make_given_print
from fpmatch.templates.minutiae import STANDARD_DPI, check_dpi

if TYPE_CHECKING:
    from fpmatch.prints.reading import GivenPrint
    from fpmatch.server.settings import Limits

LONGEST_NAME: Final = 80
_SEPARATORS: Final = re.compile(r"[/\\]")


@dataclass(frozen=True, slots=True)
class Upload:
    """An uploaded file, and how it is to be read.

    Its name is only shown, and never made a path; `limits` are the sizes that are refused.
    """

    name: str
    data: bytes = field(repr=False)
    limits: Limits
    dpi: float | None = None
    enhance: str = "learned"


def shown_name(given: str | None, otherwise: str) -> str:
    r"""Return the last part of a client's file name on one short line, or another name.

    Examples
    --------
    >>> shown_name("C:\\prints\\ada.tif", "probe"), shown_name("../..", "probe")
    ('ada.tif', 'probe')
    """
    last = _SEPARATORS.split(given or "")[-1]
    printable = "".join(letter for letter in last if letter.isprintable()).strip()
    if not printable.strip("."):
        return otherwise
    if len(printable) > LONGEST_NAME:
        return f"{printable[: LONGEST_NAME - 1]}…"
    return printable


def open_upload(upload: Upload) -> GivenPrint:
    """Return the print in an upload."""
    limits, dpi = upload.limits, upload.dpi
    if dpi is not None:
        check_dpi(dpi)
    bounds = ImageLimits(max_megapixels=limits.megapixels, max_file_megabytes=limits.file_megabytes)
    content = decode_print(upload.data, upload.name, bounds, dpi=dpi)
    if isinstance(content, TemplateRecord):
        first = content.views[0].template
        width, height, own_dpi = first.width, first.height, first.dpi
    else:
        (height, width), own_dpi = content.pixels.shape, content.dpi or likely_dpi(content.pixels)
    used = dpi or own_dpi
    megapixels = width * height * (STANDARD_DPI / used) ** 2 / 1e6
    if megapixels > limits.megapixels_at_500_dpi or width * height > limits.megapixels * 1e6:
        raise ImageError(  # it would occupy a worker for long
            f"{width} x {height} pixels at {used:g} dpi are more than this server accepts: "
            f"{limits.megapixels_at_500_dpi:g} megapixels at {STANDARD_DPI:g} dpi",
            path=upload.name,
        )
    return make_given_print(content, upload.name, dpi=dpi, enhance=upload.enhance)


def open_upload_with_minutiae(upload: Upload) -> GivenPrint:
    """Return the print in an upload, as `open_upload` does, but refuse one without minutiae."""
    given = open_upload(upload)
    if not len(given.template.minutiae):
        why = why_no_minutiae(given.quality)
        raise ImageError(why, path=given.name, code="no minutiae")
    return with_note_on_two_prints(given)
