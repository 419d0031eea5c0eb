"""Statistics of the images of a database: ridge period, area, minutiae, grey levels.

Synthetic prints are compared with real ones in this way, and patches of the two are classified by
local statistics of their ridges. Databases with the same statistics may still differ; databases
that differ in one of them can be distinguished by it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.image.preprocess.arrays import StageRecorder
from fpmatch.lab.evaluation.databases.dataset import with_unique_names
from fpmatch.lab.evaluation.databases.extraction import attempt_each_image
from fpmatch.lab.evaluation.run import load_datasets
from fpmatch.templates.minutiae import STANDARD_DPI
from research.commands import PATH, Command, folders, json_file, workers, write_json
from research.experiments.two_sample import NAMES, format_accuracies, patches_of, two_sample
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.dataset import Dataset

SHARES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
"""The quantiles of a distribution that are reported."""
MM_PER_PX: Final = 25.4 / STANDARD_DPI
_DIGITS: Final = 4  # significant ones kept in reports
EXTREMES: Final = (0, 2, 4)
"""Of these quantiles, the ones that tables show."""


@dataclass(frozen=True, slots=True)
class ImageStatistics:
    """The statistics of one image; the foreground is where the extractor finds ridges.

    `period_px`: median ridge period in the foreground, in pixels at 500 dpi; NaN without a
    foreground. `mean`, `contrast`: mean and standard deviation of the grey levels of the whole
    image, 0 to 255. `patches` are the statistics of its patches, (patches, statistics).
    """

    period_px: float
    area_mm2: float  # area of the foreground in square millimetres
    minutiae_per_mm2: float  # extracted minutiae by area; NaN without a foreground
    mean: float
    contrast: float
    ridge_contrast: float  # standard deviation in the foreground alone; NaN without a foreground
    foreground: float  # share of the image that is foreground
    patches: NDArray[np.float64] = field(
        default_factory=lambda: np.empty((0, len(NAMES))), repr=False, compare=False
    )


TITLES: Final = {
    "period_px": ("ridge period, px at 500 dpi", 2),
    "area_mm2": ("foreground, mm²", 0),
    "minutiae_per_mm2": ("minutiae a mm²", 3),
    "mean": ("mean grey", 0),
    "contrast": ("contrast (std of grey)", 1),
    "ridge_contrast": ("contrast in the foreground", 1),
    "foreground": ("foreground, share", 2),
}
"""The title of each statistic, and its decimals."""


@dataclass(frozen=True, slots=True)
class DatabaseStatistics:
    """The statistics of the images of a database.

    `name`: the database's. `prints`: one for each image that can be read, in the database's order.
    `failures`: why the others cannot. `fingers`: the finger of each print.
    """

    name: str
    prints: tuple[ImageStatistics, ...]
    failures: tuple[str, ...] = ()
    fingers: tuple[int | str, ...] = ()

    def patches(self) -> dict[int | str, NDArray[np.float64]]:
        """Return the statistics of the patches of each finger."""
        parts: dict[int | str, list[NDArray[np.float64]]] = {}
        for finger, print_ in zip(self.fingers, self.prints, strict=True):
            parts.setdefault(finger, []).append(print_.patches)
        return {finger: np.concatenate(part) for finger, part in parts.items()}

    def values(self, name: str) -> NDArray[np.float64]:
        """Return the finite values of one statistic, as float64 of shape (N,)."""
        values = np.array([getattr(print_, name) for print_ in self.prints], dtype=np.float64)
        return values[np.isfinite(values)]

    def quantiles(self, name: str) -> tuple[float, ...]:
        """Return the quantiles `SHARES` of one statistic; NaN where no image has it."""
        values = self.values(name)
        if not values.size:
            return (math.nan,) * len(SHARES)
        return tuple(np.quantile(values, SHARES).tolist())

    def as_json(self) -> dict[str, Any]:
        """Return name, number of images, failures and the quantiles of every statistic."""
        return {
            "name": self.name,
            "prints": len(self.prints),
            "failures": list(self.failures),
            "quantiles": {name: [_rounded(q) for q in self.quantiles(name)] for name in TITLES},
        }


def measure_image(path: Path, dpi: float | None) -> ImageStatistics:
    """Measure one image file; without `dpi`, its resolution is the file's, or else 500 dpi."""
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
        patches=patches_of(grey, mask, recorder.stages["orientation"]),
    )


