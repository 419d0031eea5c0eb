"""The prints of a database as a side of `fpmatch score`, and how their images are read."""

from __future__ import annotations

import hashlib
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import DatasetError, without_path
from fpmatch.formats.record import TemplateRecord
from fpmatch.gallery.batch.sources import GallerySource, StoredTemplate, pack, unpack
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.engine.workers import attempt_each
from fpmatch.gallery.listing.entry import PrintFile
from fpmatch.gallery.listing.prints import ExtractedPrint, extract_print, folder_reader
from fpmatch.gallery.store.stored_template import minutiae_digest
from fpmatch.image.quality.print_quality import why_no_minutiae
from fpmatch.lab.evaluation.rates.scores import NO_TEMPLATE
from fpmatch.prints.reading import PrintReader, dpi_source

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Sequence

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
    taken as they are, and so are those that the database has.
    """

    def __init__(self, dataset: Dataset, reading: Reading = Reading()) -> None:
        self.dataset, self._how = dataset, reading
        self.place, self.title = dataset.place, dataset.name
        self.names = [one.name for one in dataset.impressions]
        self.fingers = [str(one.finger) for one in dataset.impressions]
        self._files = [
            PrintFile(one.path, one.dpi or dataset.dpi, name=one.name, place=Path(dataset.place))
            for one in dataset.impressions
        ]
        self._gallery = GallerySource(dataset.place) if dataset.in_gallery else None
        self._made = {
            k: _stored(NO_TEMPLATE if one is None else ExtractedPrint(one))
            for k, one in enumerate(dataset.templates)
        }
        self._open: FolderReader[GreyImage | TemplateRecord] | None = None
        state = repr([_state(file) for file in self._files])
        if self._gallery is not None:
            state = f"{self._gallery.content_hash} {self.names}"
        how = reading.polarity, reading.enhance, reading.graded, repr(reading.extractor)
        self.content_hash = hashlib.sha256(f"{state} {how}".encode()).hexdigest()

    def templates(
        self, engine: Engine, numbers: Sequence[int]
    ) -> Generator[StoredTemplate, None, None]:
        """Yield some prints by their ascending numbers; `engine` extracts them if necessary."""
        with closing(self._read(engine, [n for n in numbers if n not in self._made])) as made:
            for n in numbers:
                if n not in self._made:
                    self._made[n] = next(made)
                yield self._made[n]

    def _read(
        self, engine: Engine, numbers: Sequence[int]
    ) -> Generator[StoredTemplate, None, None]:
        """Yield some prints of the gallery or, extracted by the engine, of files."""
        if self._gallery is not None:
            place = {name: k for k, name in enumerate(self._gallery.names)}
            if gone := [self.names[n] for n in numbers if self.names[n] not in place]:
                raise DatasetError(f"{gone[0]} has been removed meanwhile", path=self.place)
            yield from self._gallery.templates(engine, [place[self.names[n]] for n in numbers])
            return
        how: dict[str, Any] = {"enhance": self._how.enhance, "graded": self._how.graded}
        extractor = self._how.extractor
        if extractor is None:
            extractor = partial(extract_image, reader=self._reader(engine), **how)
        files = [(self._files[n].path, self._files[n].dpi) for n in numbers]
        with closing(attempt_each(engine, partial(_on_file, extractor), files)) as attempts:
            for n, (_, attempt) in zip(numbers, attempts, strict=True):
                reason = without_path(attempt.reason, self._files[n].path)
                yield _stored(attempt.result or reason)

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

    def _reader(self, engine: Engine | None = None) -> FolderReader[GreyImage | TemplateRecord]:
        """Return the reader of the images, which reads those of a folder with one polarity."""
        if self._open is None:
            how: dict[str, Any] = {"polarity": self._how.polarity, "reader": self._how.reader}
            self._open = folder_reader(self._files, engine=engine, **how)
        return self._open


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
