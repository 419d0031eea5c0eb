"""The prints of a database as a side of `fpmatch score`, and their templates."""

from __future__ import annotations

import hashlib
from contextlib import closing, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from fpmatch.errors import DatasetError, MatcherError, without_path
from fpmatch.formats.record import TemplateRecord
from fpmatch.gallery.batch.sources import GallerySource, StoredTemplate, pack, unpack
from fpmatch.gallery.engine.engine import processes, serial
from fpmatch.gallery.engine.workers import Progress, attempt_each, no_progress
from fpmatch.gallery.listing.print_file import PrintFile, resolution_notes
from fpmatch.gallery.listing.prints import ExtractedPrint, extract_print, folder_reader
from fpmatch.gallery.store.stored_template import minutiae_digest
from fpmatch.image.quality.print_quality import why_no_minutiae
from fpmatch.matching.result import Comparison, Matcher, call_matcher, compare_prepared
from fpmatch.prints.reading import PrintReader, dpi_source

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.image.folder_traits import FolderReader
    from fpmatch.image.io.read import GreyImage
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.templates.minutiae import Template

    Extractor = Callable[[Path, float | None], Template | ExtractedPrint]
    ImageReader = Callable[[Path], GreyImage | TemplateRecord]

_READER: Final = PrintReader()


@dataclass(frozen=True, slots=True)
class Extraction:
    """The template of one image, None where extraction failed or found no minutiae.

    `reason` is then the reason, else "". `quality` is that of the image, 0 to 100; None where it
    was not measured.
    """

    template: Template | None
    reason: str
    dpi_assumed: bool = False
    notes: tuple[str, ...] = ()
    quality: int | None = None


@dataclass(frozen=True, slots=True)
class ExtractedSet:
    """A database with the extractions of its impressions, in their order."""

    dataset: Dataset
    extractions: tuple[Extraction, ...]


@dataclass(frozen=True, slots=True)
class Reading:
    """How the images of a database are read and their templates extracted.

    `reader` reads a file, `polarity` is that of all images, `enhance` names the ridge enhancement,
    and images are `graded` with their quality, which takes a tenth of the time. An `extractor`
    takes the place of all of them.
    """

    reader: Callable[..., GreyImage | TemplateRecord] = _READER
    polarity: Polarity = "auto"
    enhance: str | None = None
    graded: bool = False
    extractor: Extractor | None = None


class DatasetSource:
    """The prints of a database, as `fpmatch.gallery.batch.sources.PrintSource` describes.

    Templates are extracted when they are first needed, and kept in memory; those of a gallery are
    taken as they are.
    """

    def __init__(self, dataset: Dataset, reading: Reading = Reading()) -> None:
        self.dataset, self._how = dataset, reading
        first = dataset.impressions[0].path
        self.place, self.title = dataset.place or str(first.parent), dataset.name
        self.names = [one.name for one in dataset.impressions]
        self.fingers = [str(one.finger) for one in dataset.impressions]
        self._files = [
            PrintFile(
                one.path,
                one.dpi or dataset.dpi,
                name=one.name,
                place=Path(dataset.place) if dataset.place else None,
            )
            for one in dataset.impressions
        ]
        self._on_dpi = resolution_notes([file.dpi for file in self._files])
        self._gallery = GallerySource(dataset.place) if dataset.in_gallery else None
        self._made: dict[int, StoredTemplate] = {}
        self._open: FolderReader[GreyImage | TemplateRecord] | None = None
        state = repr([_state(file) for file in self._files])
        if self._gallery is not None:
            state = f"{self._gallery.content_hash} {self.names}"
        how = reading.polarity, reading.enhance, reading.graded, repr(reading.extractor)
        self.content_hash = hashlib.sha256(f"{state} {how}".encode()).hexdigest()

    @classmethod
    def of(cls, extracted: ExtractedSet) -> DatasetSource:
        """Return a database whose templates are there."""
        source = cls(extracted.dataset)
        source._made = {
            k: _stored(
                one.reason
                if one.template is None
                else ExtractedPrint(one.template, quality=one.quality)
            )
            for k, one in enumerate(extracted.extractions)
        }
        return source

    def templates(
        self, engine: Engine, numbers: Sequence[int]
    ) -> Generator[StoredTemplate, None, None]:
        """Yield some prints by their ascending numbers; `engine` extracts them if necessary."""
        if self._gallery is not None and not self._made:
            place = {name: k for k, name in enumerate(self._gallery.names)}
            if gone := [name for name in self.names if name not in place]:
                raise DatasetError(f"{gone[0]} has been removed meanwhile", path=self.place)
            at = {place[name]: k for k, name in enumerate(self.names)}
            made = self._gallery.templates(engine, sorted(at))
            self._made = {at[n]: one for n, one in zip(sorted(at), made, strict=True)}
        missing = [n for n in numbers if n not in self._made]
        if not missing:
            yield from (self._made[n] for n in numbers)
            return
        work = partial(_on_file, self._how.extractor or self._extractor(engine))
        files = [(self._files[n].path, self._files[n].dpi) for n in missing]
        with closing(attempt_each(engine, work, files)) as attempts:
            extracted = iter(attempts)
            for n in numbers:
                if n not in self._made:
                    _, attempt = next(extracted)
                    reason = without_path(attempt.reason, self._files[n].path)
                    one = _stored(attempt.result or reason)
                    self._made[n] = replace(one, notes=(*one.notes, *self._on_dpi[n]))
                yield self._made[n]

    def read(self, name: str) -> tuple[Template, GreyImage | NDArray[np.uint8]]:
        """Return the template of a print, and its image; of a template its ridges are drawn."""
        from fpmatch.drawing.scene.ink import ridge_picture  # noqa: PLC0415  (for pages only)

        number = self.names.index(name)
        (stored,) = self.templates(serial(), [number])
        if stored.data is None:
            raise DatasetError(stored.reason, path=name)
        template = unpack(stored.data)
        content = None if self._gallery is not None else self._reader()(self._files[number].path)
        if content is None or isinstance(content, TemplateRecord):
            return template, ridge_picture(template)
        return template, content

    def with_images(self, matcher: Matcher, engine: Engine) -> Matcher:
        """Return a matcher of templates that gives the images of these prints to `matcher`."""
        if self._gallery is not None:
            raise MatcherError(
                f"matcher {matcher.name} compares images: a gallery has templates alone"
            )
        made = self.templates(engine, range(len(self.names)))
        paths = {
            one.digest: file.path
            for one, file in zip(made, self._files, strict=True)
            if one.data is not None
        }
        return _OnImages(matcher, paths, self._reader(engine))

    def _reader(self, engine: Engine | None = None) -> FolderReader[GreyImage | TemplateRecord]:
        """Return the reader of the images, which reads those of a folder with one polarity."""
        if self._open is None:
            how: dict[str, Any] = {"polarity": self._how.polarity, "reader": self._how.reader}
            self._open = folder_reader(self._files, engine=engine, **how)
        return self._open

    def _extractor(self, engine: Engine) -> Extractor:
        how = {"enhance": self._how.enhance, "graded": self._how.graded}
        return partial(extract_image, reader=self._reader(engine), **cast("Any", how))


