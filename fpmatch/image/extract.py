"""Extract minutiae: the stages of the algorithm, one call each."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

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
from fpmatch.image.skeleton.minutiae import (
    BRANCH_PX,
    directions,
    filter_spurious,
    find_nodes,
    minutia_quality,
    remove_spurs_and_islands,
)
from fpmatch.image.skeleton.thin import binarize, thin
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
    from fpmatch.image.preprocess.arrays import Box, Grey, Mask, StageRecorder
    from fpmatch.image.preprocess.normalize import NormalizedImage
    from fpmatch.image.quality.print_quality import PrintQuality

# From one window of the ridge spectrum to four palms.
LIMITS_AT_500_DPI: Final = ImageLimits(min_side_px=32, dpi=STANDARD_DPI)
DEFAULT_ENHANCEMENT: Final = "learned"


def extract(
    image: str | Path | GreyImage | NDArray[np.generic],
    dpi: float | None = None,
    *,
    enhance: str = DEFAULT_ENHANCEMENT,
    recorder: StageRecorder | None = None,
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
    recorder : StageRecorder, optional
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
    assessed = assess(image, dpi, enhance=enhance)
    if recorder is not None:
        for stage, array in assessed.stages().items():
            recorder.record(stage, array)
    return assessed.template


def assess(
    image: str | Path | GreyImage | NDArray[np.generic],
    dpi: float | None = None,
    *,
    enhance: str = DEFAULT_ENHANCEMENT,
) -> AssessedPrint:
    """Extract the minutiae of a fingerprint image, with the quality of the image.

    Parameters and errors are those of `extract`.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch import assess
    >>> blank = assess(np.full((200, 200), 255, np.uint8), dpi=500)
    >>> blank.quality.score, str(blank.quality.reasons[0])
    (0, 'no ridges: no fingerprint is found in the image')
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
    height, width = source.pixels.shape
    ridge_field = _ridge_field(ridges, binary, box, grey.shape, zoom)
    stated = dpi is not None or source.dpi is not None
    template = Template(minutiae, width, height, resolution, ridge_field, dpi_known=stated)
    return AssessedPrint(template, grey, zoom, box, normalized, ridges, binary, skeleton)


@dataclass(frozen=True, eq=False)
class AssessedPrint:
    """The template that extraction found in an image, and the quality of the image.

    The arrays are of the stages: `grey` is the image at 500 dpi, resampled by `zoom`; all later
    ones are of the part `box` of it. The quality is computed when it is first asked for.
    """

    template: Template
    grey: Grey = field(repr=False)
    zoom: float = field(repr=False)
    box: Box = field(repr=False)
    normalized: NormalizedImage = field(repr=False)
    ridges: EnhancedPrint = field(repr=False)
    binary: Mask = field(repr=False)
    skeleton: Mask = field(repr=False)

    @cached_property
    def quality(self) -> PrintQuality:
        """Quality of the image, at the resolution of the template."""
        from fpmatch.image.quality.measures import measure_quality  # noqa: PLC0415
        from fpmatch.image.quality.print_quality import grade  # noqa: PLC0415

        return grade(measure_quality(self.stages(with_maps=False)), self.template.dpi)

    def stages(self, *, with_maps: bool = True) -> dict[str, NDArray[Any]]:
        """Return the array of each stage at 500 dpi, by name and in order.

        Images are whole, (H, W); the minutiae have a row each: x, y, angle, kind, quality. Maps of
        orientation, coherence and period are for display.
        """
        ridges, found = self.ridges, self.template.minutiae
        of_box: dict[str, NDArray[Any]] = {"normalised": self.normalized.pixels}
        of_box |= {"enhanced": ridges.enhanced, "mask": ridges.mask}
        of_box |= ridges.maps() if with_maps else {}
        of_box |= {"binary": self.binary, "skeleton": self.skeleton}
        stages: dict[str, NDArray[Any]] = {"input": self.grey}
        for stage, array in of_box.items():
            stages[stage] = self.box.uncrop(array, self.grey.shape, around=MAPS.get(stage, 0.0))
        x, y = ((place + 0.5) * self.zoom - 0.5 for place in (found.x, found.y))
        columns = (x, y, found.angle, found.kind, found.quality)
        return stages | {"minutiae": np.column_stack(columns).astype(np.float32)}


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
