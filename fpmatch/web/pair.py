"""Two prints of one request: their verification, and all that the page shows of it."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.drawing.files import png_bytes, webp_bytes
from fpmatch.drawing.ink import shrunk
from fpmatch.drawing.overlay.draw import overlay_file
from fpmatch.drawing.overlay.page import Print, ink_of
from fpmatch.drawing.palette import PROBE_INK, REFERENCE_INK
from fpmatch.drawing.scene.placement import zoomed
from fpmatch.drawing.words import odds
from fpmatch.errors import GalleryError
from fpmatch.matching.calibration import fmr_to_score
from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.matching.matchers.paper import PaperMatcher, matcher_with
from fpmatch.matching.verify import verify
from fpmatch.report import as_dict, as_rows
from fpmatch.scale import find_scale
from fpmatch.web.errors import NotFoundError, RequestError
from fpmatch.web.place import opened_gallery
from fpmatch.web.prints import GivenPrint, of_template, open_upload
from fpmatch.web.upload import Upload

if TYPE_CHECKING:
    from fpmatch.drawing.palette import Colour
    from fpmatch.drawing.scene.items import Ink
    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.matching.result import Verification
    from fpmatch.scale import ScaleMeasurement
    from fpmatch.web.settings import Limits

LARGEST_SIDE_SHOWN: Final = 1600  # pixels of a print on the page
_INKED: Final = 96  # coverage from which on ink is no stain


@dataclass(frozen=True, slots=True)
class PairOptions:
    """Hold what a request says about one comparison.

    Parameters
    ----------
    dpi, probe_dpi, reference_dpi : float or None
        Resolution of both, or of either, in dots per inch; None where the file shall tell.
    matcher : str
        Name of the matcher.
    fmr, threshold : float or None
        False match rate or score to decide at; at most one of them.
    rho, area_tolerance : float or None
        Parameters of the matcher "paper"; None for its defaults.
    enhance : str
        How ridges are found in images.
    """

    dpi: float | None = None
    probe_dpi: float | None = None
    reference_dpi: float | None = None
    matcher: str = DEFAULT_MATCHER
    fmr: float | None = None
    threshold: float | None = None
    enhance: str = "learned"
    rho: float | None = None
    area_tolerance: float | None = None

    def score_to_reach(self) -> float | None:
        """Return the score to decide at; None for the matcher's own decision."""
        if self.fmr is not None and self.threshold is not None:
            raise RequestError("fmr and threshold exclude each other")
        if self.rho is not None and (self.fmr, self.threshold) != (None, None):
            raise RequestError("rho decides without a score: give no fmr or threshold")
        return self.threshold if self.fmr is None else fmr_to_score(self.fmr)

    def chosen_matcher(self) -> str | PaperMatcher:
        """Return the matcher, by name unless it has parameters."""
        return matcher_with(self.matcher, self.rho, self.area_tolerance)


@dataclass(frozen=True, slots=True)
class Enrolled:
    """Name an enrolled print that a probe is to be compared with."""

    gallery: str
    number: int


@dataclass(frozen=True, slots=True, eq=False)
class _Compared:
    probe: GivenPrint
    reference: GivenPrint
    verification: Verification
    scale: ScaleMeasurement | None

    def document(self) -> dict[str, Any]:
        sides = self.probe.name, self.reference.name
        return as_dict(self.verification, *sides, self.scale, self.quality)

    @property
    def quality(self) -> dict[str, PrintQuality | None]:
        """How good the pictures of both sides are."""
        return {"probe": self.probe.quality, "reference": self.reference.quality}


def verify_pair(
    probe: Upload, reference: Upload | Enrolled, options: PairOptions, limits: Limits
) -> dict[str, Any]:
    """Return the object that ``fpmatch verify --json`` prints.

    Parameters
    ----------
    probe : Upload
        The one print.
    reference : Upload or Enrolled
        The other.
    options : PairOptions
        How to compare them.
    limits : Limits
        What is refused.

    Returns
    -------
    dict
        As `fpmatch.report.as_dict` returns it.

    Raises
    ------
    FpmatchError
        If a print cannot be read or used, or an option is out of its range.
    """
    return _compare(probe, reference, options, limits).document()


def draw_pair(
    probe: Upload,
    reference: Upload | Enrolled,
    options: PairOptions,
    limits: Limits,
    file_format: str,
    side_by_side: bool,
) -> bytes:
    """Return the overlay of two prints as the content of a PNG or SVG file.

    Parameters
    ----------
    probe, reference, options, limits
        As for `verify_pair`.
    file_format : str
        "png" or "svg".
    side_by_side : bool
        Whether to set the prints beside each other.

    Returns
    -------
    bytes
        The file.

    Raises
    ------
    FpmatchError
        As `verify_pair` does.
    """
    c = _compare(probe, reference, options, limits, told=False)
    return overlay_file(
        f".{file_format}",
        c.probe.pixels,
        c.reference.pixels,
        c.verification,
        side_by_side=side_by_side,
    )


