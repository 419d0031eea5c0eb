"""Resolution of folders: images of one sensor share it, so those of a folder decide together."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

import numpy as np

from fpmatch.errors import FpmatchError
from fpmatch.image.dataset_folder import read_dataset_info
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.image.quality.ridge_scale import clear_period_px, common_dpi, is_sound
from fpmatch.templates.minutiae import STANDARD_DPI, check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Mapping

    from fpmatch.image.quality.polarity import Polarity

MOST_IMAGES: Final = 32  # sampled from a folder
MOST_IN_ALL: Final = 256  # of all folders, unless there are more folders
FEW_IMAGES: Final = 8  # with fewer, a folder of a place is decided with the others

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

    The polarity is `polarity` unless that is "auto"; else that of ``dataset.toml`` in the folder.
    The resolution of images that state none is found from their ridges; see
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
    open_ = [folder for folder in folders if resolutions[folder] is None]
    known_dpi = {folder: one for folder, one in (earlier or {}).items() if folder in open_}
    traits = {folder: FolderTraits(one) for folder, one in polarities.items()}
    if sum(len(folders[f]) for f in open_) < 2 and not known_dpi:  # one decides for itself
        return traits
    most = max(1, min(MOST_IMAGES, MOST_IN_ALL // len(open_)))
    samples: list[Path] = []
    for folder in open_:
        all_of = folders[folder]
        chosen = np.linspace(0, len(all_of) - 1, min(most, len(all_of))).round().astype(int)
        samples += [all_of[number] for number in chosen.tolist()]
    periods: dict[Path, list[float]] = {group[folder]: [] for folder in open_}
    for path, period in zip(samples, each(partial(_unstated_period, reader), samples), strict=True):
        if period is not None:
            periods[group[path.parent]].append(period)
    for folder in open_:
        of_group, usual = periods[group[folder]], known_dpi.get(folder)
        if len(of_group) > 1 or usual is not None:  # one print alone decides for itself
            dpi = common_dpi(of_group, usual or STANDARD_DPI)
            traits[folder] = replace(traits[folder], dpi=dpi)
    return traits


def _unstated_period(reader: Callable[..., object], path: Path) -> float | None:
    """Return the distance of the ridges of an image that is read and states no resolution."""
    try:
        image = reader(path, polarity="dark")
    except FpmatchError:
        return None
    if not isinstance(image, GreyImage) or image.dpi is not None:
        return None
    return clear_period_px(image.pixels)
