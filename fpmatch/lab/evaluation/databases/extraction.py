"""Extraction of the templates of whole databases."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.formats.record import TemplateRecord
from fpmatch.gallery.engine.workers import (
    Attempt,
    Progress,
    attempt_all,
    no_progress,
    results_of_each,
)
from fpmatch.gallery.listing.print_file import PrintFile, resolution_notes
from fpmatch.gallery.listing.prints import ExtractedPrint, extract_print
from fpmatch.image.folder_traits import FolderReader, find_traits
from fpmatch.image.quality.print_quality import why_no_minutiae
from fpmatch.prints.reading import PrintReader, dpi_source

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.image.io.read import GreyImage
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.lab.evaluation.databases.protocol import Impression
    from fpmatch.templates.minutiae import Template

    Extractor = Callable[[Path, float | None], Template | ExtractedPrint]

Result = TypeVar("Result")

_READER: Final = PrintReader()


@dataclass(frozen=True, slots=True)
class Extraction:
    """The template of one image, None where extraction failed or found no minutiae.

    `reason` is then the reason, else "". `quality` is that of the image, 0 to 100; None where it
    was not measured.
    """

    template: Template | None
    reason: str
    cpu_ms: float
    dpi_assumed: bool = False
    notes: tuple[str, ...] = ()
    quality: int | None = None


@dataclass(frozen=True, slots=True)
class ExtractedSet:
    """A database with the extractions of its impressions, in their order."""

    dataset: Dataset
    extractions: tuple[Extraction, ...]

    @property
    def failures(self) -> list[tuple[Path, str]]:
        """The images that gave no template, and why."""
        return [(path, one.reason) for path, one in self._each() if one.template is None]

    @property
    def assumed(self) -> list[Path]:
        """The images whose resolution had to be assumed."""
        return [path for path, one in self._each() if one.dpi_assumed]

    @property
    def notes(self) -> list[tuple[Path, tuple[str, ...]]]:
        """The images with notes, and these; those on the whole database are with its place."""
        whole = [(Path(self.dataset.place), self.dataset.notes)] if self.dataset.notes else []
        templates = [one.template for one in self.extractions]
        on_dpi = resolution_notes([None if one is None else one.dpi for one in templates])
        noted = [
            (path, (*one.notes, *more))
            for (path, one), more in zip(self._each(), on_dpi, strict=True)
        ]
        return [*whole, *((path, notes) for path, notes in noted if notes)]

    @property
    def median_cpu_ms(self) -> float:
        """Median CPU time of an image, in milliseconds."""
        return float(np.median([one.cpu_ms for one in self.extractions]))

    def _each(self) -> Iterator[tuple[Path, Extraction]]:
        paths = (impression.path for impression in self.dataset.impressions)
        return zip(paths, self.extractions, strict=True)


def extract_image(
    path: Path,
    dpi: float | None,
    enhance: str | None = None,
    reader: Callable[[Path], GreyImage | TemplateRecord] = _READER,
    *,
    graded: bool = False,
) -> ExtractedPrint:
    """Extract a template from an image file by `fpmatch.image.extract`; read it from any other.

    An image is `graded` with its quality, which takes a tenth of the time of the extraction.
    """
    from fpmatch.image.extract import DEFAULT_ENHANCEMENT, assess  # noqa: PLC0415

    image = reader(path)
    if isinstance(image, TemplateRecord):
        return extract_print(PrintFile(path, dpi), lambda _: image)
    assessed = assess(image, dpi, enhance=enhance or DEFAULT_ENHANCEMENT)
    template = assessed.template
    quality = assessed.quality.score if graded else None
    why = "" if len(template.minutiae) else why_no_minutiae(assessed.quality)
    common = image.likely_dpi is not None
    source, on_dpi = dpi_source(template, given=dpi is not None, among_others=common)
    notes = image.notes if source == "assumed" else (*image.notes, *on_dpi)
    return ExtractedPrint(template, source == "assumed", notes, quality, why)


def extractor_of(
    enhance: str,
    reader: Callable[[Path], GreyImage | TemplateRecord] = _READER,
    *,
    graded: bool = False,
) -> Extractor:
    """Return the extractor with the ridge enhancement of a name; see `extract_image`."""
    return partial(extract_image, enhance=enhance, reader=reader, graded=graded)


def dataset_reader(
    datasets: Sequence[Dataset],
    reader: Callable[..., GreyImage | TemplateRecord] = _READER,
    engine: Engine | None = None,
    *,
    polarity: Polarity = "auto",
) -> FolderReader[GreyImage | TemplateRecord]:
    """Return a reader of the prints of some databases; see `find_traits`.

    An `engine` looks at the images (default: this process).
    """
    files = [dataset for dataset in datasets if not dataset.in_gallery]
    paths = [impression.path for dataset in files for impression in dataset.impressions]
    each = map if engine is None else partial(results_of_each, engine)
    places = {i.path.parent: Path(one.place) for one in files if one.place for i in one.impressions}
    how: dict[str, Any] = {"polarity": polarity, "reader": reader, "each": each, "places": places}
    traits = find_traits(paths, **how)
    return FolderReader(reader, traits)


def extract_datasets(
    datasets: Sequence[Dataset],
    *,
    extractor: Extractor | None = None,
    workers: int | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    stage: str = "extract",
) -> list[ExtractedSet]:
    """Extract a template from every impression of some databases; failures are kept as such.

    The templates of a gallery are taken as they are, whatever the extractor. `datasets`: the
    databases; see `fpmatch.lab.evaluation.databases.dataset.load_dataset`. `extractor`: a function
    at the top of a module that makes a template from a path and a resolution (None: the file's
    own), alone or in an `ExtractedPrint` with notes. By default it is `extract_image` with
    the reader of `dataset_reader`. `workers`, `engine`, `progress`, `stage`: as for
    `fpmatch.gallery.engine.workers.attempt_all`, in images. The result is each database with its
    templates, CPU times and reasons of failures.
    """
    work = extractor or partial(extract_image, reader=dataset_reader(datasets))
    files = [dataset for dataset in datasets if not dataset.in_gallery]
    attempts = iter(
        attempt_each_image(
            files, work, stage=stage, workers=workers, engine=engine, progress=progress
        )
    )
    return [
        ExtractedSet(
            dataset,
            _stored(dataset)
            if dataset.in_gallery
            else tuple(map(_extraction, dataset.impressions, next(attempts))),
        )
        for dataset in datasets
    ]


def attempt_each_image(
    datasets: Sequence[Dataset],
    work: Callable[[Path, float | None], Result],
    *,
    stage: str,
    workers: int | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
) -> list[list[Attempt[Result]]]:
    """Return the attempts at all images of each database; see `attempt_all`.

    `work` is called with a path and a resolution (None: the file's own).
    """
    images = [(i.path, i.dpi or dataset.dpi) for dataset in datasets for i in dataset.impressions]
    on_image = partial(_on_image, work)
    attempts = iter(
        attempt_all(
            on_image, images, stage=stage, workers=workers, engine=engine, progress=progress
        )
    )
    return [list(islice(attempts, len(dataset.impressions))) for dataset in datasets]


def _on_image(
    work: Callable[[Path, float | None], Result], image: tuple[Path, float | None]
) -> Result:
    return work(*image)


def _extraction(impression: Impression, attempt: Attempt[Template | ExtractedPrint]) -> Extraction:
    made, cpu_ms = attempt.result, attempt.cpu_ms
    if made is None:
        return Extraction(None, attempt.reason, cpu_ms)
    extracted = made if isinstance(made, ExtractedPrint) else ExtractedPrint(made)
    beside = cpu_ms, extracted.dpi_assumed, extracted.notes, extracted.quality
    if len(extracted.template.minutiae):
        return Extraction(extracted.template, "", *beside)
    why = extracted.why_empty or why_no_minutiae(None)
    return Extraction(None, f"{impression.path}: {why}", *beside)


def _stored(dataset: Dataset) -> tuple[Extraction, ...]:
    """Return the templates of a database that is a gallery, in the order of its impressions."""
    from fpmatch.gallery.gallery import open_gallery  # noqa: PLC0415
    from fpmatch.gallery.store.audit import ranges  # noqa: PLC0415  (imports a database)

    numbers = [i.entry for i in dataset.impressions if i.entry is not None]
    with open_gallery(dataset.place) as gallery:
        gallery.record("read templates", entries=ranges(numbers))
        stored = {number: Extraction(made, "", math.nan) for number, made in gallery.templates()}
        for number, why in gallery.damaged.items():
            stored[number] = Extraction(None, f"entry {number} is damaged: {why}", math.nan)
        name = gallery.name
    if missing := [i.name for i in dataset.impressions if i.entry not in stored]:
        raise DatasetError(f"{missing[0]} has been removed meanwhile", path=name, code="changed")
    return tuple(stored[i.entry] for i in dataset.impressions if i.entry is not None)
