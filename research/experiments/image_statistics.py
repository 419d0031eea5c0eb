"""What prints look like in figures: how their ridges lie, how much there is, how dark it is.

Two databases whose prints differ in none of these may still differ; two that differ in one of
them are told apart by it. Synthetic prints are held against real ones this way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.errors import DatasetError
from fpmatch.evaluation.extraction import attempt_each_image
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.evaluation.dataset import Dataset

SHARES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Of a distribution, which quantiles are told."""
MM_PER_PX: Final = 25.4 / STANDARD_DPI
_DIGITS: Final = 4  # significant ones kept in reports


@dataclass(frozen=True, slots=True)
class ImageStatistics:
    """Hold what was measured on one print; the foreground is where the extractor finds ridges.

    Parameters
    ----------
    period_px : float
        Median distance from ridge to ridge in the foreground, in pixels at 500 dpi; not a number
        where there is none.
    area_mm2 : float
        Area of the foreground in square millimetres.
    minutiae_per_mm2 : float
        Extracted minutiae for each of them; not a number where there is none.
    mean, contrast : float
        Mean and standard deviation of the grey levels of the whole picture, 0 to 255.
    ridge_contrast : float
        Standard deviation in the foreground alone; not a number where there is none.
    foreground : float
        Share of the picture that the foreground takes.
    """

    period_px: float
    area_mm2: float
    minutiae_per_mm2: float
    mean: float
    contrast: float
    ridge_contrast: float
    foreground: float


STATISTICS: Final = tuple(ImageStatistics.__dataclass_fields__)
"""Names of the figures, in order."""


@dataclass(frozen=True, slots=True)
class DatabaseStatistics:
    """Hold the figures of one database's prints.

    Parameters
    ----------
    name : str
        The database's.
    prints : tuple of ImageStatistics
        One for each print that could be used, in the database's order.
    failures : tuple of str
        Why the others could not be.
    """

    name: str
    prints: tuple[ImageStatistics, ...]
    failures: tuple[str, ...] = ()

    def values(self, name: str) -> NDArray[np.float64]:
        """Return one name of all prints that have it, as float64 of shape (N,)."""
        values = np.array([getattr(print_, name) for print_ in self.prints], dtype=np.float64)
        return values[np.isfinite(values)]

    def quantiles(self, name: str) -> tuple[float, ...]:
        """Return the quantiles `SHARES` of one name; not numbers where no print has it."""
        values = self.values(name)
        if not values.size:
            return (math.nan,) * len(SHARES)
        return tuple(np.quantile(values, SHARES).tolist())

    def as_json(self) -> dict[str, Any]:
        """Return name, number of prints, failures and the quantiles of every name."""
        return {
            "name": self.name,
            "prints": len(self.prints),
            "failures": list(self.failures),
            "quantiles": {f: [_rounded(q) for q in self.quantiles(f)] for f in STATISTICS},
        }


def measure_image(path: Path, dpi: float | None) -> ImageStatistics:
    """Measure one print.

    Parameters
    ----------
    path : Path
        The image file.
    dpi : float or None
        Its resolution; None takes what the file says, and 500 where it says nothing.

    Returns
    -------
    ImageStatistics
        Its figures.

    Raises
    ------
    ImageReadError, ImageError, ResolutionError
        If the file cannot be read, or holds no picture that could be a print.
    """
    from fpmatch.image.extract import extract  # noqa: PLC0415
    from fpmatch.image.io.read import read_image  # noqa: PLC0415
    from fpmatch.image.recorder import StageRecorder  # noqa: PLC0415

    image = read_image(path)
    recorder = StageRecorder()
    minutiae = extract(image, dpi, enhance="filters", recorder=recorder).minutiae
    mask, grey = recorder.stages["mask"], recorder.stages["input"]
    area = float(mask.sum()) * MM_PER_PX**2
    period = recorder.stages["period"][mask]
    return ImageStatistics(
        period_px=float(np.median(period)) if period.size else math.nan,
        area_mm2=area,
        minutiae_per_mm2=len(minutiae) / area if area else math.nan,
        mean=float(image.pixels.mean()),
        contrast=float(image.pixels.std()),
        ridge_contrast=float(grey[mask].std()) if area else math.nan,
        foreground=float(mask.mean()),
    )


def measure_sets(
    datasets: Sequence[Dataset],
    *,
    workers: int | None = None,
    progress: Progress = no_progress,
) -> list[DatabaseStatistics]:
    """Measure all prints of some databases.

    Parameters
    ----------
    datasets : sequence of Dataset
        The databases.
    workers : int, optional
        Processes to use (default: one a core). The results are the same for any number.
    progress : callable
        Told of stage "measure", in images.

    Returns
    -------
    list of DatabaseStatistics
        One for each database; prints that cannot be used are kept as failures.

    Raises
    ------
    DatasetError
        If there is no database.
    """
    if not datasets:
        raise DatasetError("no database given")
    measured = attempt_each_image(
        datasets, measure_image, stage="measure", workers=workers, progress=progress
    )
    return [
        DatabaseStatistics(
            dataset.name,
            tuple(attempt.result for attempt in attempts if attempt.result is not None),
            tuple(attempt.reason for attempt in attempts if attempt.result is None),
        )
        for dataset, attempts in zip(datasets, measured, strict=True)
    ]


def span(sets: Sequence[DatabaseStatistics], name: str) -> tuple[float, float]:
    """Return what some databases span of a name: from the least 5 % to the greatest 95 %.

    Examples
    --------
    >>> even = ImageStatistics(9.0, 100.0, 0.2, 200.0, 50.0, 60.0, 0.5)
    >>> span([DatabaseStatistics("one", (even, even))], "period_px")
    (9.0, 9.0)
    """
    quantiles = [s.quantiles(name) for s in sets]
    return min(q[0] for q in quantiles), max(q[-1] for q in quantiles)


def share_outside(
    one: DatabaseStatistics, others: Sequence[DatabaseStatistics], name: str
) -> float:
    """Return the share of a database's prints that lie outside what others span of a name.

    Of the others' own prints, about a tenth would, at most; not a number where none has it.
    """
    low, high = span(others, name)
    values = one.values(name)
    return float(((values < low) | (values > high)).mean()) if values.size else math.nan


def _rounded(value: float) -> float | None:
    return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
