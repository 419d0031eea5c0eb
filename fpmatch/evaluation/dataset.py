"""An FVC-style database: a folder of prints ``FFF_M.ext``, finger FFF and impression M."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.errors import DatasetError
from fpmatch.image.io.dataset_folder import images_in, read_dataset_info

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

_PRINT_NAME: Final = re.compile(r"(\d+)_(\d+)", re.ASCII)


@dataclass(frozen=True, slots=True, order=True)
class Impression:
    """Hold the file of one print, its finger, and which impression of the finger it is."""

    finger: int
    number: int
    path: Path


@dataclass(frozen=True, slots=True)
class Dataset:
    """Hold one database: its name is from ``dataset.toml``, else the folder's.

    `dpi` is the resolution of all prints (None: that of each file's own tag), and `sensor` is ""
    where it is not known. Impressions are sorted by finger and number.
    """

    name: str
    dpi: float | None
    sensor: str
    impressions: tuple[Impression, ...]


def load_dataset(folder: str | os.PathLike[str]) -> Dataset:
    """Find the prints of an FVC-style folder, by finger and number, and read its description.

    No image is read. Files that are not named ``FFF_M`` and an image extension are ignored.

    Raises
    ------
    DatasetError
        If `folder` is not a folder, holds no print or holds one twice (``101_1.tif`` and
        ``101_1.png``), or its ``dataset.toml`` is malformed.
    """
    root = Path(folder)
    impressions = _find_impressions(root)
    description = read_dataset_info(root)
    return Dataset(
        name=description.name or root.resolve().name,
        dpi=description.dpi,
        sensor=description.sensor,
        impressions=impressions,
    )


def with_unique_names(datasets: Sequence[Dataset]) -> list[Dataset]:
    """Return databases with different names: a name that comes twice becomes the folder's."""
    count = Counter(dataset.name for dataset in datasets)
    return [
        replace(dataset, name=dataset.impressions[0].path.resolve().parent.name)
        if count[dataset.name] > 1
        else dataset
        for dataset in datasets
    ]


def _find_impressions(root: Path) -> tuple[Impression, ...]:
    found: dict[tuple[int, int], Path] = {}
    for path in images_in(root):
        named = _PRINT_NAME.fullmatch(path.stem)
        if named is None:
            continue
        key = (int(named[1]), int(named[2]))
        if key in found:
            raise DatasetError(f"{root}: {found[key].name} and {path.name} are the same impression")
        found[key] = path
    if not found:
        raise DatasetError(f"{root}: holds no prints named FFF_M.tif (finger FFF, impression M)")
    return tuple(sorted(Impression(*key, path) for key, path in found.items()))
