"""The public functions that enrol prints in a gallery and search it."""

from __future__ import annotations

import os
import warnings
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.api import given_print
from fpmatch.gallery.engine.engine import make_engine
from fpmatch.gallery.gallery import Gallery, open_gallery
from fpmatch.gallery.listing.entry import NamePattern
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.gallery.search.identify import identify_given
from fpmatch.gallery.search.probes import read_hashed
from fpmatch.gallery.search.search import Search
from fpmatch.gallery.tasks.enrol import enrol as enrol_prints
from fpmatch.matching.registry import DEFAULT_MATCHER

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fpmatch.gallery.listing.entry import Label
    from fpmatch.gallery.tasks.enrol import Enrolment
    from fpmatch.matching.result import Matcher


@dataclass(frozen=True, slots=True)
class IdentifiedFinger:
    """One enrolled finger that may be the probe's.

    `score` is ``-10·log10(fmr)``, 0 to 100, of all impressions of the finger together; `number` is
    the entry of the most similar one.
    """

    label: Label
    number: int
    score: float
    fmr: float


def identify(
    gallery: str | os.PathLike[str] | Gallery,
    probe: Any,
    *,
    count: int = 10,
    threshold: float = 0.0,
    matcher: str | Matcher = DEFAULT_MATCHER,
    dpi: float | None = None,
    effort: int = 1,
    workers: int | None = None,
) -> list[IdentifiedFinger]:
    """Find the enrolled fingers that a print matches best.

    For many probes, `fpmatch.gallery.search.search.Search` prepares a gallery once.

    Parameters
    ----------
    gallery : str, path-like or Gallery
        The file or URL of a gallery that `fpmatch enrol` made, or the gallery, open.
    probe : Template, str, path-like, GreyImage, ndarray or PIL image
        The print, as for `as_template`.
    count : int
        Largest number of fingers.
    threshold : float
        Smallest score of a finger.
    matcher : str or Matcher
        The matcher, or its name.
    dpi : float, optional
        Resolution of an image (default: that in the file, else by its ridges).
    effort : int
        1, 2 or 4: how many prints of a gallery of more than 2,000 are compared, and so how few
        mates are missed.
    workers : int, optional
        Processes that prepare prints, and threads that search (default: one a core).

    Returns
    -------
    list of IdentifiedFinger
        Best first. Entries that are damaged are skipped, each with a warning.

    Raises
    ------
    GalleryError
        If the gallery cannot be read.
    MatcherError
        If the matcher is unknown or not calibrated, or `count`, `threshold` or `effort` is out
        of range.
    """
    content = None
    if isinstance(probe, str | os.PathLike):
        given, content = read_hashed(Path(probe), lambda: given_print(probe, dpi=dpi))
    else:
        given = given_print(probe, dpi=dpi)
    how: dict[str, Any] = {"count": count, "threshold": threshold, "effort": effort}
    with _opened(gallery) as opened:
        search = Search(opened, matcher, engine=make_engine(workers))
        _, result = identify_given(search, given, workers=workers, **how)
        for number, why in opened.damaged.items():
            warnings.warn(f"{opened.name}: entry {number} is skipped: {why}", stacklevel=2)
        opened.record("identify", probe=content, candidates=result.numbers)
    return [
        IdentifiedFinger(entry.label, one.number, one.score, one.fmr)
        for one, entry in zip(result.candidates, result.entries, strict=True)
    ]


def enrol(
    gallery: str | os.PathLike[str] | Gallery,
    prints: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    *,
    pattern: str | None = None,
    dpi: float | None = None,
    workers: int | None = None,
    strict: bool = False,
) -> Enrolment:
    """Enrol prints in a gallery, those that are not in it.

    `fpmatch.gallery.tasks.enrol.enrol` has more parameters.

    Parameters
    ----------
    gallery : str, path-like or Gallery
        The file or URL of a gallery, made where it is missing, or the gallery, open.
    prints : path, or iterable of paths
        Folders, manifests, and files of images and templates.
    pattern : str, optional
        Regular expression with groups ``subject``, ``finger``, ``impression`` that gets labels
        from paths (default: FVC's names, ``101_3.tif``).
    dpi : float, optional
        Resolution of all images (default: that in a manifest, in ``dataset.toml`` or in the file,
        else by its ridges).
    workers : int, optional
        Processes to use (default: one a core).
    strict : bool
        Whether to refuse prints that match no other impression of their finger, and those that are
        probably two prints in one.

    Returns
    -------
    Enrolment
        Numbers of prints enrolled now and before, the prints that failed, with reasons, and those
        that were added to subjects that existed before and match nothing of their finger.

    Raises
    ------
    GalleryError
        If the gallery cannot be read or written, or `pattern` is malformed.
    ImageReadError, DatasetError
        If a file or folder is missing, or a manifest is malformed.

    Examples
    --------
    >>> from fpmatch import enrol
    >>> done = enrol("prints.db", "sample_data")  # doctest: +SKIP
    >>> done.enrolled, done.failures  # doctest: +SKIP
    (16, [])
    """
    names = None if pattern is None else NamePattern(pattern)
    places = [prints] if isinstance(prints, str | os.PathLike) else prints
    files = find_prints(places, dpi, pattern=names)
    with _opened(gallery, create=True) as opened:
        engine = make_engine(workers)
        return enrol_prints(opened, files, pattern=names, engine=engine, strict=strict)


def _opened(
    gallery: str | os.PathLike[str] | Gallery, *, create: bool = False
) -> AbstractContextManager[Gallery]:
    """Return a gallery, opened for this call unless it is open."""
    if isinstance(gallery, Gallery):
        return nullcontext(gallery)
    return open_gallery(gallery, create=create)
