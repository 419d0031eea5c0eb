"""The public functions on prints, given as files, pictures, arrays or templates."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.html import html_table
from fpmatch.matching.registry import DEFAULT_MATCHER
from fpmatch.matching.verify import Verification
from fpmatch.matching.verify import verify as verify_templates
from fpmatch.prints.report import as_rows
from fpmatch.templates.minutiae import Template

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Scene
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
    from fpmatch.prints.reading import GivenPrint

# Pixels in a notebook.
_OVERLAY_WIDTH: Final = 1000
_SHOWN_WIDTH: Final = 480


@dataclass(frozen=True, slots=True, eq=False)
class Overlay:
    """A drawn overlay; a notebook shows a reduced copy of it.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (height, width, 3)
        The picture, RGB.
    scene : Scene
        The same as marks and text, for SVG.
    """

    pixels: NDArray[np.uint8]
    scene: Scene = field(repr=False)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the picture as PNG, or as SVG with vector marks and text.

        Parameters
        ----------
        path : path
            The file; its ending is ``.png`` or ``.svg``. Folders that are missing are made.

        Raises
        ------
        OutputError
            If the ending is another, or the file cannot be written.
        """
        from fpmatch.drawing.overlay.draw import save_scene  # noqa: PLC0415

        save_scene(path, self.scene)

    def __repr__(self) -> str:
        height, width, _ = self.pixels.shape
        return f"Overlay({width} x {height} px)"

    def _repr_png_(self) -> bytes:
        from fpmatch.drawing.scene.raster import png_bytes, reduced  # noqa: PLC0415

        return png_bytes(reduced(self.pixels, width=_OVERLAY_WIDTH, height=2 * _OVERLAY_WIDTH))


@dataclass(frozen=True, eq=False)
class VerifiedPrints(Verification):
    """A verification that draws its prints; a notebook shows result and overlay.

    Of a print given as a template, the ridges are drawn.
    """

    def overlay(self, *, side_by_side: bool = False, ridges: bool = False) -> Overlay:
        """Draw the probe, moved by the transform, over the reference; see `fpmatch.draw`.

        Parameters
        ----------
        side_by_side : bool
            Draw the prints beside each other.
        ridges : bool
            Draw the agreement of the ridges over the reference; see `Verification.ridge_map`.

        Raises
        ------
        OutputError
            If both are set.
        """
        from fpmatch.drawing.overlay.draw import overlay_scene, view_of  # noqa: PLC0415
        from fpmatch.drawing.scene.ink import ridge_picture  # noqa: PLC0415  (after the decision)
        from fpmatch.drawing.scene.raster import paint  # noqa: PLC0415

        probe, reference = (
            ridge_picture(template) if image is None else image
            for image, template in zip(self.images, (self.probe, self.reference), strict=True)
        )
        view = view_of(side_by_side=side_by_side, ridges=ridges)
        scene = overlay_scene(probe, reference, self, view)
        return Overlay(paint(scene), scene)

    @cached_property
    def _shown(self) -> NDArray[np.uint8]:
        """The overlay, small enough for a notebook."""
        from fpmatch.drawing.scene.raster import reduced  # noqa: PLC0415

        return reduced(self.overlay().pixels, width=_SHOWN_WIDTH, height=2 * _SHOWN_WIDTH)

    def _repr_html_(self) -> str:
        from fpmatch.drawing.scene.raster import data_url, webp_bytes  # noqa: PLC0415
        from fpmatch.prints.report import outcome  # noqa: PLC0415

        rows = as_rows(self)
        picture = f'<img src="{data_url(webp_bytes(self._shown), "webp")}">'
        return f"<b>{outcome(self)}</b>{html_table(rows, left=2)}{picture}"

    def _repr_png_(self) -> bytes:
        from fpmatch.drawing.scene.raster import png_bytes  # noqa: PLC0415

        return png_bytes(self._shown)


