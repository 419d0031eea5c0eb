"""The files of prints that a command line names, in folders too, and how they are read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

from fpmatch.cli.command import load_object

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from fpmatch.image.quality.polarity import Polarity

Read = TypeVar("Read")


class GivenFile(NamedTuple, Generic[Read]):
    """A file, its place below the folder that was named, its resolution, and its reader."""

    path: Path
    place: Path  # relative
    dpi: float | None
    read: Callable[[Path], Read]


def given_files(
    places: Sequence[Path],
    reader: Callable[..., Read],
    *,
    polarity: Polarity,
    dpi: float | None,
) -> list[GivenFile[Read]]:
    """Return files, in place of a folder its prints, as `enrol` takes them.

    Prints of one folder are read with its polarity and their common resolution; `reader` is as
    for `fpmatch.image.folder_traits.find_traits`.
    """
    from fpmatch.image.dataset_folder import resolution_of
    from fpmatch.image.folder_traits import FolderReader, find_traits
    from fpmatch.templates.minutiae import check_dpi

    if dpi is not None:
        check_dpi(dpi)
    listed: list[tuple[Path, Path | None]] = [(place, None) for place in places]
    if any(place.is_dir() for place in places):
        of = load_object("fpmatch.gallery.listing.folders:files_of", used_by="a folder")
        listed = [(file.path, file.place) for place in places for file in of(place)]
    above = {file.parent: place for file, place in listed if place is not None}
    files = [file for file, _ in listed]
    traits = find_traits(files, polarity=polarity, dpi=dpi, reader=reader, places=above)
    read = FolderReader(reader, traits, dpi)
    return [
        GivenFile(
            file, file.relative_to(place or file.parent), dpi or resolution_of(file, place), read
        )
        for file, place in listed
    ]
