"""Polarity and resolution of folders: images of one sensor share them, so a folder decides both."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, TypeVar

import numpy as np

from fpmatch.errors import FpmatchError
from fpmatch.image.dataset_folder import read_dataset_info
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.image.quality.polarity import background_level
from fpmatch.image.quality.ridge_scale import (
    clear_period_px,
    common_dpi,
    is_sound,
)
from fpmatch.templates.minutiae import STANDARD_DPI, check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from fpmatch.image.quality.polarity import Polarity

MOST_IMAGES: Final = 32  # sampled from a folder
MOST_IN_ALL: Final = 256  # of all folders, unless there are more folders
FEW_IMAGES: Final = 8  # with fewer, a folder of a place is decided with the others
LEAST_LEVEL: Final = 1.5  # sum of background levels from which a folder's polarity is certain

Read = TypeVar("Read")


@dataclass(frozen=True, slots=True)
class FolderTraits:
    """What the images of a folder share; "auto" and None leave it to each image."""

    polarity: Polarity = "auto"
    dpi: float | None = None  # of images that state none


@dataclass(frozen=True, slots=True)
class FolderReader(Generic[Read]):
    """Read images with the polarity and resolution of their folders, from `find_traits`."""

    reader: Callable[..., Read]  # takes a path, ``polarity`` and ``dpi``, as `read_image` does
    folders: Mapping[Path, FolderTraits]
    dpi: float | None = None

    def __call__(self, path: Path) -> Read:
        """Read one file."""
        traits = self.folders.get(path.parent, FolderTraits())
        content = self.reader(path, polarity=traits.polarity, dpi=self.dpi)
        if self.dpi is not None or not isinstance(content, GreyImage) or content.dpi is not None:
            return content
        if traits.dpi is None or not is_sound(content.pixels.shape, traits.dpi):
            return content
        return replace(content, likely_dpi=traits.dpi)


class _Evidence(NamedTuple):
    """The background of an image, and the distance of its ridges, where these are needed."""

    background: float
    period_px: float | None


def find_traits(
    paths: Iterable[str | os.PathLike[str]],
    *,
    polarity: Polarity = "auto",
    dpi: float | None = None,
    reader: Callable[..., object] = read_image,
    each: Callable[..., Iterable[Any]] = map,
    places: Mapping[Path, Path] | None = None,
    earlier: Mapping[Path, float] | None = None,
) -> dict[Path, FolderTraits]:
    """Find the polarity, "dark", "white" or "auto", and the resolution of the folders of images.

    The polarity is `polarity` unless that is "auto"; else that of ``dataset.toml`` in the folder;
    else that of the sum of the images' background levels; "auto" leaves the decision to each image.
    The resolution of those that state none is found from their ridges; see
    `fpmatch.image.quality.ridge_scale.common_dpi`.

    Of each folder at most `MOST_IMAGES` are looked at, chosen by their places in the list, so that
    a run that is repeated finds the same. Files that cannot be read are skipped; `reader` is as for
    `FolderReader`, and `each` as the built-in `map`: it calls a function for each image looked
    at, here or in other processes.

    `places` maps folders to the folder above, or the manifest, from which they are taken: the
    ``dataset.toml`` there counts, too, and those with fewer than `FEW_IMAGES` images, such as
    folders of one finger each, are decided together. `earlier` has the resolution that was found
    for earlier prints of some folders: it stays unless the ridges rule it out. Raises DatasetError
    if a ``dataset.toml`` is malformed.
    """
    if dpi is not None:
        check_dpi(dpi)
    folders: dict[Path, list[Path]] = defaultdict(list)
    for path in map(Path, paths):
        folders[path.parent].append(path)
    known = cache(read_dataset_info)
    place = {folder: (places or {}).get(folder, folder) for folder in folders}
    polarities = dict.fromkeys(folders, polarity)
    resolutions: dict[Path, float | None] = dict.fromkeys(folders, dpi)
    for folder, above in place.items():
        for described in dict.fromkeys((folder, above if above.is_dir() else above.parent)):
            if polarities[folder] == "auto":
                polarities[folder] = known(described).polarity
            resolutions[folder] = resolutions[folder] or known(described).dpi
    group = {f: place[f] if len(of) < FEW_IMAGES else f for f, of in folders.items()}
    open_ = [f for f in folders if polarities[f] == "auto" or resolutions[f] is None]
    known_dpi = {folder: one for folder, one in (earlier or {}).items() if folder in open_}
    if sum(len(folders[f]) for f in open_) < 2 and not known_dpi:  # one decides for itself
        return {folder: FolderTraits(one) for folder, one in polarities.items()}
    most = max(1, min(MOST_IMAGES, MOST_IN_ALL // len(open_)))
    samples: list[tuple[Path, float | None, Polarity]] = []
    for folder in open_:
        paths_of = folders[folder]
        places_of = np.linspace(0, len(paths_of) - 1, min(most, len(paths_of))).round()
        chosen = [paths_of[number] for number in places_of.astype(int).tolist()]
        samples += [(path, resolutions[folder], polarities[folder]) for path in chosen]
    evidence: dict[Path, list[_Evidence]] = {group[folder]: [] for folder in open_}
    for (path, *_), one in zip(samples, each(partial(_evidence, reader), samples), strict=True):
        if one is not None:
            evidence[group[path.parent]].append(one)
    traits = {folder: FolderTraits(one) for folder, one in polarities.items()}
    for folder in open_:
        of_group = evidence[group[folder]]
        if polarities[folder] == "auto":
            polarities[folder] = common_polarity([one.background for one in of_group])
        periods = [one.period_px for one in of_group if one.period_px is not None]
        usual, common = known_dpi.get(folder), None
        if len(periods) > 1 or usual is not None:  # one print alone decides for itself
            common = common_dpi(periods, usual or STANDARD_DPI)
        traits[folder] = FolderTraits(polarities[folder], common)
    return traits


def _evidence(
    reader: Callable[..., object], sample: tuple[Path, float | None, Polarity]
) -> _Evidence | None:
    """Return the evidence of an image, its resolution and polarity; None if it cannot be read."""
    path, dpi, polarity = sample
    try:
        image = reader(path, polarity="dark")
    except FpmatchError:
        return None
    if not isinstance(image, GreyImage):
        return None
    level = background_level(image.pixels) if polarity == "auto" else 0.0
    return _Evidence(level, None if dpi or image.dpi else clear_period_px(image.pixels))


def common_polarity(levels: Sequence[float]) -> Polarity:
    """Return the polarity of images of one sensor by their background levels; "auto" in doubt."""
    total = math.fsum(levels)
    if abs(total) < LEAST_LEVEL:
        return "auto"
    return "dark" if total > 0 else "white"
