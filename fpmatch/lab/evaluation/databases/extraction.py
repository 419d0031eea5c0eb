"""The prints of a database as a side of `fpmatch score`, and how their images are read."""

from __future__ import annotations

import hashlib
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.errors import DatasetError, without_path
from fpmatch.formats.record import TemplateRecord
from fpmatch.gallery.batch.sources import (
    FolderSource,
    StoredTemplate,
    stored,
    unpack,
)
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.engine.workers import attempt_each
from fpmatch.gallery.listing.entry import PrintFile
from fpmatch.gallery.listing.prints import ExtractedPrint, extract_print
from fpmatch.image.extract import DEFAULT_ENHANCEMENT
from fpmatch.image.quality.print_quality import why_no_minutiae

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.image.io.read import GreyImage
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.templates.minutiae import Template

    Extractor = Callable[[Path, float | None], Template | ExtractedPrint]


class DatasetSource(FolderSource):
    """The prints of a database, as `fpmatch.gallery.batch.sources.PrintSource` describes.

    Templates are extracted when they are first needed, and kept in memory; those that the database
    has are taken as they are. `reader` reads a file, `polarity` is that of all images, `enhance`
    names the ridge enhancement, and images are `graded` with their quality, which takes a tenth of
    the time. An `extractor` takes the place of all of them.
    """

    def __init__(
        self,
        dataset: Dataset,
        *,
        reader: Callable[..., GreyImage | TemplateRecord] | None = None,
        polarity: Polarity = "auto",
        enhance: str = DEFAULT_ENHANCEMENT,
        graded: bool = False,
        extractor: Extractor | None = None,
    ) -> None:
        place = Path(dataset.place)
        files = [
            PrintFile(one.path, one.dpi, name=one.name, place=place) for one in dataset.impressions
        ]
        super().__init__(place, files, None, polarity, reader)
        self.dataset, self._extractor = dataset, extractor
        self._how = {"enhance": enhance, "graded": graded, "doubted": False}
        self.place, self.title = dataset.place, dataset.name
        self.fingers = [one.finger for one in dataset.impressions]
        self._made = {
            k: StoredTemplate(None, "no template") if one is None else _stored(one)
            for k, one in enumerate(dataset.templates)
        }
        state = self.content_hash, self._how, extractor
        self.content_hash = hashlib.sha256(repr(state).encode()).hexdigest()

    def templates(
        self, engine: Engine, numbers: Sequence[int]
    ) -> Generator[StoredTemplate, None, None]:
        """Yield some prints by their ascending numbers; `engine` extracts them if necessary."""
        missing = [n for n in numbers if n not in self._made]
        how: dict[str, Any] = {}
        if missing and self._extractor is None:
            how = {**self._how, "reader": self._open_reader(engine=engine)}
        work = partial(_extracted, self._extractor, how)
        with closing(attempt_each(engine, work, [self._files[n] for n in missing])) as attempts:
            for n in numbers:
                if n not in self._made:
                    file, attempt = next(attempts)
                    reason = without_path(attempt.reason, file.path)
                    self._made[n] = attempt.result or StoredTemplate(None, reason)
                yield self._made[n]

    def read(self, name: str) -> tuple[Template, GreyImage | NDArray[np.uint8]]:
        """Return the template of a print, and its image; of a template its ridges are drawn."""
        from fpmatch.drawing.scene.ink import ridge_picture  # noqa: PLC0415  (for pages only)

        number = self.names.index(name)
        (one,) = self.templates(serial(), [number])
        if one.data is None:
            raise DatasetError(one.reason, path=name)
        template, content = unpack(one.data), self._open_reader()(self._files[number].path)
        drawn = ridge_picture(template) if isinstance(content, TemplateRecord) else content
        return template, drawn


def _extracted(extract: Extractor | None, how: dict[str, Any], file: PrintFile) -> StoredTemplate:
    return _stored(extract_print(file, **how) if extract is None else extract(file.path, file.dpi))


def _stored(made: Template | ExtractedPrint) -> StoredTemplate:
    """Return a print in bytes; one without minutiae has no template."""
    one = made if isinstance(made, ExtractedPrint) else ExtractedPrint(made)
    if not len(one.template.minutiae):
        return StoredTemplate(None, why_no_minutiae(None), one.dpi_assumed, one.notes, one.quality)
    return stored(one)
