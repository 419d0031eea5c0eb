"""The prints of folders, and of folders of folders, one a subject or finger."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from fpmatch.base.output import reason
from fpmatch.base.parsing import read_head
from fpmatch.errors import DatasetError
from fpmatch.gallery.listing.entry import Label, NamePattern, PrintFile
from fpmatch.printable import printable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

IMAGE_EXTENSIONS: Final = frozenset(
    (
        *(".an2", ".bmp", ".eft", ".gif", ".j2k", ".jp2", ".jpeg", ".jpg", ".pbm", ".pgm", ".png"),
        *(".pnm", ".ppm", ".tif", ".tiff", ".webp", ".wsq"),
    )
)
_DIGITS: Final = re.compile(r"(\d+)", re.ASCII)
_COMMON_SUFFIXES: Final = (".json", ".csv", ".txt", ".npy")


def natural_key(text: str) -> tuple[list[str | tuple[int, str]], str]:
    """Return a sort key that compares the numbers in a text as numbers."""
    parts: list[str | tuple[int, str]] = list(_DIGITS.split(text))
    digits = [part.lstrip("0") for part in _DIGITS.findall(text)]  # of any number
    parts[1::2] = [(len(part), part) for part in digits]
    return parts, text


def prints_in(folder: Path) -> list[Path]:
    """Return the images of a folder or, where it has none, its templates; see `find_prints`.

    Images come with the numbers in their names in order, ``9_2.png`` before ``10_1.tif``; hidden
    files are skipped. Raises DatasetError if the folder cannot be listed.
    """
    files = [path for path in _visible(folder) if path.is_file()]
    images = [path for path in files if path.suffix.lower() in IMAGE_EXTENSIONS]
    return images or _templates_among(files)


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
        for folder in _folders(root, set())
        for file in prints_in(folder)
    ]


def labelled_by_folder(root: Path, prints: Iterable[PrintFile]) -> list[PrintFile]:
    """Return the prints of the subfolders of a folder, with labels from these.

    A subfolder is a finger, or a subject whose subfolders are fingers; the name of a file, without
    suffix, is the impression. A folder with prints of different subjects by FVC's names is refused:
    it is a database. Raises DatasetError if the prints lie otherwise.
    """
    above = {folder for file in prints for folder in file.path.parent.parents}
    subjects: dict[Path, str] = {}
    labelled = []
    for file in prints:
        folder, named = file.path.parent, NamePattern().label(file.path)
        parts = folder.relative_to(root).parts
        subject = subjects.setdefault(folder, named.subject) if named is not None else ""
        if named is not None and subject != named.subject:
            why = (
                "prints of several fingers by their names FFF_M; give the folder by itself if it "
                "is a database, or --pattern if it is one finger or subject"
            )
            raise DatasetError(why, path=folder, code="database")
        if not 1 <= len(parts) <= 2 or folder in above:
            why = "the prints must all be in folders, one a finger, or one a subject and finger"
            raise DatasetError(why, path=file.path, code="not by folder")
        label = Label(*map(printable, (parts[0], "".join(parts[1:]), file.path.stem)))
        labelled.append(replace(file, label=label))
    return labelled


def _visible(folder: Path) -> list[Path]:
    """Return what a folder contains that is not hidden, numbers in names in order."""
    try:
        paths = [path for path in folder.iterdir() if not path.name.startswith(".")]
    except FileNotFoundError as error:
        raise DatasetError("no such folder", path=folder) from error
    except OSError as error:
        raise DatasetError(f"cannot be listed: {reason(error)}", path=folder) from error
    return sorted(paths, key=lambda path: natural_key(path.name))


def _folders(root: Path, entered: set[Path]) -> Iterator[Path]:
    """Yield a folder and all its subfolders, each once: a link may lead back."""
    entered.add(root.resolve())
    yield root
    for path in _visible(root):
        if path.is_dir() and path.resolve() not in entered:
            yield from _folders(path, entered)


def _templates_among(files: Sequence[Path]) -> list[Path]:
    """Return the files that are named like templates, one of each name, by name.

    JSON, CSV, text and array files are taken if they begin like templates; beside any template,
    also JSON and CSV files that are none at all, so that a damaged template is an error.
    """
    from fpmatch.formats.registry import known_codecs  # noqa: PLC0415
    from fpmatch.prints.reading import content_of  # noqa: PLC0415

    # json first, which keeps everything
    by_rank = sorted(known_codecs(), key=lambda codec: codec.name != "json")
    suffixes = [suffix for codec in by_rank for suffix in codec.suffixes]
    named = [path for path in files if path.suffix.lower() in suffixes]
    templates = {
        path
        for path in named
        if path.suffix.lower() not in _COMMON_SUFFIXES or content_of(path) in {"template", "both"}
    }
    if templates:
        templates.update(filter(_is_damaged, named))
    by_stem: dict[str, Path] = {}
    for path in sorted(templates, key=lambda path: suffixes.index(path.suffix.lower())):
        by_stem.setdefault(path.stem, path)
    return sorted(by_stem.values())


def _is_damaged(path: Path) -> bool:
    """Return whether a file named JSON or CSV is neither, or cannot be read."""
    suffix = path.suffix.lower()
    if suffix not in {".json", ".csv"}:
        return False
    text = read_head(path).decode("utf-8", errors="replace").removeprefix("\ufeff").lstrip()
    if not text or "\0" in text or "\ufffd" in text[:-4]:  # the last may be cut through
        return True
    return text[0] not in "{[" if suffix == ".json" else "," not in text.splitlines()[0]