def show_pair(
    probe: Upload, reference: Upload | Enrolled, options: PairOptions, limits: Limits
) -> dict[str, Any]:
    """Return a verification with all that the page needs to show it.

    Parameters
    ----------
    probe, reference, options, limits
        As for `verify_pair`.

    Returns
    -------
    dict
        ``result``, as `verify_pair` returns it; ``rows``, the evidence in words; ``fmr_reach``;
        ``pairs``, indices of minutiae; ``probe`` and ``reference`` with their minutiae and
        pictures, as data URLs: ``picture`` as it was taken, ``ink`` with its ridges in colour.

    Raises
    ------
    FpmatchError
        As `verify_pair` does.
    """
    c = _compare(probe, reference, options, limits)
    v = c.verification
    return {
        "result": c.document(),
        "odds": odds(v.fmr),
        "rows": [
            {"label": label, "words": words} for label, words in as_rows(v, c.scale, c.quality)
        ],
        "fmr_reach": v.smallest_measured_fmr,
        "pairs": v.pairs.reshape(-1, 2).tolist(),
        "probe": shown_print(c.probe, PROBE_INK),
        "reference": shown_print(c.reference, REFERENCE_INK),
    }


def shown_print(given: GivenPrint, colour: Colour) -> dict[str, Any]:
    """Return one print as the page shows it.

    Parameters
    ----------
    given : GivenPrint
        The print.
    colour : Colour
        Colour of its ink.

    Returns
    -------
    dict
        JSON values only; a minutia is x, y, angle, kind, quality.
    """
    template = given.template
    m = template.minutiae
    height, width = given.pixels.shape
    factor = min(1.0, LARGEST_SIDE_SHOWN / max(height, width))
    ink = ink_of(
        Print(given.pixels, template), zoomed(factor, (-0.5, -0.5), (-0.5, -0.5)), colour, ""
    )
    return {
        "name": given.name,
        "kind": given.kind,
        "width": template.width,
        "height": template.height,
        "dpi": template.dpi,
        "notes": list(given.notes),
        "extent": _extent(given, ink, factor),
        "minutiae": [
            [round(float(x), 2), round(float(y), 2), round(float(angle), 4), int(kind), int(q)]
            for x, y, angle, kind, q in zip(m.x, m.y, m.angle, m.kind, m.quality, strict=True)
        ],
        "picture": data_url(webp_bytes(shrunk(given.pixels, factor), 85), "webp"),
        "ink": None if ink is None else data_url(png_bytes(_rgba(ink.coverage, colour)), "png"),
    }


def _extent(given: GivenPrint, ink: Ink | None, factor: float) -> list[int]:
    """Return left, top, right and bottom of what shows ridges, in pixels of the print."""
    height, width = given.pixels.shape
    inked = np.zeros((1, 1), bool) if ink is None else ink.coverage > _INKED
    columns, rows = np.flatnonzero(inked.any(axis=0)), np.flatnonzero(inked.any(axis=1))
    if not columns.size:
        return [0, 0, width, height]
    ends = (columns[0], rows[0], columns[-1] + 1, rows[-1] + 1)
    return [round(float(end) / factor) for end in ends]


def data_url(content: bytes, kind: str) -> str:
    """Return a picture as a URL that holds it.

    Examples
    --------
    >>> data_url(b"GIF", "gif")
    'data:image/gif;base64,R0lG'
    """
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _compare(
    probe: Upload,
    reference: Upload | Enrolled,
    options: PairOptions,
    limits: Limits,
    *,
    told: bool = True,
) -> _Compared:
    """Compare two prints; measure scale and quality only where they are to be told."""
    threshold = options.score_to_reach()
    ours = _opened(probe, options.probe_dpi, options, limits, judged=told)
    theirs = (
        _opened(reference, options.reference_dpi, options, limits, judged=told)
        if isinstance(reference, Upload)
        else _from_gallery(reference)
    )
    verification = verify(
        ours.template, theirs.template, matcher=options.chosen_matcher(), threshold=threshold
    )
    scale = find_scale(verification) if told else None
    return _Compared(ours, theirs, verification, scale)


def _opened(
    upload: Upload, dpi: float | None, options: PairOptions, limits: Limits, *, judged: bool
) -> GivenPrint:
    resolution = options.dpi if dpi is None else dpi
    return open_upload(upload, limits, dpi=resolution, enhance=options.enhance, judged=judged)


def _from_gallery(enrolled: Enrolled) -> GivenPrint:
    with opened_gallery(enrolled.gallery) as gallery:
        try:
            entry = gallery.entry(enrolled.number)
        except GalleryError as error:
            raise NotFoundError(
                f"no print is enrolled under the number {enrolled.number}"
            ) from error
        template = gallery.template(enrolled.number)
    return of_template(str(entry.label), template)


def _rgba(coverage: np.ndarray[Any, np.dtype[np.uint8]], colour: Colour) -> Any:
    rgba = np.empty((*coverage.shape, 4), np.uint8)
    rgba[:, :, :3] = colour
    rgba[:, :, 3] = coverage
    return rgba
