"""Extract the templates of whole databases, each impression once."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.engine.workers import Progress, no_progress, run_chunks
from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from fpmatch.evaluation.dataset import Dataset
    from fpmatch.minutiae import Template

    Extractor = Callable[[Path, float | None], Template]
    ImageChunk = list[tuple[Path, float | None]]

IMAGES_PER_CHUNK: Final = 4


@dataclass(frozen=True, slots=True)
class Extraction:
    """Hold what became of one image.

    Parameters
    ----------
    template : Template or None
        Its template; None where extraction failed or found no minutiae.
    reason : str
        Why there is none; else "".
    cpu_ms : float
        CPU time that the attempt took, in milliseconds.
    """

    template: Template | None
    reason: str
    cpu_ms: float


@dataclass(frozen=True, slots=True)
class ExtractedSet:
    """Hold a database with what became of each of its impressions, in the same order."""

    dataset: Dataset
    extractions: tuple[Extraction, ...]

    @property
    def failures(self) -> list[tuple[Path, str]]:
        """The images that gave no template, and why."""
        return [
            (impression.path, extraction.reason)
            for impression, extraction in zip(
                self.dataset.impressions, self.extractions, strict=True
            )
            if extraction.template is None
        ]

    @property
    def median_cpu_ms(self) -> float:
        """Median CPU time of an image, in milliseconds."""
        return float(np.median([e.cpu_ms for e in self.extractions]))


def extract_image(path: Path, dpi: float | None) -> Template:
    """Extract a template from an image file by `fpmatch.image.extract`."""
    from fpmatch.image.extract import extract  # noqa: PLC0415

    return extract(path, dpi=dpi)


def extract_datasets(
    datasets: Sequence[Dataset],
    *,
    extractor: Extractor = extract_image,
    workers: int | None = None,
    progress: Progress = no_progress,
) -> list[ExtractedSet]:
    """Extract a template from every impression of some databases.

    Parameters
    ----------
    datasets : sequence of Dataset
        The databases.
    extractor : callable
        Makes a template from a path and a resolution (None: the file's own); a function at the
        top of a module. By default `extract_image`.
    workers : int, optional
        Processes to use (default: one a core).
    progress : callable
        Told of stage "extract", in images.

    Returns
    -------
    list of ExtractedSet
        The databases in their order. Images that cannot be used are kept as failures.
    """
    images = [(i.path, dataset.dpi) for dataset in datasets for i in dataset.impressions]
    chunks = [images[k : k + IMAGES_PER_CHUNK] for k in range(0, len(images), IMAGES_PER_CHUNK)]
    done = 0

    def finished(chunk: ImageChunk) -> None:
        nonlocal done
        done += len(chunk)
        progress("extract", done, len(images))

    progress("extract", 0, len(images))
    results = run_chunks(_extract_chunk, extractor, chunks, workers=workers, finished=finished)
    extractions = iter([extraction for chunk in results for extraction in chunk])
    return [
        ExtractedSet(dataset, tuple(next(extractions) for _ in dataset.impressions))
        for dataset in datasets
    ]


def _extract_chunk(extractor: Extractor, chunk: ImageChunk) -> list[Extraction]:
    return [_extract_one(extractor, path, dpi) for path, dpi in chunk]


def _extract_one(extractor: Extractor, path: Path, dpi: float | None) -> Extraction:
    start = time.process_time()
    template: Template | None = None
    try:
        template = extractor(path, dpi)
        reason = "" if len(template.minutiae) else f"{path}: no minutiae found"
    except FpmatchError as error:
        reason = str(error)
    cpu_ms = 1000.0 * (time.process_time() - start)
    return Extraction(None if reason else template, reason, cpu_ms)
