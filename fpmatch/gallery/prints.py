"""Find the prints, images or templates, in files and folders, and extract their templates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.engine.workers import results_of_each
from fpmatch.errors import DatasetError, ImageError, ImageReadError, QualityError, TemplateError
from fpmatch.formats.codec import read_head
from fpmatch.formats.record import TemplateRecord
from fpmatch.image.io.dataset_folder import images_in, read_dataset_info
from fpmatch.minutiae import check_dpi
from fpmatch.reading import ASSUMED_DPI, PrintReader, make_given_print

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable

    from fpmatch.engine.engine import Engine
    from fpmatch.image.io.read import GreyImage
    from fpmatch.image.quality.folder_polarity import PolarityReader
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.minutiae import Template

    Reader = Callable[[Path], GreyImage | TemplateRecord]

_COMMON_SUFFIXES: Final = (".json", ".csv")


@dataclass(frozen=True, slots=True)
class PrintFile:
    """Hold the file of an image or a template, and its resolution (None: that in the file)."""

    path: Path
    dpi: float | None = None


@dataclass(frozen=True, slots=True)
class ExtractedPrint:
    """Hold the template of a print, whether its resolution was assumed, and notes on reading it.

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
    places: Iterable[str | os.PathLike[str]], dpi: float | None = None
) -> list[PrintFile]:
    """Find the prints of some files and folders, each once, those of a folder by name.

    Those of a folder are its images or, where it has none, its templates; of templates whose names
    differ in the suffix only, one is taken: JSON before CSV before others. `dpi` is the resolution
    of all (default: that in the ``dataset.toml`` beside a file, else the file's own).

    Raises
    ------
    ImageReadError
        If one of `places` is missing, or is a folder without images and templates.
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
    reader: Callable[..., GreyImage | TemplateRecord] | None = None,
    engine: Engine | None = None,
) -> PolarityReader[GreyImage | TemplateRecord]:
    """Return a reader of prints that reads the images of a folder with one polarity.

    `polarity`, `dpi` and `reader` are as for
    `fpmatch.image.quality.folder_polarity.find_polarities` (default reader: `PrintReader`); an
    `engine` looks at the images (default: this process).
    """
    from fpmatch.image.quality.folder_polarity import PolarityReader, find_polarities  # noqa: PLC0415

    read = reader or PrintReader()
    found = find_polarities(
        [file.path for file in prints],
        polarity=polarity,
        dpi=dpi,
        reader=read,
        each=map if engine is None else partial(results_of_each, engine),
    )
    return PolarityReader(read, found, dpi)


def extract_print(
    file: PrintFile,
    reader: Reader | None = None,
    min_quality: int = 0,
    *,
    graded: bool = False,
) -> ExtractedPrint:
    """Return the template of a print: extracted from an image, or read from a template file.

    `reader` reads the file (default: `PrintReader`), and an image is `graded` with its quality.
    Raises TemplateError, ImageReadError or
    ImageError if it cannot be read, cannot contain a fingerprint, has no minutiae, or contains
    several prints; QualityError if the quality of an image, 0 to 100, is below `min_quality`.
    """
    found = (reader or PrintReader())(file.path)
    if isinstance(found, TemplateRecord) and len(found.views) > 1:
        raise TemplateError(
            f"contains {len(found.views)} prints, and one is expected (fpmatch convert --view "
            "takes one out)",
            path=file.path,
            code="several prints",
        )
    given = make_given_print(found, str(file.path), dpi=file.dpi)
    if min_quality and given.quality is not None and given.quality.score < min_quality:
        why = f"{given.quality} ({min_quality} is required)"
        raise QualityError(why, path=file.path)
    if not len(given.template.minutiae):
        raise ImageError("no minutiae found", path=file.path, code="no minutiae")
    quality = given.quality.score if graded and given.quality is not None else None
    return ExtractedPrint(given.template, ASSUMED_DPI in given.notes, found.notes, quality)


def _files(place: Path) -> list[Path]:
    if place.is_dir():
        files = images_in(place) or _templates_in(place)
        if not files:
            raise ImageReadError("the folder holds no images", path=place, code="empty folder")
        return files
    if not place.exists():
        raise ImageReadError("no such file or folder", path=place, code="missing")
    return [place]


def _templates_in(folder: Path) -> list[Path]:
    """Return the files of a folder that are named like templates, one of each name, by name.

    JSON and CSV files are taken if they begin like templates or, beside such, are no JSON or CSV at
    all, so that a damaged template is an error.
    """
    from fpmatch.formats.files import is_template_file  # noqa: PLC0415
    from fpmatch.formats.registry import known_codecs  # noqa: PLC0415

    # json first, which keeps everything
    by_rank = sorted(known_codecs(), key=lambda codec: codec.name != "json")
    suffixes = [suffix for codec in by_rank for suffix in codec.suffixes]
    try:
        files = [path for path in folder.iterdir() if path.suffix.lower() in suffixes]
    except OSError as error:
        raise DatasetError(f"cannot be listed: {error.strerror}", path=folder) from error
    suffix_of = {p: p.suffix.lower() for p in files if p.is_file() and not p.name.startswith(".")}
    sure = {
        path
        for path, suffix in suffix_of.items()
        if suffix not in _COMMON_SUFFIXES or is_template_file(path)
    }
    usual = {suffix_of[path] for path in sure}
    found: dict[str, Path] = {}
    for path, suffix in sorted(suffix_of.items(), key=lambda item: suffixes.index(item[1])):
        if path in sure or (suffix in usual and _is_other_content(path)):
            found.setdefault(path.stem, path)
    return sorted(found.values())


def _is_other_content(path: Path) -> bool:
    """Return whether a file named JSON or CSV is neither, or cannot be read."""
    text = read_head(path).decode("utf-8", errors="replace").removeprefix("\ufeff").lstrip()
    if not text or "\0" in text or "\ufffd" in text[:-4]:  # the last character may be cut through
        return True
    first_line = text.splitlines()[0]
    return text[0] not in "{[" if path.suffix.lower() == ".json" else "," not in first_line
