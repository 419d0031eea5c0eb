"""Pictures on disk: which are meant, each with its resolution, and their templates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from fpmatch.errors import ImageError, ImageReadError
from fpmatch.image.print_folder import describe_folder, images_in
from fpmatch.image.read import read_image
from fpmatch.minutiae import check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable

    from fpmatch.image.read import GreyImage
    from fpmatch.minutiae import Template


@dataclass(frozen=True, slots=True)
class PrintFile:
    """Hold where a picture lies, and its resolution.

    Parameters
    ----------
    path : Path
        The file.
    dpi : float or None
        In dots per inch; None leaves it to the file's own tag.
    """

    path: Path
    dpi: float | None = None


@dataclass(frozen=True, slots=True)
class ExtractedPrint:
    """Hold the template of a picture, and whether its resolution had to be assumed."""

    template: Template
    dpi_assumed: bool = False


def find_prints(
    places: Iterable[str | os.PathLike[str]], dpi: float | None = None
) -> list[PrintFile]:
    """Find the pictures of some files and folders.

    Parameters
    ----------
    places : iterable of path-like
        Files, and folders whose images are meant.
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
        If one of `places` is not there, or is a folder without images.
    DatasetError
        If a folder cannot be listed, or its ``dataset.toml`` is malformed.
    ResolutionError
        If `dpi` is outside 100 to 4000.
    """
    if dpi is not None:
        check_dpi(dpi)
    folder_dpi = cache(lambda folder: describe_folder(folder).dpi)
    found: dict[Path, PrintFile] = {}
    for place in map(Path, places):
        for path in _files(place):
            own = folder_dpi(path.parent) if dpi is None else dpi
            found.setdefault(path.absolute(), PrintFile(path, own))
    return list(found.values())


def extract_print(
    file: PrintFile, reader: Callable[[Path], GreyImage] = read_image
) -> ExtractedPrint:
    """Extract the template of a picture.

    Parameters
    ----------
    file : PrintFile
        The picture.
    reader : callable
        Reads it (default: `read_image`).

    Returns
    -------
    ExtractedPrint
        Its template, with one minutia at least.

    Raises
    ------
    ImageReadError, ImageError
        If it cannot be read, cannot hold a fingerprint, or has no minutiae.
    """
    from fpmatch.image.extract import extract  # noqa: PLC0415

    image = reader(file.path)
    template = extract(image, file.dpi)
    if not len(template.minutiae):
        raise ImageError(f"{file.path}: no minutiae found")
    return ExtractedPrint(template, dpi_assumed=file.dpi is None and image.dpi is None)


def _files(place: Path) -> list[Path]:
    if place.is_dir():
        images = images_in(place)
        if not images:
            raise ImageReadError(f"{place}: the folder holds no images")
        return images
    if not place.exists():
        raise ImageReadError(f"{place}: no such file or folder")
    return [place]
