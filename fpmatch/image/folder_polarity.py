"""Polarity of folders: one sensor has one polarity, so all images of a folder share it."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Generic, TypeVar

import numpy as np

from fpmatch.errors import FpmatchError
from fpmatch.image.dataset_folder import read_dataset_info
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.image.quality.line_cues import polarity_evidence
from fpmatch.image.quality.polarity import MIN_EVIDENCE
from fpmatch.image.quality.ridge_scale import likely_dpi
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from fpmatch.image.quality.polarity import Polarity

MOST_IMAGES: Final = 32  # sampled from a folder
MOST_IN_ALL: Final = 256  # of all folders, unless there are more folders
FEW_IMAGES: Final = 8  # with fewer, a folder of a place is decided with the others

Read = TypeVar("Read")


@dataclass(frozen=True, slots=True)
class PolarityReader(Generic[Read]):
    """Read images with the polarity of their folders, from `find_polarities`."""

    reader: Callable[..., Read]  # takes a path, ``polarity`` and ``dpi``, as `read_image` does
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
    each: Callable[..., Iterable[float | None]] = map,
    places: Mapping[Path, Path] | None = None,
) -> dict[Path, Polarity]:
    """Find the polarity of the folders of some images: "dark", "white" or "auto".

    It is `polarity` unless that is "auto"; else that of ``dataset.toml`` in the folder; else that
    of the sum of the images' evidence, at `dpi`, else the resolution of ``dataset.toml`` or the
    images' own. Folders whose own images leave doubt are decided together; "auto" leaves the
    decision to each image. Files that cannot be read are skipped; `reader` is as for
    `PolarityReader`, and `each` as the built-in `map`: it calls a function for each image looked
    at, here or in other processes.

    `places` maps folders to the folder above, or the manifest, from which they are taken: the
    ``dataset.toml`` there counts, too, and those with fewer than `FEW_IMAGES` images, such as
    folders of one finger each, are decided together. Raises DatasetError if a ``dataset.toml`` is
    malformed.
    """
    if dpi is not None:
        check_dpi(dpi)
    folders: dict[Path, list[Path]] = defaultdict(list)
    for path in map(Path, paths):
        folders[path.parent].append(path)
    if polarity != "auto":
        return dict.fromkeys(folders, polarity)
    known = cache(read_dataset_info)
    place = {folder: (places or {}).get(folder, folder) for folder in folders}
    polarities = {folder: known(folder).polarity for folder in folders}
    for folder, above in place.items():
        if polarities[folder] == "auto" and above != folder:
            polarities[folder] = known(above if above.is_dir() else above.parent).polarity
    group = {f: place[f] if len(of) < FEW_IMAGES else f for f, of in folders.items()}
    open_ = [folder for folder in folders if polarities[folder] == "auto"]
    if sum(len(folders[folder]) for folder in open_) < 2:  # a single image decides for itself
        return polarities
    most = max(1, min(MOST_IMAGES, MOST_IN_ALL // len(open_)))
    samples = [
        (path, dpi or known(folder).dpi)
        for folder in open_
        for path in _sample(folders[folder], most)
    ]
    evidence: dict[Path, list[float]] = {group[folder]: [] for folder in open_}
    for (path, _), one in zip(samples, each(partial(_evidence, reader), samples), strict=True):
        if one is not None:
            evidence[group[path.parent]].append(one)
    polarities |= {folder: common_polarity(evidence[group[folder]]) for folder in open_}
    doubtful = [folder for folder in open_ if polarities[folder] == "auto"]
    groups = dict.fromkeys(group[folder] for folder in doubtful)
    together = common_polarity([one for key in groups for one in evidence[key]])
    return polarities | dict.fromkeys(doubtful, together)


def _sample(paths: Sequence[Path], most: int) -> list[Path]:
    """Return some images of a folder, evenly chosen."""
    places = np.linspace(0, len(paths) - 1, min(most, len(paths)))
    return [paths[number] for number in places.round().astype(int).tolist()]


def _evidence(reader: Callable[..., object], sample: tuple[Path, float | None]) -> float | None:
    """Return the evidence of an image and its resolution; None where it cannot be read."""
    path, dpi = sample
    try:
        image = reader(path, polarity="dark")
    except FpmatchError:
        return None
    if not isinstance(image, GreyImage):
        return None
    return polarity_evidence(image.pixels, dpi or image.dpi or likely_dpi(image.pixels))


def common_polarity(evidence: Sequence[float]) -> Polarity:
    """Return the polarity of images of one sensor by the `polarity_evidence` of each.

    The sum is divided by the root of their number, because images are not independent; "auto" where
    it is not certain.
    """
    total = math.fsum(evidence) / math.sqrt(max(len(evidence), 1))
    if abs(total) < MIN_EVIDENCE:
        return "auto"
    return "dark" if total > 0 else "white"