def measure_sets(
    datasets: Sequence[Dataset], *, workers: int | None = None
) -> list[DatabaseStatistics]:
    """Measure all images of some databases."""
    measured = attempt_each_image(datasets, measure_image, stage="measure", workers=workers)
    return [
        DatabaseStatistics(
            dataset.name,
            tuple(attempt.result for attempt in attempts if attempt.result is not None),
            tuple(attempt.reason for attempt in attempts if attempt.result is None),
            tuple(
                impression.finger
                for impression, attempt in zip(dataset.impressions, attempts, strict=True)
                if attempt.result is not None
            ),
        )
        for dataset, attempts in zip(datasets, measured, strict=True)
    ]


def span(sets: Sequence[DatabaseStatistics], name: str) -> tuple[float, float]:
    """Return the range of a statistic in some databases, from the least 5 % to the largest 95 %."""
    quantiles = [s.quantiles(name) for s in sets]
    return min(q[0] for q in quantiles), max(q[-1] for q in quantiles)


def share_outside(
    one: DatabaseStatistics, others: Sequence[DatabaseStatistics], name: str
) -> float:
    """Return the share of a database's images outside the range of others; NaN without values."""
    low, high = span(others, name)
    values = one.values(name)
    return float(((values < low) | (values > high)).mean()) if values.size else math.nan


def statistics_as_json(
    sets: Sequence[DatabaseStatistics], against: Sequence[DatabaseStatistics] = ()
) -> dict[str, Any]:
    """Return the same statistics as a document for JSON."""
    rows = [s.as_json() for s in sets]
    if against:
        for row, s in zip(rows, sets, strict=True):
            row["outside"] = {name: round(share_outside(s, against, name), 4) for name in TITLES}
            row["two_sample"] = two_sample(s.patches(), {o.name: o.patches() for o in against})
    return {"shares": list(SHARES), "sets": rows, "against": [s.as_json() for s in against]}


def format_statistics(prints: Mapping[str, Any]) -> str:
    """Return what `statistics_as_json` returned as a table: a row a database."""
    head = ["", "prints", *(title for title, _ in TITLES.values())]
    rows = [_statistics(s) for s in (*prints["sets"], *prints["against"])]
    if prints["against"]:
        outside = [np.mean([s["outside"][name] for s in prints["sets"]]) for name in TITLES]
        shares = (f"{100 * share:.0f} %" for share in outside)
        rows.append(["*synthetic ones outside the others' span*", "", *shares])
    return markdown_table([head, *rows])


def _statistics(entry: Mapping[str, Any]) -> list[str]:
    cells = [entry["name"], str(entry["prints"])]
    for name, (_, digits) in TITLES.items():
        low, middle, high = (entry["quantiles"][name][k] for k in EXTREMES)
        known = middle is not None
        cells.append(f"{middle:.{digits}f} ({low:.{digits}f}–{high:.{digits}f})" if known else "-")
    return cells


def _rounded(value: float) -> float | None:
    return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research compare-prints synthetic/* --against fvc/fvc2002/DB1_B --json prints.json
""",
)
@folders
@click.option(
    "--against", metavar="DIR", type=PATH, multiple=True, help="Compare with it (repeatable)."
)
@json_file
@workers
def command(
    folders: tuple[Path, ...],
    against: tuple[Path, ...],
    json_file: Path | None,
    workers: int | None,
) -> None:
    """Compare statistics of the prints of FVC-style databases DIR.

    Ridge period, area, minutiae, grey levels and foreground of every print are measured and their
    distributions shown side by side; with --against, also the share of prints outside the range of
    those databases (from the least 5 % to the greatest 95 %), and the
    accuracy of a classifier of patches against each of them: 50 % where they do not differ.
    """
    measured = measure_sets(with_unique_names(load_datasets([*folders, *against])), workers=workers)
    sets, others = measured[: len(folders)], measured[len(folders) :]
    document = statistics_as_json(sets, others)
    click.echo(format_statistics(document))
    if others:
        click.echo(f"\n{format_accuracies(document['sets'])}")
    for one in measured:
        for reason in one.failures:
            click.echo(reason, err=True)
    if json_file:
        write_json(json_file, document)
