"""Find the prints, images or templates, in files and folders, and extract their templates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.errors import ImageError, ImageReadError, QualityError, TemplateError
from fpmatch.formats.record import TemplateRecord
from fpmatch.gallery.engine.workers import results_of_each
from fpmatch.gallery.listing.entry import PrintFile
from fpmatch.gallery.listing.folders import labelled_by_folder, prints_below, prints_in
from fpmatch.gallery.listing.manifest import kind_of, read_manifest
from fpmatch.gallery.listing.two_prints import why_two_prints
from fpmatch.image.dataset_folder import read_dataset_info
from fpmatch.image.quality.print_quality import why_no_minutiae
from fpmatch.prints.reading import ASSUMED_DPI, PrintReader, make_given_print
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Mapping

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.listing.entry import NamePattern
    from fpmatch.image.folder_traits import FolderReader
    from fpmatch.image.io.read import GreyImage
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.prints.reading import GivenPrint
    from fpmatch.templates.minutiae import Template

    Reader = Callable[[Path], GreyImage | TemplateRecord]


@dataclass(frozen=True, slots=True)
class ExtractedPrint:
    """The template of a print, whether its resolution was assumed, and notes on it.

    `quality` is that of the image, 0 to 100; None where it was not measured.
    """

    template: Template
    dpi_assumed: bool = False
    notes: tuple[str, ...] = ()
    quality: int | None = None

    @property
    def all_notes(self) -> tuple[str, ...]:
        """The notes, with one on the resolution where it was assumed."""
        return (*self.notes, ASSUMED_DPI) if self.dpi_assumed else self.notes


if TYPE_CHECKING:
    Extractor = Callable[[PrintFile], ExtractedPrint]


def find_prints(
    places: Iterable[str | os.PathLike[str]],
    dpi: float | None = None,
    *,
    pattern: NamePattern | None = None,
) -> list[PrintFile]:
    """Find the prints of some files, folders and manifests, each once, those of a folder by name.

    The prints of a folder are its images or, where it has none, its templates; of templates whose
    names differ in the suffix only, one is taken: JSON before CSV before others. Where a folder has
    neither, its subfolders are fingers, or subjects whose subfolders are fingers. `dpi` is the
    resolution of all (default: that in a manifest, else that in the ``dataset.toml`` beside a file
    or in the place, else the file's own).

    Labels are those of a manifest, else by a `pattern`, with which subfolders may lie deeper, else
    of the subfolders. Raises ImageReadError if one of `places` is missing, or is a folder without
    images and templates; DatasetError if a folder cannot be listed, its ``dataset.toml`` or a
    manifest is malformed, or its subfolders are not of one finger each.
    """
    if dpi is not None:
        check_dpi(dpi)
    folder_dpi = cache(lambda folder: read_dataset_info(folder).dpi)
    by_path: dict[Path, PrintFile] = {}
    for place in map(Path, places):
        base = place if place.is_dir() else place.parent
        for file in _files(place, pattern):
            own = dpi or file.dpi or folder_dpi(file.path.parent) or folder_dpi(base)
            above = None if place in {file.path, file.path.parent} else place
            by_path.setdefault(file.path.absolute(), replace(file, dpi=own, place=above))
    return list(by_path.values())


def folder_reader(
    prints: Iterable[PrintFile],
    *,
    polarity: Polarity = "auto",
    dpi: float | None = None,
    reader: Callable[..., GreyImage | TemplateRecord] | None = None,
    engine: Engine | None = None,
    earlier: Mapping[Path, float] | None = None,
) -> FolderReader[GreyImage | TemplateRecord]:
    """Return a reader of prints that reads the images of a folder with one polarity and resolution.

    `polarity`, `dpi`, `reader` and `earlier` are as for
    `fpmatch.image.folder_traits.find_traits` (default reader: `PrintReader`); an
    `engine` looks at the images (default: this process).
    """
    from fpmatch.image.folder_traits import FolderReader, find_traits  # noqa: PLC0415

    read, files = reader or PrintReader(), list(prints)
    traits = find_traits(
        [file.path for file in files],
        polarity=polarity,
        dpi=dpi,
        reader=read,
        each=map if engine is None else partial(results_of_each, engine),
        places={file.path.parent: file.place for file in files if file.place is not None},
        earlier=earlier,
    )
    return FolderReader(read, traits, dpi)


def extract_print(
    file: PrintFile,
    reader: Reader | None = None,
    min_quality: int = 0,
    *,
    graded: bool = False,
    **how: Any,
) -> ExtractedPrint:
    """Return the template of a print, as `read_one_print` does, without the image.

    An image is `graded` with its quality, which takes a tenth of the time of the extraction.
    """
    given = read_one_print(file, reader, min_quality, **how)
    notes = tuple(note for note in given.notes if note != ASSUMED_DPI)
    quality = given.quality.score if graded and given.quality is not None else None
    return ExtractedPrint(given.template, given.dpi_assumed, notes, quality)


def read_one_print(
    file: PrintFile,
    reader: Reader | None = None,
    min_quality: int = 0,
    *,
    doubted: bool = True,
    **how: Any,
) -> GivenPrint:
    """Read the one print of a file, an image or a template, by a `reader` (default: `PrintReader`).

    If `doubted`, a print with signs of two fingers gets a note, which takes time. `how` an image is
    extracted is as for `fpmatch.prints.reading.make_given_print`.
    Raises TemplateError, ImageReadError or ImageError if it cannot be read, cannot contain a
    fingerprint, has no minutiae, or contains several prints; QualityError if the quality of an
    image, 0 to 100, is below `min_quality`.
    """
    content = (reader or PrintReader())(file.path)
    if isinstance(content, TemplateRecord) and len(content.views) > 1:
        raise TemplateError(
            f"contains {len(content.views)} prints, and one is expected (--record N takes one)",
            path=file.path,
            code="several prints",
        )
    given = make_given_print(content, str(file.path), dpi=file.dpi, **how)
    if min_quality and given.quality is not None and given.quality.score < min_quality:
        why = f"{given.quality} ({min_quality} is required)"
        raise QualityError(why, path=file.path)
    if not len(given.template.minutiae):
        why = why_no_minutiae(given.quality)
        raise ImageError(why, path=file.path, code="no minutiae")
    return with_note_on_two_prints(given) if doubted else given


def with_note_on_two_prints(given: GivenPrint) -> GivenPrint:
    """Return a print with a note where it probably has the prints of two fingers."""
    why = why_two_prints(given.template)
    return replace(given, notes=(*given.notes, why)) if why else given


def _files(place: Path, pattern: NamePattern | None) -> list[PrintFile]:
    kind = kind_of(place)
    if kind == "manifest":
        return read_manifest(place)
    if kind == "folder" and not place.exists():
        raise ImageReadError("no such file or folder", path=place, code="missing")
    files = [PrintFile(place)]
    if place.is_dir():
        files = list(map(PrintFile, prints_in(place)))
        if not files:
            files = prints_below(place)
            if files and pattern is None:
                return labelled_by_folder(place, files)
        if not files:
            why = "the folder contains no images and no templates"
            raise ImageReadError(why, path=place, code="empty folder")
    if pattern is None:
        return files
    return [replace(file, label=pattern.label(file.path)) for file in files]
