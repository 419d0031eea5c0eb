"""The template of a print together with the quality of its image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.image.extract import DEFAULT_ENHANCEMENT, extract
from fpmatch.image.quality.measures import MEASURED_STAGES, QualityMeasures, measure_quality
from fpmatch.image.quality.print_quality import (
    MIN_CONCENTRATION,
    PrintQuality,
    grade,
    wrong_resolution,
)
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.image.io.read import GreyImage
    from fpmatch.templates.minutiae import Template


@dataclass(frozen=True, slots=True)
class AssessedPrint:
    """The template that extraction found in an image, and the quality of the image."""

    template: Template
    quality: PrintQuality


_NOTHING_FOUND: Final = {"no ridges", "too small"}  # reasons of an image to look at enlarged
_ENLARGED: Final = 2.5


class QualityRecorder:
    """Keep the stages of an extraction that quality is measured on."""

    wanted = frozenset(MEASURED_STAGES)

    def __init__(self) -> None:
        self._stages: dict[str, NDArray[Any]] = {}

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Keep the array itself, which no later stage changes."""
        self._stages[stage] = array

    def measures(self) -> QualityMeasures:
        """Return the quality measures of the print that was extracted last."""
        return measure_quality(self._stages)

    def quality(self, dpi: float) -> PrintQuality:
        """Return the quality of that print, whose resolution was taken to be `dpi`."""
        quality = grade(self.measures(), dpi)
        codes = {reason.code for reason in quality.reasons}
        return (self._quality_enlarged(dpi) if codes >= _NOTHING_FOUND else None) or quality

    def _quality_enlarged(self, dpi: float) -> PrintQuality | None:
        """Return the quality of a small image with ridges too fine to be found; None without."""
        grey = np.asarray(self._stages["input"], np.uint8)
        enlarged = cv2.resize(grey, None, fx=_ENLARGED, fy=_ENLARGED, interpolation=cv2.INTER_CUBIC)
        stages = QualityRecorder()
        extract(np.asarray(enlarged, np.uint8), STANDARD_DPI, recorder=stages)
        measures = stages.measures()
        if not measures.ridges_mm2 > 0 or measures.concentration < MIN_CONCENTRATION:
            return None
        return PrintQuality(0, (wrong_resolution(measures.period_px / _ENLARGED, dpi),))


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
