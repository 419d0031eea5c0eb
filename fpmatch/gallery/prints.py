"""Prints on disk, images or templates: which are meant, each with its resolution."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from fpmatch.errors import DatasetError, ImageError, ImageReadError, QualityError, TemplateError
from fpmatch.formats.record import TemplateRecord
from fpmatch.gallery.read_print import read_print
from fpmatch.image.io.dataset_folder import images_in, read_dataset_info
from fpmatch.minutiae import check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable

    from fpmatch.formats.codec import Codec
    from fpmatch.image.io.read import GreyImage
    from fpmatch.image.quality.folder_polarity import PolarityReader
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.minutiae import Template

    Reader = Callable[[Path], GreyImage | TemplateRecord]


Named = TypeVar("Named")

_COMMON_SUFFIXES: Final = (".json", ".csv")
_HEAD_BYTES: Final = 4096


@dataclass(frozen=True, slots=True)
class PrintFile:
    """Hold where an image or a template lies, and its resolution.

    Parameters
    ----------
    path : Path
        The file.
    dpi : float or None
        In dots per inch; None leaves it to what the file says.
    """

    path: Path
    dpi: float | None = None


@dataclass(frozen=True, slots=True)
class ExtractedPrint:
    """Hold the template of a print.

    Parameters
    ----------
    template : Template
        Its template.
    dpi_assumed : bool
        Whether its resolution had to be assumed.
    notes : tuple of str
        What was noticed on reading it: that white ridges were turned into dark ones, say.
    """

    template: Template
    dpi_assumed: bool = False
    notes: tuple[str, ...] = ()


def find_prints(
    places: Iterable[str | os.PathLike[str]], dpi: float | None = None
) -> list[PrintFile]:
    """Find the prints of some files and folders.

    Parameters
    ----------
    places : iterable of path-like
        Files, and folders whose images are meant, or, where a folder has none, its templates. Of
        templates that differ in their suffixes only, one is meant: JSON before CSV before others.
    dpi : float, optional
        Resolution of them all; by default what the ``dataset.toml`` beside a file says, else the
        file's own.

    Returns
    -------
    list of PrintFile
        In the order given, those of a folder by name; each file once.

    Raises
    ------
    ImageReadError
        If one of `places` is not there, or is a folder without images and templates.
    DatasetError
        If a folder cannot be listed, or its ``dataset.toml`` is malformed.
    ResolutionError
        If `dpi` is outside 100 to 4000.
    """
    if dpi is not None:
        check_dpi(dpi)
    folder_dpi = cache(lambda folder: read_dataset_info(folder).dpi)
    found: dict[Path, PrintFile] = {}
    for place in map(Path, places):
        for path in _files(place):
            own = folder_dpi(path.parent) if dpi is None else dpi
            found.setdefault(path.absolute(), PrintFile(path, own))
    return list(found.values())


def folder_reader(
    prints: Iterable[PrintFile],
    *,
    polarity: Polarity = "auto",
    dpi: float | None = None,
    reader: Callable[..., GreyImage | TemplateRecord] = read_print,
) -> PolarityReader[GreyImage | TemplateRecord]:
    """Return what reads some prints, the images of a folder with one polarity.

    Parameters
    ----------
    prints : iterable of PrintFile
        From `find_prints`.
    polarity, dpi, reader
        As for `fpmatch.image.quality.folder_polarity.find_polarities`.

    Returns
    -------
    PolarityReader
        A reader for `extract_print`.
    """
    from fpmatch.image.quality.folder_polarity import PolarityReader, find_polarities  # noqa: PLC0415

    paths = [file.path for file in prints]
    folders = find_polarities(paths, polarity=polarity, dpi=dpi, reader=reader)
    return PolarityReader(reader, folders, dpi)


def extract_print(
    file: PrintFile, reader: Reader = read_print, min_quality: int = 0
) -> ExtractedPrint:
    """Return the template of a print: extracted from an image, or the one in a template file.

    Parameters
    ----------
    file : PrintFile
        The print.
    reader : callable
        Reads it (default: `read_print`).
    min_quality : int
        Quality, 0 to 100, that an image must have; templates are taken as they are.

    Returns
    -------
    ExtractedPrint
        Its template, with one minutia at least.

    Raises
    ------
    TemplateError, ImageReadError, ImageError
        If it cannot be read, cannot hold a fingerprint, has no minutiae, or holds several prints.
    QualityError
        If the image is worse than `min_quality`.
    """
    found = reader(file.path)
    if isinstance(found, TemplateRecord):
        if len(found.views) > 1:
            raise TemplateError(
                f"{file.path}: holds {len(found.views)} prints, and one is expected "
                "(fpmatch convert --view takes one out)"
            )
        view = found.views[0].at(file.dpi)
        template, assumed = view.template, not view.dpi_known
    else:
        template = _extract(found, file, min_quality)
        assumed = file.dpi is None and found.dpi is None
    if not len(template.minutiae):
        raise ImageError(f"{file.path}: no minutiae found")
    return ExtractedPrint(template, dpi_assumed=assumed, notes=found.notes)


def by_note(prints: Iterable[tuple[Named, Iterable[str]]]) -> dict[str, tuple[Named, ...]]:
    """Gather the notes on prints: each once, with the prints that it was made on.

    Parameters
    ----------
    prints : iterable of (name, iterable of str)
        What a print is called, and what was noticed on reading it.

    Returns
    -------
    dict of str to tuple
        By note, in the order in which they first appear.

    Examples
    --------
    >>> by_note([("a.tif", ["odd", "torn"]), ("b.tif", []), ("c.tif", ["odd"])])
    {'odd': ('a.tif', 'c.tif'), 'torn': ('a.tif',)}
    """
    found: dict[str, list[Named]] = {}
    for name, notes in prints:
        for note in notes:
            found.setdefault(note, []).append(name)
    return {note: tuple(names) for note, names in found.items()}


def _extract(image: GreyImage, file: PrintFile, min_quality: int) -> Template:
    """Return the template of an image that is good enough."""
    from fpmatch.image.assess import QualityRecorder  # noqa: PLC0415
    from fpmatch.image.extract import extract  # noqa: PLC0415

    if not min_quality:
        return extract(image, file.dpi)
    stages = QualityRecorder()
    template = extract(image, file.dpi, recorder=stages)
    quality = stages.quality(template.dpi)
    if quality.score < min_quality:
        raise QualityError(f"{file.path}: {quality} ({min_quality} is asked for)")
    return template


def _files(place: Path) -> list[Path]:
    if place.is_dir():
        files = images_in(place) or _templates_in(place)
        if not files:
            raise ImageReadError(f"{place}: the folder holds no images")
        return files
    if not place.exists():
        raise ImageReadError(f"{place}: no such file or folder")
    return [place]


def _templates_in(folder: Path) -> list[Path]:
    """Return the files of a folder that are named like templates, one of each name, by name.

    JSON and CSV are suffixes of much else: of these the files that begin like templates, and,
    beside such, those that are no JSON or CSV at all: damaged ones are to be told, not passed over.
    """
    from fpmatch.formats.files import is_template_file  # noqa: PLC0415  (asks all the formats)
    from fpmatch.formats.registry import CODECS  # noqa: PLC0415

    suffixes = [suffix for codec in sorted(CODECS, key=_rank) for suffix in codec.suffixes]
    try:
        files = [path for path in folder.iterdir() if path.suffix.lower() in suffixes]
    except OSError as error:
        raise DatasetError(f"{folder}: cannot be listed: {error.strerror}") from error
    files = [path for path in files if path.is_file() and not path.name.startswith(".")]
    sure = {path for path in files if not _is_common(path) or is_template_file(path)}
    usual = {path.suffix.lower() for path in sure}
    found: dict[str, Path] = {}
    for path in sorted(files, key=lambda path: suffixes.index(path.suffix.lower())):
        if path in sure or (path.suffix.lower() in usual and _is_no_text(path)):
            found.setdefault(path.stem, path)
    return sorted(found.values())


def _is_common(path: Path) -> bool:
    return path.suffix.lower() in _COMMON_SUFFIXES


def _is_no_text(path: Path) -> bool:
    """Tell whether a file named JSON or CSV begins like neither, or cannot be read."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError:
        return True
    text = head.decode("utf-8", errors="replace").removeprefix("\ufeff").lstrip()
    if not text or "\0" in text or "\ufffd" in text[:-4]:  # the last character may be cut through
        return True
    first_line = text.splitlines()[0]
    return text[0] not in "{[" if path.suffix.lower() == ".json" else "," not in first_line


def _rank(codec: Codec) -> bool:
    """Return a key that puts the one format first that keeps everything."""
    return codec.name != "json"
