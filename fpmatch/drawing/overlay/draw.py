"""The overlay of two prints: superposed, side by side, or their ridge agreement."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.drawing.overlay.page import Print, panel_of
from fpmatch.drawing.overlay.superposed import superposed_page
from fpmatch.drawing.scene.raster import paint, png_bytes
from fpmatch.errors import ImageError, OutputError, check_type
from fpmatch.matching.verification import Verification

# The pages that few calls draw are imported where they are drawn.
if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.overlay.marks import ExaminerMark
    from fpmatch.drawing.scene.items import Scene

NO_TRANSFORM: Final = "no transform was found: the prints are drawn beside each other"
NO_RIDGES: Final = "the ridges were not compared: the overlay is drawn instead"
SUFFIXES: Final = (".png", ".svg")


@dataclass(frozen=True, slots=True)
class View:
    """The picture that `draw` draws; the options exclude each other."""

    side_by_side: bool = False
    ridges: bool = False

    def __post_init__(self) -> None:
        if self.side_by_side and self.ridges:
            raise OutputError("side by side and ridges exclude each other")

    def missing(self, verification: Verification) -> str:
        """Return why another picture is drawn instead, in one line; "" where it is not."""
        if self.side_by_side:
            return ""
        if verification.transform is None:
            return NO_TRANSFORM
        return NO_RIDGES if self.ridges and verification.ridge_map is None else ""


def draw(
    probe_image: Any,
    reference_image: Any,
    verification: Verification,
    *,
    side_by_side: bool = False,
    ridges: bool = False,
) -> NDArray[np.uint8]:
    """Draw the probe, moved by the recovered transform, over the reference.

    The reference is printed in orange ink and the probe in blue; ridges of both that coincide turn
    dark. Paired minutiae are linked, unpaired ones fainter. Above are decision, score and
    transform, below a legend. Where no transform was found the prints are drawn side by side.

    Parameters
    ----------
    probe_image, reference_image : ndarray of uint8, shape (H, W), or object with ``pixels``
        The grey images that the templates of `verification` were taken from.
    verification : Verification
        Their comparison.
    side_by_side : bool
        Draw the prints beside each other, with the pairs numbered and linked.
    ridges : bool
        Draw the reference, its cells coloured by the agreement of the ridges (see
        `Verification.ridge_map`); the overlay where the ridges were not compared.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        The picture, RGB.

    Raises
    ------
    ImageError
        If an image is not grey of 8 bits, or not of its template's size.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch import Verification, draw
    >>> from fpmatch.templates.minutiae import Minutiae, Template
    >>> blank = Template(Minutiae.empty(), width=60, height=40)
    >>> nothing = Verification(False, 0.0, 1.0, 40.0, "unit-circle", blank, blank)
    >>> image = np.full((40, 60), 255, np.uint8)
    >>> draw(image, image, nothing).shape[2]
    3
    """
    view = View(side_by_side, ridges)
    return paint(overlay_scene(probe_image, reference_image, verification, view))


def save_overlay(
    path: str | os.PathLike[str],
    probe_image: Any,
    reference_image: Any,
    verification: Verification,
    *,
    side_by_side: bool = False,
    ridges: bool = False,
) -> None:
    """Write the picture of `draw` as a PNG, or as an SVG with vector marks and text.

    Parameters
    ----------
    path : path
        The file; its ending is ``.png`` or ``.svg``.
    probe_image, reference_image, verification, side_by_side, ridges
        As for `draw`.

    Raises
    ------
    ImageError
        As for `draw`.
    OutputError
        If the ending is another, or the file cannot be written.
    """
    check_overlay(path)  # before the picture is drawn
    view = View(side_by_side, ridges)
    save_scene(path, overlay_scene(probe_image, reference_image, verification, view))


def check_overlay(path: str | os.PathLike[str]) -> None:
    """Raise an OutputError for an overlay that could not be written, before it is drawn."""
    check_writable(path, what="an overlay", suffixes=SUFFIXES)


def save_scene(
    path: str | os.PathLike[str], scene: Scene, painted: NDArray[np.uint8] | None = None
) -> None:
    """Write a scene, which may be painted already; errors are raised as by `check_overlay`."""
    check_overlay(path)
    atomic_write_bytes(path, _content(Path(path).suffix.lower(), scene, painted))


def overlay_file(
    suffix: str, probe: Any, reference: Any, verification: Verification, view: View
) -> bytes:
    """Return the content of the file that `save_overlay` writes, for one of `SUFFIXES`."""
    return _content(suffix, overlay_scene(probe, reference, verification, view))


def _content(suffix: str, scene: Scene, painted: NDArray[np.uint8] | None = None) -> bytes:
    if suffix == ".png":
        return png_bytes(paint(scene) if painted is None else painted)
    from fpmatch.drawing.scene.svg import svg_text  # noqa: PLC0415

    return svg_text(scene).encode()


def panel_picture(
    probe: Any,
    reference: Any,
    verification: Verification,
    view: View,
    own: Sequence[ExaminerMark] = (),
) -> NDArray[np.uint8]:
    """Draw what `draw` draws, without caption and legend, and the marks of an examiner."""
    scene = overlay_scene(probe, reference, verification, view, own)
    panel = panel_of(scene)
    return paint(scene)[math.ceil(panel.y) : math.floor(panel.bottom)]


def overlay_scene(
    probe: Any,
    reference: Any,
    verification: Verification,
    view: View,
    own: Sequence[ExaminerMark] = (),
) -> Scene:
    """Return what `draw` paints, which can also be written as SVG; its errors are raised."""
    check_type(verification, Verification, "what is drawn is a Verification", ImageError)
    ours = Print.of("probe image", probe, verification.probe)
    theirs = Print.of("reference image", reference, verification.reference)
    transform = verification.transform
    if view.side_by_side or transform is None:
        from fpmatch.drawing.overlay.side_by_side import side_by_side_page  # noqa: PLC0415

        return side_by_side_page(ours, theirs, verification, own)
    if view.ridges and verification.ridge_map is not None:
        from fpmatch.drawing.overlay.ridge_page import ridge_page  # noqa: PLC0415

        return ridge_page(theirs, verification, verification.ridge_map, own)
    return superposed_page(ours, theirs, verification, transform, own)
