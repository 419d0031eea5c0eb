"""An FVC-style database: a folder of prints ``FFF_M.ext``, finger FFF and impression M.

A file ``dataset.toml`` beside the prints may say what they do not::

    name = "FVC2002 DB1_B"
    dpi = 500
    sensor = "optical, Identix TouchView II"
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import DatasetError, ResolutionError
from fpmatch.minutiae import check_dpi

if TYPE_CHECKING:
    import os

DESCRIPTION_FILE: Final = "dataset.toml"
IMAGE_EXTENSIONS: Final = frozenset({".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".tif", ".tiff"})
_PRINT_NAME: Final = re.compile(r"(\d+)_(\d+)", re.ASCII)


@dataclass(frozen=True, slots=True, order=True)
class Impression:
    """Hold where one print lies and which finger it shows.

    Parameters
    ----------
    finger, number : int
        The finger, and which of its impressions this is.
    path : Path
        The image file.
    """

    finger: int
    number: int
    path: Path


@dataclass(frozen=True, slots=True)
class Dataset:
    """Hold one database.

    Parameters
    ----------
    name : str
        Name from ``dataset.toml``, else the folder's.
    dpi : float or None
        Resolution of all prints in dots per inch; None leaves it to each file's own tag.
    sensor : str
        What took the prints; "" where nobody says.
    impressions : tuple of Impression
        All prints, by finger and number.
    """

    name: str
    dpi: float | None
    sensor: str
    impressions: tuple[Impression, ...]


def load_dataset(folder: str | os.PathLike[str]) -> Dataset:
    """Find the prints of an FVC-style folder and read its description, no image yet.

    Files that are not named like a print (``FFF_M`` and an image extension) are passed over.

    Parameters
    ----------
    folder : path
        The folder.

    Returns
    -------
    Dataset
        Its prints, sorted by finger and number.

    Raises
    ------
    DatasetError
        If `folder` is not a folder, holds no print or holds one twice (``101_1.tif`` and
        ``101_1.png``), or its ``dataset.toml`` is malformed.
    """
    root = Path(folder)
    if not root.exists():
        raise DatasetError(f"{root}: no such folder")
    if not root.is_dir():
        raise DatasetError(f"{root}: not a folder of prints")
    impressions = _find_impressions(root)
    description = _read_description(root / DESCRIPTION_FILE)
    return Dataset(
        name=description.get("name", root.resolve().name),
        dpi=description.get("dpi"),
        sensor=description.get("sensor", ""),
        impressions=impressions,
    )


def _find_impressions(root: Path) -> tuple[Impression, ...]:
    found: dict[tuple[int, int], Path] = {}
    try:
        files = sorted(root.iterdir())
    except OSError as error:
        raise DatasetError(f"{root}: cannot be listed: {error.strerror}") from error
    for path in files:
        named = _PRINT_NAME.fullmatch(path.stem)
        if named is None or path.suffix.lower() not in IMAGE_EXTENSIONS or not path.is_file():
            continue
        key = (int(named[1]), int(named[2]))
        if key in found:
            raise DatasetError(f"{root}: {found[key].name} and {path.name} are the same impression")
        found[key] = path
    if not found:
        raise DatasetError(f"{root}: holds no prints named FFF_M.tif (finger FFF, impression M)")
    return tuple(sorted(Impression(*key, path) for key, path in found.items()))


def _read_description(path: Path) -> dict[str, Any]:
    """Return the checked entries of ``dataset.toml``; none where there is no such file."""
    if not path.is_file():
        return {}
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
    if "dpi" in entries:
        entries["dpi"] = _checked_dpi(path, entries["dpi"])
    return entries


def _checked_dpi(path: Path, dpi: object) -> float:
    if isinstance(dpi, bool) or not isinstance(dpi, int | float):
        raise DatasetError(f"{path}: dpi must be a number")
    try:
        return check_dpi(dpi)
    except (ResolutionError, OverflowError) as error:
        raise DatasetError(f"{path}: {error}") from error