def as_template(print_: Any, *, dpi: float | None = None, enhance: str = "learned") -> Template:
    """Return the template of a print, whatever represents it.

    Parameters
    ----------
    print_ : Template, str, path-like, bytes, GreyImage, ndarray or PIL image
        A template; a file with an image or a template, or its bytes; or an image, as for
        `read_image`.
    dpi : float, optional
        Resolution of an image (default: that in ``dataset.toml`` beside a file, else in the file;
        else 500, or the usual one that the ridges indicate).
    enhance : str
        Enhancement of the ridges; see `extract`.

    Returns
    -------
    Template
        The template given, loaded, or extracted.

    Raises
    ------
    ImageReadError, ImageError, TemplateError
        If a file cannot be read, or a picture is none of a fingerprint.
    DatasetError
        If a ``dataset.toml`` beside a file is malformed.
    ResolutionError
        If the resolution is outside 100 to 4000 dpi.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch import as_template
    >>> as_template(np.full((200, 200), 255, np.uint8))
    Template(200 x 200 px, 500 dpi, 0 minutiae)
    """
    return given_print(print_, dpi=dpi, enhance=enhance).template


def verify(
    probe: Any,
    reference: Any,
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    threshold: float | None = None,
    calibration: Calibration | None = None,
    dpi: float | None = None,
    enhance: str = "learned",
) -> VerifiedPrints:
    """Decide whether two prints come from the same finger.

    Parameters
    ----------
    probe, reference : Template, str, path-like, bytes, GreyImage, ndarray or PIL image
        The two impressions, as for `as_template`.
    matcher : str or Matcher
        Name of the matcher, one of `matcher_names`, perhaps with parameters, ``"paper:rho=0.9"``;
        its place, ``"package.module:OBJECT"``; or a matcher, as ``PaperMatcher(rho=0.9)``.
    threshold : float, optional
        Score from which on the answer is yes: 40 for a false match rate of 0.01 %,
        ``-10·log10(FMR)`` in general (see `fmr_to_score`). Default: the matcher's own rule where it
        has one (the matcher "paper": more than a share ρ of the minutiae paired), else 40.
    calibration : Calibration, optional
        Turns similarities into scores (default: as measured by the package).
    dpi : float, optional
        Resolution of images (default: that in ``dataset.toml`` beside a file, else in the file;
        else the usual one that the ridges and the match indicate).
    enhance : str
        Enhancement of the ridges; see `extract`.

    Returns
    -------
    VerifiedPrints
        Decision, score, transform and pairs; where the answer is no, the reason.

    Raises
    ------
    MatcherError
        If the matcher is unknown, or not calibrated and without a rule of its own, or the threshold
        is not in 0..100.
    ImageReadError, ImageError, TemplateError, ResolutionError
        If a print cannot be read or used.
    DatasetError
        If a ``dataset.toml`` beside a file is malformed.

    References
    ----------
    Choi, Lee, Lee, "Point pattern matching algorithm using unit-circle parametrization".

    Examples
    --------
    >>> from fpmatch import Minutiae, Template, verify
    >>> empty = Template(Minutiae.empty(), width=300, height=300)
    >>> result = verify(empty, empty)
    >>> result.match, result.score
    (False, 0.0)
    """
    options: dict[str, Any] = {
        "matcher": matcher,
        "threshold": threshold,
        "calibration": calibration,
    }
    if isinstance(probe, Template) and isinstance(reference, Template):
        verified = verify_templates(probe, reference, **options)
    else:
        from fpmatch.prints.pair import verify_given  # noqa: PLC0415  (not needed for templates)

        sides = [given_print(one, dpi=dpi, enhance=enhance) for one in (probe, reference)]
        verified = verify_given(*sides, **options).verification
    return VerifiedPrints(**{one.name: getattr(verified, one.name) for one in fields(verified)})


def given_print(print_: Any, *, dpi: float | None = None, enhance: str = "learned") -> GivenPrint:
    """Return a print with its template, and what is known of it; see `as_template`."""
    from fpmatch.image.io.read import read_image  # noqa: PLC0415  (not for templates)
    from fpmatch.prints import reading  # noqa: PLC0415

    if isinstance(print_, Template):
        source, _ = reading.dpi_source(print_)
        return reading.GivenPrint("template", print_, dpi_source=source)
    if isinstance(print_, str | os.PathLike):
        path = Path(print_)
        return reading.read_given_print(path, reading.PrintReader(), dpi=dpi, enhance=enhance)
    if isinstance(print_, bytes):
        content = reading.decode_print(print_, "image", dpi=dpi)
    else:
        content = read_image(print_, dpi=dpi)
    return reading.make_given_print(content, "image", dpi=dpi, enhance=enhance)
