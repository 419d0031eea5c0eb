"""A folder of prints: its images, and the file ``dataset.toml`` that describes them.

An example of that file::

    name = "FVC2002 DB1_B"
    dpi = 500
    sensor = "optical, Identix TouchView II"
    polarity = "dark"
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.errors import DatasetError, ImageError, ResolutionError
from fpmatch.parsing import ParseError, parse_toml
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    import os

    from fpmatch.image.quality.polarity import Polarity

DESCRIPTION_FILE: Final = "dataset.toml"
MOST_BYTES: Final = 2**20  # of it
IMAGE_EXTENSIONS: Final = frozenset(
    (
        *(".an2", ".bmp", ".eft", ".gif", ".j2k", ".jp2", ".jpeg", ".jpg", ".pbm", ".pgm", ".png"),
        *(".pnm", ".ppm", ".tif", ".tiff", ".webp", ".wsq"),
    )
)
_DIGITS: Final = re.compile(r"(\d+)", re.ASCII)


@dataclass(frozen=True, slots=True)
class DatasetInfo:
    """The contents of ``dataset.toml``, which describe all prints of a folder."""

    name: str | None = None  # of the database
    dpi: float | None = None  # None: each file's own
    sensor: str = ""
    polarity: Polarity = "auto"  # "dark" or "white" ridges; "auto": unknown


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


def read_dataset_info(folder: str | os.PathLike[str]) -> DatasetInfo:
    """Read the ``dataset.toml`` of a folder, if any; raise DatasetError if it is not valid."""
    path = Path(folder) / DESCRIPTION_FILE
    if not path.is_file():
        return DatasetInfo()
    try:
        with path.open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise ParseError(f"more than {MOST_BYTES} bytes")
        entries = parse_toml(content)
    except (OSError, ParseError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise DatasetError(f"{path}: not a readable TOML file: {why}") from error
    for key in ("name", "sensor"):
        if key in entries and not (isinstance(entries[key], str) and entries[key].isprintable()):
            raise DatasetError(f"{path}: {key} must be text of one line")
    if not entries.get("name", "a name").strip():
        raise DatasetError(f"{path}: name is empty")
    try:
        if (dpi := entries.get("dpi")) is not None:
            if isinstance(dpi, bool) or not isinstance(dpi, int | float):
                raise ResolutionError("dpi must be a number")
            dpi = check_dpi(dpi)
        polarity: Polarity = "auto"
        if "polarity" in entries:  # only then, because its module imports OpenCV
            from fpmatch.image.quality.polarity import check_polarity  # noqa: PLC0415

            polarity = check_polarity(entries["polarity"])
    except (ImageError, ResolutionError) as error:
        raise DatasetError(f"{path}: {error}") from error
    return DatasetInfo(entries.get("name"), dpi, entries.get("sensor", ""), polarity)


def natural_key(text: str) -> tuple[list[str | tuple[int, str]], str]:
    """Return a sort key that compares the numbers in a text as numbers.

    Examples
    --------
    >>> sorted(["10_1", "9_2", "a"], key=natural_key)
    ['9_2', '10_1', 'a']
    """
    parts: list[str | tuple[int, str]] = list(_DIGITS.split(text))
    digits = [part.lstrip("0") for part in _DIGITS.findall(text)]  # of any number
    parts[1::2] = [(len(part), part) for part in digits]
    return parts, text
