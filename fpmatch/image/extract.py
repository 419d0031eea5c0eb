"""From a picture to its minutiae: the stages, one after the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.errors import ImageError
from fpmatch.image.enhancement.enhancers import ENHANCERS
from fpmatch.image.io.read import GreyImage, ImageLimits, as_grey, read_image
from fpmatch.image.parameters import ExtractionParameters
from fpmatch.image.preprocess.foreground import Box, foreground_box
from fpmatch.image.preprocess.normalize import normalize
from fpmatch.image.recorder import NoRecorder, UncropRecorder
from fpmatch.image.skeleton.binarize import binarize
from fpmatch.image.skeleton.crossing_number import find_nodes
from fpmatch.image.skeleton.minutia_quality import minutia_quality
from fpmatch.image.skeleton.spurious import directions, filter_spurious, remove_spurs_and_islands
from fpmatch.image.skeleton.thin import thin
from fpmatch.minutiae import STANDARD_DPI, Minutiae, MinutiaKind, RidgeField, Template, check_dpi

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.image.enhancement.enhancers import EnhancedPrint, Enhancer
    from fpmatch.image.recorder import Recorder
    from fpmatch.image.skeleton.crossing_number import SkeletonNodes

MIN_SIDE_PX: Final = 32  # at 500 dpi: one window of the ridge spectrum
MAX_MEGAPIXELS: Final = 16.0  # at 500 dpi: four palms
DEFAULT_ENHANCEMENT: Final = "learned"


def extract(
    image: str | Path | GreyImage | NDArray[np.generic],
    dpi: float | None = None,
    *,
    enhance: str = DEFAULT_ENHANCEMENT,
    parameters: ExtractionParameters | None = None,
    recorder: Recorder | None = None,
) -> Template:
    """Extract the minutiae of a fingerprint image.

    Parameters
    ----------
    image : str, Path, GreyImage or ndarray, shape (H, W) or (H, W, 3 or 4)
        A file, an image that `read_image` returned, or pixels (ridges dark).
    dpi : float, optional
        Resolution; by default what the file says, and 500 where it says nothing.
    enhance : str
        "learned": by a small network; "filters": by oriented filters.
    parameters : ExtractionParameters, optional
        Parameters of the stages.
    recorder : Recorder, optional
        Receives the array that each stage produces, by name.

    Returns
    -------
    Template
        Minutiae in pixels of the input image; none where the image shows no ridges.

    Raises
    ------
    ImageReadError, ImageError
        If the file cannot be read, the image cannot hold a fingerprint, or `enhance` is unknown.
    ResolutionError
        If the resolution is outside 100 to 4000 dpi.

    References
    ----------
    Choi, Lee, Lee, "Point pattern matching algorithm using unit-circle parametrization", whose
    feature points are the endings and bifurcations of the thinned binary print.

    Examples
    --------
    >>> blank = np.full((200, 200), 255, np.uint8)
    >>> len(extract(blank, dpi=500).minutiae)
    0
    """
    p = parameters or ExtractionParameters()
    note = recorder or NoRecorder()
    follow_ridges = _way(enhance)
    source = _as_image(image)
    resolution = check_dpi(next(d for d in (dpi, source.dpi, STANDARD_DPI) if d is not None))
    try:
        grey, zoom = resample(source.pixels, resolution)
    except ImageError as error:
        raise ImageError(f"{source.source}: {error}") from error
    note.record("input", grey)

    box = foreground_box(grey, p.foreground)
    if recorder is not None:
        note = UncropRecorder(note, box, (grey.shape[0], grey.shape[1]))
    normalized = normalize(grey[box.slices], p.normalization)
    note.record("normalised", normalized.pixels)
    flow = follow_ridges(normalized, p, note)
    binary = binarize(flow.enhanced, flow.mask, p.binarization)
    note.record("binary", binary)
    skeleton = remove_spurs_and_islands(thin(binary), p.spurious)
    note.record("skeleton", skeleton)

    nodes = find_nodes(skeleton, p.spurious.branch_px)
    angle = directions(nodes, p.spurious.direction_px)
    keep = filter_spurious(nodes, angle, flow.mask, p.spurious)
    x, y = nodes.x[keep], nodes.y[keep]
    quality = minutia_quality(normalized.pixels, flow.enhanced, x, y, p.quality)
    minutiae = _minutiae(nodes, angle, quality, keep, (box.left, box.top), zoom)
    note.record("minutiae", _as_columns(minutiae, zoom))
    height, width = source.pixels.shape
    return Template(
        minutiae,
        width=width,
        height=height,
        dpi=resolution,
        field=_ridge_field(flow, binary, box, (grey.shape[0], grey.shape[1]), zoom),
    )


def _way(enhance: str) -> Enhancer:
    try:
        return ENHANCERS[enhance]
    except KeyError:
        raise ImageError(f"no enhancement {enhance!r}: there are {', '.join(ENHANCERS)}") from None


def resample(grey: NDArray[np.uint8], dpi: float) -> tuple[NDArray[np.uint8], float]:
    """Resample an image to 500 dpi.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Image.
    dpi : float
        Its resolution.

    Returns
    -------
    ndarray of uint8, shape (H', W')
        The image at 500 dpi; the image itself where it is so already.
    float
        The zoom: 500 / dpi.

    Raises
    ------
    ImageError
        If the image is too small or too large for a print at this resolution.
    """
    zoom = STANDARD_DPI / dpi
    if abs(zoom - 1.0) < 1e-3:
        return grey, 1.0
    interpolation = cv2.INTER_AREA if zoom < 0.75 else cv2.INTER_CUBIC
    height, width = grey.shape
    size = (max(1, round(width * zoom)), max(1, round(height * zoom)))
    _check_resampled(size, dpi)
    return np.asarray(cv2.resize(grey, size, interpolation=interpolation), np.uint8), zoom


def _check_resampled(size: tuple[int, int], dpi: float) -> None:
    """Refuse what is too large or too small for a print once it is at 500 dpi."""
    try:
        ImageLimits(min_side_px=MIN_SIDE_PX, max_megapixels=MAX_MEGAPIXELS).check(*size)
    except ImageError as error:
        raise ImageError(f"resampled from {dpi:g} to {STANDARD_DPI:g} dpi, {error}") from error


def _as_image(image: str | Path | GreyImage | NDArray[np.generic]) -> GreyImage:
    if isinstance(image, GreyImage):
        return image
    if isinstance(image, np.ndarray):
        return GreyImage(as_grey(image), None, "array")
    return read_image(image)


def _minutiae(
    nodes: SkeletonNodes,
    angle: NDArray[np.float32],
    quality: NDArray[np.uint8],
    keep: NDArray[np.bool_],
    origin: tuple[int, int],
    zoom: float,
) -> Minutiae:
    """Return the kept nodes as minutiae, in pixels of the input image."""
    left, top = origin
    kind = np.where(nodes.crossing_number == 1, MinutiaKind.ENDING, MinutiaKind.BIFURCATION)
    return Minutiae(
        x=(nodes.x[keep] + left + 0.5) / zoom - 0.5,
        y=(nodes.y[keep] + top + 0.5) / zoom - 0.5,
        angle=angle[keep],
        kind=kind[keep],
        quality=quality,
    )


def _as_columns(minutiae: Minutiae, zoom: float) -> NDArray[np.float32]:
    """Return minutiae as an array (N, 5): x, y (pixels at 500 dpi), angle, kind, quality."""
    x, y = (minutiae.x + 0.5) * zoom - 0.5, (minutiae.y + 0.5) * zoom - 0.5
    columns = [x, y, minutiae.angle, minutiae.kind, minutiae.quality]
    return np.column_stack(columns).astype(np.float32)


def _ridge_field(
    flow: EnhancedPrint, binary: NDArray[np.bool_], box: Box, shape: tuple[int, int], zoom: float
) -> RidgeField | None:
    """Return the ridges as a template keeps them, on blocks twice as large; None if there are none.

    A large block belongs to the print where at least half of it does. The picture of its ridges is
    the binary image at an eighth of the block's side.
    """
    if not flow.blocks.any():
        return None
    even = tuple((0, side % 2) for side in flow.blocks.shape)
    inside = np.pad(flow.blocks, even)
    doubled = np.pad(np.exp(2j * flow.field.orientation) * flow.blocks, even)
    rows, columns = (side // 2 for side in inside.shape)
    blocks = (rows, 2, columns, 2)
    orientation = np.mod(np.angle(doubled.reshape(blocks).sum(axis=(1, 3))) / 2, np.pi)
    mask = inside.reshape(blocks).sum(axis=(1, 3)) >= 2
    step = 2 * flow.step_px
    whole = np.zeros((rows * step, columns * step), np.uint8)
    whole[: binary.shape[0], : binary.shape[1]] = binary
    bits = cv2.resize(255 * whole, (8 * columns, 8 * rows), interpolation=cv2.INTER_AREA) > 127
    in_cells = bits.reshape(rows, 8, columns, 8).transpose(0, 2, 1, 3).reshape(rows, columns, 64)
    ridges = np.packbits(in_cells, axis=2, bitorder="little").view("<u8")[..., 0]
    whole_image = (
        box.uncrop(blocks, shape, step) for blocks in (orientation.astype(np.float32), mask, ridges)
    )
    return RidgeField(step / zoom, *whole_image)