class _OnImages(Matcher):
    """A matcher of templates that reads their images for a matcher that wants these."""

    def __init__(self, matcher: Matcher, paths: Mapping[bytes, Path], reader: ImageReader) -> None:
        super().__init__()
        self.name, self.rho = matcher.name, matcher.rho
        self._matcher, self._paths, self._reader = matcher, paths, reader

    def prepare(self, template: Template) -> Any:
        path = self._paths[minutiae_digest(template)]
        image = self._reader(path)
        if isinstance(image, TemplateRecord):
            raise DatasetError("is a template, and the matcher compares images", path=path)
        return call_matcher(self._matcher, "prepare", template, image.pixels)

    def compare(self, probe: Any, reference: Any) -> Comparison:
        return compare_prepared(self._matcher, probe, reference)


def extract_image(
    path: Path,
    dpi: float | None,
    enhance: str | None = None,
    reader: ImageReader = _READER,
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


def extract_datasets(
    datasets: Sequence[Dataset],
    *,
    reading: Reading = Reading(),
    workers: int | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
) -> list[ExtractedSet]:
    """Extract a template from every impression of some databases; failures are kept as such.

    `datasets`: the databases; see `fpmatch.lab.evaluation.databases.dataset.load_dataset`.
    `workers`: processes to use (default: one a core), or an `engine` to work on instead, which is
    not released here. `progress` is called with the stage "extract" and numbers of images.
    """
    total, done = sum(len(one.impressions) for one in datasets), 0
    progress("extract", done, total)
    extracted = []
    with processes(workers) if engine is None else nullcontext(engine) as place:
        for dataset in datasets:
            extractions = []
            numbers = range(len(dataset.impressions))
            for one in DatasetSource(dataset, reading).templates(place, numbers):
                template = None if one.data is None else unpack(one.data)
                beside = one.reason, one.dpi_assumed, one.notes, one.quality
                extractions.append(Extraction(template, *beside))
                progress("extract", done := done + 1, total)
            extracted.append(ExtractedSet(dataset, tuple(extractions)))
    return extracted


def _on_file(extractor: Extractor, file: tuple[Path, float | None]) -> ExtractedPrint:
    made = extractor(*file)
    return made if isinstance(made, ExtractedPrint) else ExtractedPrint(made)


def _stored(made: ExtractedPrint | str) -> StoredTemplate:
    """Return a print as bytes; without minutiae, or with a reason in its place, it has none."""
    if isinstance(made, str):
        return StoredTemplate(None, made)
    template = made.template
    beside = made.dpi_assumed, made.notes, made.quality
    if not len(template.minutiae):
        return StoredTemplate(None, made.why_empty or why_no_minutiae(None), *beside)
    return StoredTemplate(pack(template), "", *beside, minutiae_digest(template))


def _state(file: PrintFile) -> tuple[str, int, int, float | None]:
    try:
        status = file.path.stat()
    except OSError:  # a missing file fails when it is read
        return file.name, -1, -1, file.dpi
    return file.name, status.st_size, status.st_mtime_ns, file.dpi
