"""Extract minutiae: the stages of the algorithm, one call each; and grade the image on the way."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Final

import cv2
import numpy as np

from fpmatch.errors import ImageError
from fpmatch.image.enhancement.enhancers import ENHANCERS, MAPS
from fpmatch.image.io.grey import GreyImage, ImageLimits
from fpmatch.image.io.read import name_errors, read_image
from fpmatch.image.preprocess.arrays import BLOCK_PX
from fpmatch.image.preprocess.foreground import foreground_box, stretch_contrast
from fpmatch.image.preprocess.normalize import normalize
from fpmatch.image.quality.ridge_scale import likely_dpi
from fpmatch.image.skeleton.binarize import binarize
from fpmatch.image.skeleton.minutiae import (
    BRANCH_PX,
    directions,
    filter_spurious,
    find_nodes,
    minutia_quality,
    remove_spurs_and_islands,
)
from fpmatch.image.skeleton.thin import thin
from fpmatch.templates.minutiae import (
    STANDARD_DPI,
    Minutiae,
    MinutiaKind,
    RidgeField,
    Template,
    check_dpi,
)

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.image.enhancement.enhancers import EnhancedPrint
    from fpmatch.image.preprocess.arrays import Box, Grey, Mask, Recorder
    from fpmatch.image.quality.print_quality import PrintQuality

# From one window of the ridge spectrum to four palms.
LIMITS_AT_500_DPI: Final = ImageLimits(min_side_px=32, dpi=STANDARD_DPI)
DEFAULT_ENHANCEMENT: Final = "learned"


def extract(
    image: str | Path | GreyImage | NDArray[np.generic],
    dpi: float | None = None,
    *,
    enhance: str = DEFAULT_ENHANCEMENT,
    recorder: Recorder | None = None,
) -> Template:
    """Extract the minutiae of a fingerprint image.

    Parameters
    ----------
    image : str, path-like, bytes, ndarray, PIL image or GreyImage
        An image, as for `read_image`.
    dpi : float, optional
        Resolution; by default the file's own; where that is unknown, 500, or the usual one that
        the ridges indicate.
    enhance : str
        "learned": by a small network; "filters": by oriented filters.
    recorder : Recorder, optional
        Receives the array of each stage, by name.

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
    >>> import numpy as np
    >>> from fpmatch import extract
    >>> blank = np.full((200, 200), 255, np.uint8)
    >>> len(extract(blank, dpi=500).minutiae)
    0
    """
    if enhance not in ENHANCERS:
        raise ImageError(f"no enhancement {enhance!r}: there are {', '.join(ENHANCERS)}")
    source = read_image(image, dpi=dpi)
    known = (source.dpi or source.likely_dpi) if dpi is None else dpi
    resolution = likely_dpi(source.pixels) if known is None else check_dpi(known)
    with name_errors(source.source):
        grey, zoom = resample(source.pixels, resolution)

    stretched = stretch_contrast(grey, source.pixels)
    box = foreground_box(stretched)
    normalized = normalize(stretched[box.slices])
    ridges = ENHANCERS[enhance](normalized)
    binary = binarize(ridges.enhanced, ridges.mask)
    skeleton = remove_spurs_and_islands(thin(binary))

    nodes = find_nodes(skeleton, BRANCH_PX)
    angle = directions(nodes)
    genuine = filter_spurious(nodes, angle, ridges.mask)
    x, y = nodes.x[genuine], nodes.y[genuine]
    ending = nodes.crossing_number[genuine] == 1
    minutiae = Minutiae(
        x=(x + box.left + 0.5) / zoom - 0.5,
        y=(y + box.top + 0.5) / zoom - 0.5,
        angle=angle[genuine],
        kind=np.where(ending, MinutiaKind.ENDING, MinutiaKind.BIFURCATION),
        quality=minutia_quality(normalized.pixels, ridges.enhanced, x, y),
    )
    if recorder is not None:
        at_500_dpi = ((place + 0.5) * zoom - 0.5 for place in (minutiae.x, minutiae.y))
        columns = (*at_500_dpi, minutiae.angle, minutiae.kind, minutiae.quality)
        stages: dict[str, NDArray[Any]] = {"input": grey, "normalised": normalized.pixels}
        stages |= {"enhanced": ridges.enhanced, "mask": ridges.mask}
        if not hasattr(recorder, "wanted") or {*recorder.wanted} & {*MAPS}:
            stages |= ridges.maps()
        stages |= {"binary": binary, "skeleton": skeleton}
        stages["minutiae"] = np.column_stack(columns).astype(np.float32)
        _record(recorder, stages, box, grey.shape)
    height, width = source.pixels.shape
    ridge_field = _ridge_field(ridges, binary, box, grey.shape, zoom)
    stated = dpi is not None or source.dpi is not None
    return Template(minutiae, width, height, resolution, ridge_field, dpi_known=stated)


def _record(
    recorder: Recorder, stages: dict[str, NDArray[Any]], box: Box, shape: tuple[int, ...]
) -> None:
    """Pass on the stages that are wanted, images of the box padded to a whole image, `shape`."""
    for stage, array in stages.items():
        if stage not in getattr(recorder, "wanted", stages):
            continue
        if array.shape == (box.bottom - box.top, box.right - box.left) != shape:
            array = box.uncrop(array, shape, around=MAPS.get(stage, 0.0))  # noqa: PLW2901
        recorder.record(stage, array)


def resample(grey: Grey, dpi: float) -> tuple[Grey, float]:
    """Resample an image (H, W) to 500 dpi, unless it has that; return it and the zoom 500 / dpi."""
    zoom = STANDARD_DPI / dpi
    height, width = grey.shape
    if abs(zoom - 1.0) < 1e-3:
        replace(LIMITS_AT_500_DPI, min_side_px=1).check(width, height)
        return grey, 1.0
    interpolation = cv2.INTER_AREA if zoom < 0.75 else cv2.INTER_CUBIC
    size = max(1, round(width * zoom)), max(1, round(height * zoom))
    try:
        LIMITS_AT_500_DPI.check(*size)
    except ImageError as error:
        raise ImageError(f"resampled from {dpi:g} to {STANDARD_DPI:g} dpi, {error}") from error
    return np.asarray(cv2.resize(grey, size, interpolation=interpolation), np.uint8), zoom


def _ridge_field(
    print_: EnhancedPrint, binary: Mask, box: Box, shape: tuple[int, ...], zoom: float
) -> RidgeField | None:
    """Return the ridge field of a template, on cells of two by two blocks; None without ridges.

    A cell belongs to the print where at least two of its blocks do. The image of its ridges has
    8 by 8 bits, sampled from the binary image.
    """
    if not print_.blocks.any():
        return None
    even = tuple((0, side % 2) for side in print_.blocks.shape)
    inside = np.pad(print_.blocks, even)
    doubled = np.pad(np.exp(2j * print_.field.orientation) * print_.blocks, even)
    rows, columns = (side // 2 for side in inside.shape)
    two_by_two = (rows, 2, columns, 2)
    orientation = np.mod(np.angle(doubled.reshape(two_by_two).sum(axis=(1, 3))) / 2, np.pi)
    mask = inside.reshape(two_by_two).sum(axis=(1, 3)) >= 2
    step = 2 * BLOCK_PX
    whole = np.zeros((rows * step, columns * step), np.uint8)
    whole[: binary.shape[0], : binary.shape[1]] = binary
    bits = cv2.resize(255 * whole, (8 * columns, 8 * rows), interpolation=cv2.INTER_AREA) > 127
    in_cells = bits.reshape(rows, 8, columns, 8).transpose(0, 2, 1, 3).reshape(rows, columns, 64)
    ridges = np.packbits(in_cells, axis=2, bitorder="little").view("<u8")[..., 0]
    fields = (orientation.astype(np.float32), mask, ridges)
    return RidgeField(step / zoom, *(box.uncrop(field, shape, step) for field in fields))


@dataclass(frozen=True, slots=True)
class AssessedPrint:
    """The template that extraction found in an image, and the quality of the image."""

    template: Template
    quality: PrintQuality


@dataclass(frozen=True, slots=True)
class QualityRecorder:
    """Keep the stages of an extraction on which quality is measured."""

    wanted: ClassVar = ("input", "normalised", "enhanced", "mask", "minutiae")
    stages: dict[str, NDArray[Any]] = field(default_factory=dict)

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Keep the array itself, which no later stage changes."""
        self.stages[stage] = array

    def quality(self, dpi: float) -> PrintQuality:
        """Return the quality of the print, whose resolution was taken to be `dpi`."""
        from fpmatch.image.quality.measures import measure_quality  # noqa: PLC0415
        from fpmatch.image.quality.print_quality import grade  # noqa: PLC0415

        return grade(measure_quality(self.stages), dpi)


def assess(
    image: str | Path | GreyImage | NDArray[np.generic],
    dpi: float | None = None,
    *,
    enhance: str = DEFAULT_ENHANCEMENT,
) -> AssessedPrint:
    """Extract the minutiae of a fingerprint image, and grade the image.

    Parameters and errors are those of `extract`.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch import assess
    >>> blank = assess(np.full((200, 200), 255, np.uint8), dpi=500)
    >>> blank.quality.score, str(blank.quality.reasons[0])
    (0, 'no ridges: no fingerprint is found in the image')
    """
    stages = QualityRecorder()
    template = extract(image, dpi, enhance=enhance, recorder=stages)
    return AssessedPrint(template, stages.quality(template.dpi))
