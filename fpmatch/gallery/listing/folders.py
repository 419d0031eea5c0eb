"""The prints of folders, and of folders of folders, one a subject or finger."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.base.parsing import read_head
from fpmatch.errors import DatasetError, ImageReadError
from fpmatch.gallery.listing.entry import Label, NamePattern
from fpmatch.gallery.listing.print_file import PrintFile
from fpmatch.printable import printable

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Iterator

IMAGE_EXTENSIONS: Final = frozenset(
    (
        *(".an2", ".bmp", ".eft", ".gif", ".j2k", ".jp2", ".jpeg", ".jpg", ".pbm", ".pgm", ".png"),
        *(".pnm", ".ppm", ".tif", ".tiff", ".webp", ".wsq"),
    )
)
_DIGITS: Final = re.compile(r"(\d+)", re.ASCII)
_COMMON_SUFFIXES: Final = (".json", ".csv", ".txt", ".npy")


def images_in(folder: str | os.PathLike[str]) -> list[Path]:
    """Return the files of a folder with an image's extension, numbers in names in order.

    ``9_2.png`` comes before ``10_1.tif``; subfolders and hidden files are skipped. Raises
    DatasetError if the folder cannot be listed.
    """
    root = Path(folder)
    if not root.exists():
        raise DatasetError(f"{root}: no such folder")
    if not root.is_dir():
        raise DatasetError(f"{root}: not a folder of prints")
    try:
        names = [path for path in root.iterdir() if not path.name.startswith(".")]
    except OSError as error:
        raise DatasetError(f"{root}: cannot be listed: {error.strerror}") from error
    images = (path for path in names if path.suffix.lower() in IMAGE_EXTENSIONS and path.is_file())
    return sorted(images, key=lambda path: natural_key(path.name))


def natural_key(text: str) -> tuple[list[str | tuple[int, str]], str]:
    """Return a sort key that compares the numbers in a text as numbers."""
    parts: list[str | tuple[int, str]] = list(_DIGITS.split(text))
    digits = [part.lstrip("0") for part in _DIGITS.findall(text)]  # of any number
    parts[1::2] = [(len(part), part) for part in digits]
    return parts, text


def prints_in(folder: Path) -> list[Path]:
    """Return the images of a folder or, where it has none, its templates; see `find_prints`."""
    return images_in(folder) or _templates_in(folder)


def files_of(place: Path) -> list[PrintFile]:
    """Return a file, or the prints of a folder; where it has none, the prints of its subfolders."""
    if not place.is_dir():
        return [PrintFile(place)]
    if paths := prints_in(place):
        return list(map(PrintFile, paths))
    return [replace(file, place=place) for file in prints_below(place)] or [PrintFile(place)]


def prints_below(root: Path) -> list[PrintFile]:
    """Return the prints of a folder and of all its subfolders, with their paths as names."""
    return [
        PrintFile(file, name=file.relative_to(root).as_posix())
        for folder in (root, *_folders_below(root))
        for file in prints_in(folder)
    ]


def prints_by_folder(root: Path, *, certain: bool = False) -> list[PrintFile]:
    """Return the prints of the subfolders of a folder, with labels from these.

    A subfolder is a finger, or a subject whose subfolders are fingers; the name of a file, without
    suffix, is the impression. Unless that is `certain`, a folder with prints of different subjects
    by FVC's names is refused: it is a database. Raises DatasetError if the prints lie otherwise,
    ImageReadError (code "empty folder") if there are none.
    """
    prints = prints_below(root)
    if not prints:
        raise ImageReadError(
            "the folder contains no images and no templates", path=root, code="empty folder"
        )
    if not certain:
        _check_no_databases(prints)
    above = {folder for file in prints for folder in file.path.parent.parents}
    labelled = []
    for file in prints:
        parts = file.path.parent.relative_to(root).parts
        if not 1 <= len(parts) <= 2 or file.path.parent in above:
            why = "the prints must all be in folders, one a finger, or one a subject and finger"
            raise DatasetError(why, path=file.path, code="not by folder")
        label = Label(*map(printable, (parts[0], "".join(parts[1:]), file.path.stem)))
        labelled.append(PrintFile(file.path, file.dpi, label, file.name))
    return labelled


def _check_no_databases(prints: Iterable[PrintFile]) -> None:
    """Raise a DatasetError where a folder has prints of several fingers by FVC's names."""
    subjects: dict[Path, str] = {}
    for file in prints:
        folder, named = file.path.parent, NamePattern().label(file.path)
        if named is not None and subjects.setdefault(folder, named.subject) != named.subject:
            why = (
                "prints of several fingers by their names FFF_M; give the folder by itself if it "
                "is a database, --by-folder if it is one finger, or --pattern if one subject"
            )
            raise DatasetError(why, path=folder, code="database")


def _folders_below(root: Path, above: frozenset[Path] = frozenset()) -> Iterator[Path]:
    """Yield the subfolders of a folder that are not hidden, each after the one it is in."""
    entered = above | {root.resolve()}  # a link may lead back
    try:
        folders = [path for path in root.iterdir() if path.is_dir() and path.name[0] != "."]
    except OSError as error:
        raise DatasetError(f"cannot be listed: {error.strerror}", path=root) from error
    for folder in sorted(folders, key=lambda path: natural_key(path.name)):
        if folder.resolve() not in entered:
            yield folder
            yield from _folders_below(folder, entered)


def _templates_in(folder: Path) -> list[Path]:
    """Return the files of a folder that are named like templates, one of each name, by name.

    JSON, CSV, text and array files are taken if they begin like templates; beside such, also JSON
    and CSV files that are none at all, so that a damaged template is an error.
    """
    from fpmatch.formats.registry import known_codecs  # noqa: PLC0415
    from fpmatch.prints.reading import content_of  # noqa: PLC0415

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
        if suffix not in _COMMON_SUFFIXES or content_of(path) in {"template", "both"}
    }
    usual = {suffix_of[path] for path in sure}
    by_stem: dict[str, Path] = {}
    for path, suffix in sorted(suffix_of.items(), key=lambda item: suffixes.index(item[1])):
        if path in sure or (suffix in usual and _is_other_content(path)):
            by_stem.setdefault(path.stem, path)
    return sorted(by_stem.values())


def _is_other_content(path: Path) -> bool:
    """Return whether a file named JSON or CSV is neither, or cannot be read; text may be any."""
    if path.suffix.lower() not in {".json", ".csv"}:
        return False
    text = read_head(path).decode("utf-8", errors="replace").removeprefix("\ufeff").lstrip()
    if not text or "\0" in text or "\ufffd" in text[:-4]:  # the last character may be cut through
        return True
    first_line = text.splitlines()[0]
    return text[0] not in "{[" if path.suffix.lower() == ".json" else "," not in first_line
