"""The gallery of a server, whose place on this machine no answer tells."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from fpmatch.errors import GalleryError
from fpmatch.gallery.gallery import open_gallery

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.gallery.gallery import Gallery


@contextmanager
def opened_gallery(where: str) -> Iterator[Gallery]:
    """Open a gallery as `open_gallery` does; errors call it by its last name only.

    Parameters
    ----------
    where : str
        A SQLite file, or the URL of a PostgreSQL database.

    Yields
    ------
    Gallery
        The open gallery.

    Raises
    ------
    GalleryError
        If it, or what is done with it, fails.
    """
    try:
        with open_gallery(where) as gallery:
            yield gallery
    except GalleryError as error:
        place, colon, reason = str(error).partition(": ")
        raise GalleryError(f"{short_name(place)}{colon}{reason}") from error


def short_name(place: str) -> str:
    """Return the last part of a path or URL.

    Examples
    --------
    >>> short_name("/home/ada/prints.db"), short_name("postgresql://ada@host/prints")
    ('prints.db', 'prints')
    """
    return PurePosixPath(place.replace("\\", "/")).name or place
