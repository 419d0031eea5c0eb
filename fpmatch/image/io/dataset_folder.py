"""A folder of prints: its images, and what it says of them.

A file ``dataset.toml`` beside the prints may say what they do not::

    name = "FVC2002 DB1_B"
    dpi = 500
    sensor = "optical, Identix TouchView II"
    polarity = "dark"
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.errors import DatasetError, ImageError, ResolutionError
from fpmatch.minutiae import check_dpi

if TYPE_CHECKING:
    import os

    from fpmatch.image.quality.polarity import Polarity

DESCRIPTION_FILE: Final = "dataset.toml"
IMAGE_EXTENSIONS: Final = frozenset(
    (
        *(".bmp", ".gif", ".jpeg", ".jpg", ".pbm", ".pgm", ".png", ".pnm", ".ppm"),
        *(".tif", ".tiff", ".webp"),
        *(".j2k", ".jp2", ".wsq"),
        *(".an2", ".eft"),
    )
)
_DIGITS: Final = re.compile(r"(\d+)", re.ASCII)


@dataclass(frozen=True, slots=True)
class DatasetInfo:
    """Hold what ``dataset.toml`` says of the prints beside it.

    Parameters
    ----------
    name : str or None
        Name of the database.
    dpi : float or None
        Resolution of all prints in dots per inch; None leaves it to each file's own tag.
    sensor : str
        What took the prints; "" where nobody says.
    polarity : str
        "dark" or "white": how all prints show their ridges; "auto" where nobody says.
    """

    name: str | None = None
    dpi: float | None = None
    sensor: str = ""
    polarity: Polarity = "auto"


def images_in(folder: str | os.PathLike[str]) -> list[Path]:
    """Return the files of a folder that are named like images, numbers in their names in order.

    Parameters
    ----------
    folder : path-like
        The folder; not those in it. Hidden files are passed over.

    Returns
    -------
    list of Path
        ``9_2.png`` before ``10_1.tif``.

    Raises
    ------
    DatasetError
        If it is missing, no folder, or cannot be listed.
    """
    root = Path(folder)
    if not root.exists():
        raise DatasetError(f"{root}: no such folder")
    if not root.is_dir():
        raise DatasetError(f"{root}: not a folder of prints")
    try:
        files = [path for path in root.iterdir() if _is_named_like_an_image(path)]
    except OSError as error:
        raise DatasetError(f"{root}: cannot be listed: {error.strerror}") from error
    return sorted((path for path in files if path.is_file()), key=_natural_order)


def read_dataset_info(folder: str | os.PathLike[str]) -> DatasetInfo:
    """Read the ``dataset.toml`` of a folder.

    Parameters
    ----------
    folder : path-like
        The folder.

    Returns
    -------
    DatasetInfo
        What it says; nothing where there is no such file.

    Raises
    ------
    DatasetError
        If the file cannot be read, or an entry is not what it should be.
    """
    path = Path(folder) / DESCRIPTION_FILE
    if not path.is_file():
        return DatasetInfo()
    try:
        entries = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = str(error).splitlines()[0]
        raise DatasetError(f"{path}: not a readable TOML file: {reason}") from error
    for key in ("name", "sensor"):
        if key in entries and not (isinstance(entries[key], str) and entries[key].isprintable()):
            raise DatasetError(f"{path}: {key} must be text of one line")
    if entries.get("name") == "":
        raise DatasetError(f"{path}: name is empty")
    dpi = _checked_dpi(path, entries["dpi"]) if "dpi" in entries else None
    polarity = _checked_polarity(path, entries["polarity"]) if "polarity" in entries else "auto"
    return DatasetInfo(entries.get("name"), dpi, entries.get("sensor", ""), polarity)


def _is_named_like_an_image(path: Path) -> bool:
    return path.suffix.lower() in IMAGE_EXTENSIONS and not path.name.startswith(".")


def _natural_order(path: Path) -> tuple[list[str | int], str]:
    """Return a key by which numbers in names are compared as numbers."""
    parts: list[str | int] = list(_DIGITS.split(path.name))
    parts[1::2] = [int(part) for part in parts[1::2]]
    return parts, path.name


def _checked_polarity(path: Path, polarity: object) -> Polarity:
    from fpmatch.image.quality.polarity import check_polarity  # noqa: PLC0415  (takes OpenCV's time)

    try:
        return check_polarity(polarity)
    except ImageError as error:
        raise DatasetError(f"{path}: {error}") from error


def _checked_dpi(path: Path, dpi: object) -> float:
    if isinstance(dpi, bool) or not isinstance(dpi, int | float):
        raise DatasetError(f"{path}: dpi must be a number")
    try:
        return check_dpi(dpi)
    except (ResolutionError, OverflowError) as error:
        raise DatasetError(f"{path}: {error}") from error
