"""The template of a print together with the quality of its image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fpmatch.image.extract import DEFAULT_ENHANCEMENT, extract
from fpmatch.image.quality.measures import MEASURED_STAGES, QualityMeasures, measure_quality
from fpmatch.image.quality.print_quality import PrintQuality, grade

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.image.io.read import GreyImage
    from fpmatch.minutiae import Template


@dataclass(frozen=True, slots=True)
class AssessedPrint:
    """Hold the template that extraction found in an image, and the quality of the image."""

    template: Template
    quality: PrintQuality


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
        return grade(self.measures(), dpi)


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
    >>> blank = assess(np.full((200, 200), 255, np.uint8), dpi=500)
    >>> blank.quality.score, str(blank.quality.reasons[0])
    (0, 'no ridges: no fingerprint is found in the image')
    """
    stages = QualityRecorder()
    template = extract(image, dpi, enhance=enhance, recorder=stages)
    return AssessedPrint(template, stages.quality(template.dpi))
