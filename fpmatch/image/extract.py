"""From a picture to its minutiae: the stages, one after the other."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.errors import ImageError
from fpmatch.image.binarize import BinarizationParameters, binarize
from fpmatch.image.blend import BlendParameters, blend
from fpmatch.image.cells import cells_to_pixels
from fpmatch.image.crossing_number import find_nodes
from fpmatch.image.enhance import EnhancementParameters, enhance
from fpmatch.image.frequency import PeriodParameters, ridge_period
from fpmatch.image.normalize import NormalizationParameters, normalize
from fpmatch.image.orientation import (
    OrientationParameters,
    orientation_at_pixels,
    ridge_orientation,
)
from fpmatch.image.quality import QualityParameters, minutia_quality
from fpmatch.image.read import GreyImage, ImageLimits, as_grey, read_image
from fpmatch.image.recorder import NoRecorder
from fpmatch.image.segment import SegmentationParameters, mask_at_pixels, segment
from fpmatch.image.spectrum import SpectrumParameters, ridge_spectrum
from fpmatch.image.spurious import (
    SpuriousParameters,
    directions,
    keep_genuine,
    remove_spurs_and_islands,
)
from fpmatch.image.thin import thin
from fpmatch.minutiae import STANDARD_DPI, Minutiae, MinutiaKind, RidgeField, Template, check_dpi

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.image.crossing_number import SkeletonNodes
    from fpmatch.image.orientation import OrientationField
    from fpmatch.image.recorder import Recorder
    from fpmatch.image.spectrum import RidgeSpectrum

MIN_SIDE_PX: Final = 32  # at 500 dpi: one window of the ridge spectrum
MAX_MEGAPIXELS: Final = 16.0  # at 500 dpi: four palms


@dataclass(frozen=True, slots=True)
class ExtractionParameters:
    """Gather the parameters of every stage; lengths in pixels at 500 dpi."""

    normalization: NormalizationParameters = field(default_factory=NormalizationParameters)
    spectrum: SpectrumParameters = field(default_factory=SpectrumParameters)
    segmentation: SegmentationParameters = field(default_factory=SegmentationParameters)
    orientation: OrientationParameters = field(default_factory=OrientationParameters)
    period: PeriodParameters = field(default_factory=PeriodParameters)
    enhancement: EnhancementParameters = field(default_factory=EnhancementParameters)
    blend: BlendParameters = field(default_factory=BlendParameters)
    binarization: BinarizationParameters = field(default_factory=BinarizationParameters)
    spurious: SpuriousParameters = field(default_factory=SpuriousParameters)
    quality: QualityParameters = field(default_factory=QualityParameters)


def extract(
    image: str | Path | GreyImage | NDArray[np.generic],
    dpi: float | None = None,
    *,
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
        If the file cannot be read, or the image cannot hold a fingerprint.
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
    source = _as_image(image)
    resolution = check_dpi(next(d for d in (dpi, source.dpi, STANDARD_DPI) if d is not None))
    try:
        grey, zoom = resample(source.pixels, resolution)
    except ImageError as error:
        raise ImageError(f"{source.source}: {error}") from error
    note.record("input", grey)

    normalized = normalize(grey, p.normalization)
    note.record("normalised", normalized.pixels)
    spectrum = ridge_spectrum(normalized.pixels, p.spectrum)
    cells = segment(normalized, spectrum, p.segmentation)
    mask = mask_at_pixels(cells, spectrum)
    note.record("mask", mask)
    flow = _follow_ridges(normalized.pixels, spectrum, cells, mask, p)
    for _ in range(p.blend.rounds):
        blended = blend(normalized.pixels, flow.enhanced, mask, p.blend)
        spectrum = ridge_spectrum(blended, p.spectrum)
        flow = _follow_ridges(normalized.pixels, spectrum, cells, mask, p)
    note.record("orientation", np.where(mask, flow.orientation, np.nan))
    note.record("coherence", cells_to_pixels(flow.field.coherence, spectrum))
    note.record("period", np.where(mask, flow.period, np.nan))
    note.record("enhanced", flow.enhanced)
    binary = binarize(flow.enhanced, mask, p.binarization)
    note.record("binary", binary)
    skeleton = remove_spurs_and_islands(thin(binary), p.spurious)
    note.record("skeleton", skeleton)

    nodes = find_nodes(skeleton, p.spurious.branch_px)
    angle = directions(nodes, p.spurious.direction_px)
    keep = keep_genuine(nodes, angle, mask, p.spurious)
    quality = minutia_quality(normalized.pixels, flow.enhanced, nodes.x, nodes.y, p.quality)
    minutiae = _minutiae(nodes, angle, quality, keep, zoom)
    note.record("minutiae", _as_columns(minutiae, zoom))
    height, width = source.pixels.shape
    return Template(
        minutiae,
        width=width,
        height=height,
        dpi=resolution,
        field=_ridge_field(flow.field, cells, p.spectrum.step_px / zoom),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _RidgeFlow:
    """How the ridges run: the field of cells, orientation and period of pixels, enhanced image."""

    field: OrientationField
    orientation: NDArray[np.float32]
    period: NDArray[np.float32]
    enhanced: NDArray[np.float32]


def _follow_ridges(
    pixels: NDArray[np.float32],
    spectrum: RidgeSpectrum,
    cells: NDArray[np.bool_],
    mask: NDArray[np.bool_],
    p: ExtractionParameters,
) -> _RidgeFlow:
    """Measure orientation and period in the spectrum, and enhance `pixels` along them."""
    field = ridge_orientation(spectrum, cells, p.orientation)
    orientation = orientation_at_pixels(field.orientation, spectrum)
    period = cells_to_pixels(ridge_period(spectrum, field, cells, p.period), spectrum)
    enhanced = enhance(pixels, mask, orientation, period, p.enhancement)
    return _RidgeFlow(field, orientation, period, enhanced)


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
    zoom: float,
) -> Minutiae:
    """Return the kept nodes as minutiae, in pixels of the input image."""
    kind = np.where(nodes.crossing_number == 1, MinutiaKind.ENDING, MinutiaKind.BIFURCATION)
    return Minutiae(
        x=(nodes.x[keep] + 0.5) / zoom - 0.5,
        y=(nodes.y[keep] + 0.5) / zoom - 0.5,
        angle=angle[keep],
        kind=kind[keep],
        quality=quality[keep],
    )


def _as_columns(minutiae: Minutiae, zoom: float) -> NDArray[np.float32]:
    """Return minutiae as an array (N, 5): x, y (pixels at 500 dpi), angle, kind, quality."""
    x, y = (minutiae.x + 0.5) * zoom - 0.5, (minutiae.y + 0.5) * zoom - 0.5
    columns = [x, y, minutiae.angle, minutiae.kind, minutiae.quality]
    return np.column_stack(columns).astype(np.float32)


def _ridge_field(
    field: OrientationField, cells: NDArray[np.bool_], step: float
) -> RidgeField | None:
    """Return the orientation field as a template keeps it, on twice as large cells; None if empty.

    A large cell belongs to the print where at least half of it does.
    """
    if not cells.any():
        return None
    rows, columns = cells.shape
    even = ((0, rows % 2), (0, columns % 2))
    inside = np.pad(cells, even)
    doubled = np.pad(np.exp(2j * field.orientation) * cells, even)
    blocks = (inside.shape[0] // 2, 2, inside.shape[1] // 2, 2)
    orientation = np.mod(np.angle(doubled.reshape(blocks).sum(axis=(1, 3))) / 2, np.pi)
    return RidgeField(
        2 * step, orientation.astype(np.float32), inside.reshape(blocks).sum(axis=(1, 3)) >= 2
    )
