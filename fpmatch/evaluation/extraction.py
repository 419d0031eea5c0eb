"""Extract the templates of whole databases, each impression once."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.errors import FpmatchError
from fpmatch.evaluation.each_image import for_each_image
from fpmatch.gallery.prints import ExtractedPrint
from fpmatch.image.io.read import read_image
from fpmatch.image.quality.folder_polarity import PolarityReader, find_polarities

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from fpmatch.engine.engine import Engine
    from fpmatch.evaluation.dataset import Dataset
    from fpmatch.evaluation.each_image import ImageChunk
    from fpmatch.image.io.read import GreyImage
    from fpmatch.minutiae import Template

    Extractor = Callable[[Path, float | None], Template | ExtractedPrint]


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
    dpi_assumed : bool
        Whether its resolution had to be assumed.
    notes : tuple of str
        What was noticed on reading it.
    """

    template: Template | None
    reason: str
    cpu_ms: float
    dpi_assumed: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ExtractedSet:
    """Hold a database with what became of each of its impressions, in the same order."""

    dataset: Dataset
    extractions: tuple[Extraction, ...]

    @property
    def failures(self) -> list[tuple[Path, str]]:
        """The images that gave no template, and why."""
        return [
            (path, extraction.reason)
            for path, extraction in self._each()
            if extraction.template is None
        ]

    @property
    def assumed(self) -> list[Path]:
        """The images whose resolution had to be assumed."""
        return [path for path, extraction in self._each() if extraction.dpi_assumed]

    @property
    def notes(self) -> list[tuple[Path, tuple[str, ...]]]:
        """The images that something was noticed on, and what."""
        return [(path, extraction.notes) for path, extraction in self._each() if extraction.notes]

    def _each(self) -> Iterator[tuple[Path, Extraction]]:
        paths = (impression.path for impression in self.dataset.impressions)
        return zip(paths, self.extractions, strict=True)

    @property
    def median_cpu_ms(self) -> float:
        """Median CPU time of an image, in milliseconds."""
        return float(np.median([e.cpu_ms for e in self.extractions]))


def extract_image(
    path: Path,
    dpi: float | None,
    enhance: str | None = None,
    reader: Callable[[Path], GreyImage] = read_image,
) -> ExtractedPrint:
    """Extract a template from an image file by `fpmatch.image.extract`, by default in its way."""
    from fpmatch.image.extract import DEFAULT_ENHANCEMENT, extract  # noqa: PLC0415

    image = reader(path)
    template = extract(image, dpi=dpi, enhance=enhance or DEFAULT_ENHANCEMENT)
    return ExtractedPrint(template, dpi is None and image.dpi is None, image.notes)


def extractor_of(enhance: str, reader: Callable[[Path], GreyImage] = read_image) -> Extractor:
    """Return what extracts a template from an image file with ridges found in the way named."""
    return partial(extract_image, enhance=enhance, reader=reader)


def dataset_reader(
    datasets: Sequence[Dataset], reader: Callable[..., GreyImage] = read_image
) -> PolarityReader[GreyImage]:
    """Return what reads the images of some databases, those of a folder with one polarity.

    Parameters
    ----------
    datasets : sequence of Dataset
        The databases.
    reader : callable
        As for `fpmatch.image.quality.folder_polarity.find_polarities`.

    Returns
    -------
    PolarityReader
        A reader for `extractor_of`.
    """
    paths = [impression.path for dataset in datasets for impression in dataset.impressions]
    return PolarityReader(reader, find_polarities(paths, reader=reader))


def extract_datasets(
    datasets: Sequence[Dataset],
    *,
    extractor: Extractor | None = None,
    workers: int | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    stage: str = "extract",
) -> list[ExtractedSet]:
    """Extract a template from every impression of some databases.

    Parameters
    ----------
    datasets : sequence of Dataset
        The databases.
    extractor : callable
        Makes a template from a path and a resolution (None: the file's own), alone or in an
        `ExtractedPrint` with what was noticed; a function at the top of a module. By default
        `extract_image`, the images of a folder read with one polarity.
    workers : int, optional
        Processes to use (default: one a core).
    engine : Engine, optional
        As for `fpmatch.engine.workers.run_chunks`.
    progress : callable
        Called as ``progress(stage, done, total)``, in images.
    stage : str
        Name of the stage, for `progress`.

    Returns
    -------
    list of ExtractedSet
        The databases in their order. Images that cannot be used are kept as failures.
    """
    found = for_each_image(
        datasets,
        _extract_chunk,
        extractor or partial(extract_image, reader=dataset_reader(datasets)),
        stage=stage,
        workers=workers,
        engine=engine,
        progress=progress,
    )
    return [ExtractedSet(*row) for row in zip(datasets, found, strict=True)]


def _extract_chunk(extractor: Extractor, chunk: ImageChunk) -> list[Extraction]:
    return [_extract_one(extractor, path, dpi) for path, dpi in chunk]


def _extract_one(extractor: Extractor, path: Path, dpi: float | None) -> Extraction:
    start = time.process_time()
    found: ExtractedPrint | None = None
    try:
        made = extractor(path, dpi)
        found = made if isinstance(made, ExtractedPrint) else ExtractedPrint(made)
        reason = "" if len(found.template.minutiae) else f"{path}: no minutiae found"
    except FpmatchError as error:
        reason = str(error)
    cpu_ms = 1000.0 * (time.process_time() - start)
    if found is None:
        return Extraction(None, reason, cpu_ms)
    template = None if reason else found.template
    return Extraction(template, reason, cpu_ms, found.dpi_assumed, found.notes)
