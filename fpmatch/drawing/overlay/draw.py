"""The overlay of two prints: superposed, side by side, or their ridge agreement."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import numpy as np

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.drawing.overlay.views import ridge_page, side_by_side_page, superposed_page
from fpmatch.drawing.scene.raster import paint, png_bytes
from fpmatch.errors import ImageError, OutputError

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Scene
    from fpmatch.matching.verify import Verification

SUFFIXES: Final = (".png", ".svg")


View: TypeAlias = Literal["superposed", "side-by-side", "ridges"]


def view_of(*, side_by_side: bool, ridges: bool) -> View:
    """Return the view that two options choose; raises OutputError where both are set."""
    if side_by_side and ridges:
        raise OutputError("side by side and ridges exclude each other")
    return "side-by-side" if side_by_side else "ridges" if ridges else "superposed"


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
    view = view_of(side_by_side=side_by_side, ridges=ridges)
    return paint(overlay_scene(probe_image, reference_image, verification, view))


def save_scene(path: str | os.PathLike[str], scene: Scene) -> None:
    """Write a scene as PNG or SVG, by the ending of its file; raises OutputError."""
    check_writable(path, what="an overlay", suffixes=SUFFIXES)
    atomic_write_bytes(path, scene_bytes(Path(path).suffix.lower(), scene))


def scene_bytes(suffix: str, scene: Scene) -> bytes:
    """Return the content of a file with a scene, by its ending, one of `SUFFIXES`."""
    if suffix == ".png":
        return png_bytes(paint(scene))
    from fpmatch.drawing.scene.svg import svg_text  # noqa: PLC0415

    return svg_text(scene).encode()


def overlay_scene(
    probe: Any, reference: Any, verification: Verification, view: View = "superposed"
) -> Scene:
    """Return what `draw` paints, which can also be written as SVG; its errors are raised."""
    v = verification
    images = []
    for side, image, t in (("probe", probe, v.probe), ("reference", reference, v.reference)):
        pixels = np.asarray(getattr(image, "pixels", image))
        if pixels.dtype != np.uint8 or pixels.ndim != 2 or pixels.size == 0:
            raise ImageError(
                f"{side} image: expected a grey image of 8 bits, shape (H, W), "
                f"not {pixels.dtype} of shape {pixels.shape}"
            )
        if pixels.shape != (t.height, t.width):
            raise ImageError(
                f"{side} image: the image is {pixels.shape[1]} x {pixels.shape[0]} pixels, "
                f"but its template is of one of {t.width} x {t.height}"
            )
        images.append(pixels)
    ours, theirs = images
    if view == "side-by-side" or v.transform is None:
        return side_by_side_page((ours, theirs), v)
    if view == "ridges" and v.ridge_map is not None:
        return ridge_page(theirs, v, v.ridge_map)
    return superposed_page((ours, theirs), v, v.transform)
