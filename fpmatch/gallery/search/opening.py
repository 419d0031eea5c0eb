"""Open the search of a gallery: by its index where that is large, else of whole prints."""

from __future__ import annotations

import warnings
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.fingers.finger import refuse_images
from fpmatch.gallery.index.loss import DEFAULT_LOSS, EXHAUSTIVE_UP_TO
from fpmatch.gallery.index.prints.compare import packs
from fpmatch.gallery.search.whole import ENTRY, WholeSearch
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.result import named, prepare_print

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.search.search import Search
    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.matching.result import Matcher


def open_search(
    gallery: Gallery,
    matcher: str | Matcher = DEFAULT_MATCHER,
    *,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    note: Callable[[str], object] | None = None,
    loss: float = DEFAULT_LOSS,
    before: Search | None = None,
) -> Search:
    """Prepare the prints that are in a gallery now for a search.

    More than `EXHAUSTIVE_UP_TO` prints are indexed, unless a `loss` of 0, as it will be given to
    `fpmatch.gallery.search.identify.identify`, demands that all are compared. The gallery may be
    closed afterwards, but a search by an index connects to it again.

    The `engine` prepares prints (default: all cores); `progress` is called with stage "prepare" and
    numbers of prints, and `note` with a line on files that cannot be used, and are prepared or
    built again (default: a RuntimeWarning). The index of `before`, an earlier search of the
    gallery, is continued. Raises GalleryError if the gallery cannot be read; MatcherError if the
    matcher is unknown.
    """
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    refuse_images(chosen, "a gallery has templates alone")
    given: dict[str, Any] = {"engine": engine, "progress": progress, "note": note or _warn}
    if not packs(chosen):
        return _prepared_one_by_one(gallery, chosen, progress)
    large = gallery.has_over(EXHAUSTIVE_UP_TO)
    if not (large and loss and chosen.name == DEFAULT_MATCHER):
        return _prepared(gallery, chosen, **given)
    from fpmatch.gallery.index.gallery_index import GalleryIndex  # noqa: PLC0415  (imports the index)
    from fpmatch.gallery.search.indexed import IndexedSearch  # noqa: PLC0415

    if isinstance(before, IndexedSearch):
        return before.current(gallery)
    index = GalleryIndex(gallery, chosen, **given)
    whole = partial(_prepared, gallery, chosen, **given)
    return IndexedSearch(index, gallery.damaged, whole)


def _prepared(gallery: GalleryReader, matcher: Matcher, **given: Any) -> WholeSearch:
    """Return the search of prints that are prepared from whole templates, and packed."""
    from fpmatch.gallery.index.prepared import prepare_gallery  # noqa: PLC0415

    kept = prepare_gallery(gallery, matcher, **given)
    return WholeSearch(matcher, kept.numbers, kept.fingers, kept.prints, dict(gallery.damaged))


def _prepared_one_by_one(
    gallery: GalleryReader, matcher: Matcher, progress: Progress
) -> WholeSearch:
    """Return the search of prints that cannot be packed."""
    gallery.check_sums()
    total = len(gallery)
    progress("prepare", 0, total)
    finger_of = gallery.fingers()
    read, references = [], []
    for number, template in gallery.templates():
        read.append(number)
        try:
            references.append(prepare_print(matcher, template, None))
        except MatcherError as error:
            raise named(error, f"{ENTRY}{number}") from error
        progress("prepare", min(len(read), total), total)
    numbers = np.array(read, np.int64)
    fingers = np.array([finger_of.get(number, number) for number in read], np.int64)
    return WholeSearch(matcher, numbers, fingers, references, dict(gallery.damaged))


def _warn(text: str) -> None:
    """Warn the caller of `open_search`."""
    warnings.warn(text, RuntimeWarning, stacklevel=4)
