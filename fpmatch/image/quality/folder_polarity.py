"""Polarity of folders: one sensor has one polarity, so all images of a folder share it."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final, Generic, TypeVar

import numpy as np

from fpmatch.errors import FpmatchError
from fpmatch.image.io.dataset_folder import read_dataset_info
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.image.quality.polarity import common_polarity, polarity_evidence
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from fpmatch.image.quality.polarity import Polarity

MOST_IMAGES: Final = 32  # sampled from a folder
MOST_IN_ALL: Final = 256  # of all folders, unless there are more folders

Read = TypeVar("Read")


@dataclass(frozen=True, slots=True)
class PolarityReader(Generic[Read]):
    """Read images with the polarity of their folders, from `find_polarities`.

    `reader` takes a path, ``polarity`` and ``dpi``, as `fpmatch.image.io.read.read_image` does.
    """

    reader: Callable[..., Read]
    folders: Mapping[Path, Polarity]
    dpi: float | None = None

    def __call__(self, path: Path) -> Read:
        """Read one file."""
        return self.reader(path, polarity=self.folders.get(path.parent, "auto"), dpi=self.dpi)


def find_polarities(
    paths: Iterable[str | os.PathLike[str]],
    *,
    polarity: Polarity = "auto",
    dpi: float | None = None,
    reader: Callable[..., object] = read_image,
) -> dict[Path, Polarity]:
    """Find the polarity of the folders of some images: "dark", "white" or "auto".

    It is `polarity` unless that is "auto"; else that of ``dataset.toml`` in the folder; else that
    of the sum of the images' evidence, at `dpi`, else the resolution of ``dataset.toml`` or the
    images' own. Folders whose own images leave doubt are decided together; "auto" leaves the
    decision to each image. Files that cannot be read are skipped; `reader` is as for
    `PolarityReader`. Raises DatasetError if a ``dataset.toml`` is malformed.
    """
    folders: dict[Path, list[Path]] = defaultdict(list)
    for path in map(Path, paths):
        folders[path.parent].append(path)
    if polarity != "auto":
        return dict.fromkeys(folders, polarity)
    description = cache(read_dataset_info)
    found = {folder: description(folder).polarity for folder in folders}
    open_ = [folder for folder, known in found.items() if known == "auto"]
    if sum(len(folders[folder]) for folder in open_) < 2:  # a single image decides for itself
        return found
    most = max(1, min(MOST_IMAGES, MOST_IN_ALL // len(open_)))
    evidence = {}
    for folder in open_:
        known_dpi = dpi or description(folder).dpi
        images = _sample(folders[folder], most, reader)
        evidence[folder] = [
            polarity_evidence(image.pixels, known_dpi or image.dpi or STANDARD_DPI)
            for image in images
        ]
    found |= {folder: common_polarity(known) for folder, known in evidence.items()}
    doubtful = [folder for folder in open_ if found[folder] == "auto"]
    together = common_polarity([one for folder in doubtful for one in evidence[folder]])
    return found | dict.fromkeys(doubtful, together)


def _sample(paths: Sequence[Path], most: int, reader: Callable[..., object]) -> Iterator[GreyImage]:
    """Yield some images of a folder, evenly chosen, without inverting any."""
    count = min(most, len(paths))
    for number in np.linspace(0, len(paths) - 1, count).round().astype(int).tolist():
        try:
            image = reader(paths[number], polarity="dark")
        except FpmatchError:
            continue
        if isinstance(image, GreyImage):
            yield image
