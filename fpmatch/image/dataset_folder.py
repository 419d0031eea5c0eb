"""The file ``dataset.toml``, which describes the prints of a folder.

An example of that file::

    name = "FVC2002 DB1_B"
    dpi = 500
    sensor = "optical, Identix TouchView II"
    polarity = "dark"
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.base.parsing import ParseError, parse_toml
from fpmatch.errors import DatasetError, ImageError, ResolutionError
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    import os

    from fpmatch.image.quality.polarity import Polarity

DESCRIPTION_FILE: Final = "dataset.toml"
MOST_BYTES: Final = 2**20  # of it


@dataclass(frozen=True, slots=True)
class DatasetInfo:
    """The contents of ``dataset.toml``, which describe all prints of a folder."""

    name: str | None = None  # of the database
    dpi: float | None = None  # None: each file's own
    sensor: str = ""
    polarity: Polarity = "auto"  # "dark" or "white" ridges; "auto": unknown


def folder_settings(
    path: str | os.PathLike[str], *, polarity: Polarity = "auto", dpi: float | None = None
) -> tuple[Polarity, float | None]:
    """Return polarity and dpi of a print as given, else as its ``dataset.toml`` states them."""
    info = read_dataset_info(Path(path).parent)
    return (info.polarity if polarity == "auto" else polarity), info.dpi if dpi is None else dpi


def resolution_of(path: Path, above: Path | None = None) -> float | None:
    """Return the resolution that ``dataset.toml`` beside a print states, else that in `above`."""
    beside = read_dataset_info(path.parent).dpi
    return beside if beside or above is None else read_dataset_info(above).dpi


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
