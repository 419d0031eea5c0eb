"""The overlay of two prints, one over the other or side by side, as pixels or as a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.drawing.files import png_bytes
from fpmatch.drawing.overlay.page import Print
from fpmatch.drawing.overlay.side_by_side import side_by_side_page
from fpmatch.drawing.overlay.superposed import superposed_page
from fpmatch.drawing.scene.raster import paint
from fpmatch.drawing.scene.svg import svg_text
from fpmatch.errors import OutputError
from fpmatch.output import atomic_write_bytes

if TYPE_CHECKING:
    import os

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Scene
    from fpmatch.matching.result import Verification

SUFFIXES: Final = (".png", ".svg")


def draw(
    probe_image: Any,
    reference_image: Any,
    verification: Verification,
    *,
    side_by_side: bool = False,
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
    >>> from fpmatch.matching.result import Comparison, Verification
    >>> from fpmatch.minutiae import Minutiae, Template
    >>> blank = Template(Minutiae.empty(), width=60, height=40)
    >>> found = Comparison(0.0, None, np.empty((0, 2), np.int32), 0.0, 0.0, 0.0, "no ridges found")
    >>> nothing = Verification(False, 0.0, 1.0, 40.0, "unit-circle", found, blank, blank)
    >>> image = np.full((40, 60), 255, np.uint8)
    >>> draw(image, image, nothing).shape[2]
    3
    """
    return paint(_scene(probe_image, reference_image, verification, side_by_side))


def save_overlay(
    path: str | os.PathLike[str],
    probe_image: Any,
    reference_image: Any,
    verification: Verification,
    *,
    side_by_side: bool = False,
) -> None:
    """Write the picture of `draw` as a PNG, or as an SVG with vector marks and text.

    Parameters
    ----------
    path : path
        The file; its ending is ``.png`` or ``.svg``.
    probe_image, reference_image, verification, side_by_side
        As for `draw`.

    Raises
    ------
    ImageError
        As for `draw`.
    OutputError
        If the ending is another, or the file cannot be written.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in SUFFIXES:
        raise OutputError(f"{target}: an overlay is written as .png or .svg")
    images = probe_image, reference_image
    atomic_write_bytes(
        target, overlay_file(suffix, *images, verification, side_by_side=side_by_side)
    )


def overlay_file(
    suffix: str, probe: Any, reference: Any, verification: Verification, *, side_by_side: bool
) -> bytes:
    """Return the content of the file that `save_overlay` writes, for one of `SUFFIXES`."""
    scene = _scene(probe, reference, verification, side_by_side)
    return svg_text(scene).encode() if suffix == ".svg" else png_bytes(paint(scene))


def _scene(probe: Any, reference: Any, verification: Verification, beside: bool) -> Scene:
    ours = Print.of("probe image", probe, verification.probe)
    theirs = Print.of("reference image", reference, verification.reference)
    if beside or verification.transform is None:
        return side_by_side_page(ours, theirs, verification)
    return superposed_page(ours, theirs, verification, verification.transform)
