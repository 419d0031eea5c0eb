"""Open the search of a gallery: by its index where that is large, else of whole prints."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import FpmatchError, MatcherError
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.index.compare import packs
from fpmatch.gallery.search.search import GallerySubjects
from fpmatch.gallery.search.whole import ENTRY, WholeSearch
from fpmatch.gallery.store.stored_template import unpack_template
from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.result import call_matcher, named

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.search.search import Search
    from fpmatch.gallery.store.gallery import Gallery
    from fpmatch.matching.result import Matcher

EXHAUSTIVE_UP_TO: Final = 2_000  # prints, which are all compared


def open_search(
    gallery: Gallery,
    matcher: str | Matcher = DEFAULT_MATCHER,
    *,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    note: Callable[[str], object] | None = None,
    before: Search | None = None,
) -> Search:
    """Prepare the prints that are in a gallery now for a search.

    More than `EXHAUSTIVE_UP_TO` prints are indexed, for the default matcher. The gallery may be
    closed afterwards: the search connects to it again.

    The `engine` prepares prints of an index (default: all cores); `progress` is called with stage
    "prepare" and numbers of prints, and `note` with a line on files that cannot be used, and are
    built again (default: a RuntimeWarning). An earlier search of the gallery, `before`, is
    continued, with what it was opened with. Raises GalleryError if the gallery cannot be read;
    MatcherError if the matcher is unknown.
    """
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    say = note or _warn
    indexed = COMPILED and packs(chosen) and chosen.name == DEFAULT_MATCHER
    if not (indexed and gallery.has_over(EXHAUSTIVE_UP_TO)):
        return _whole(gallery, chosen, progress, before)
    from fpmatch.gallery.index.follow import GalleryIndex  # noqa: PLC0415  (imports the index)
    from fpmatch.gallery.search.indexed import IndexedSearch  # noqa: PLC0415

    if isinstance(before, IndexedSearch):
        index = before.index
        index.follow(gallery)
        if index.numbers is before.numbers:
            before.take_gallery(gallery)
            return before
    else:
        index = GalleryIndex(chosen, engine=engine, progress=progress, note=say)
        index.follow(gallery)
    return IndexedSearch(gallery, index)


def _whole(
    gallery: Gallery, matcher: Matcher, progress: Progress, before: Search | None
) -> WholeSearch:
    """Return the search of all prints; those that are in the search `before` are not read again."""
    gallery.check_keys()
    state, (enrolled, digests) = gallery.content_hash(), gallery.digests()
    subjects = GallerySubjects(gallery)
    of_number = dict(zip(enrolled.tolist(), digests.tolist(), strict=True))
    new, places = enrolled.tolist(), np.empty(0, np.intp)
    if isinstance(before, WholeSearch):
        if before.state == state:
            before.subjects = subjects
            return before
        entries = zip(before.numbers.tolist(), before.digests.tolist(), strict=True)
        places = np.flatnonzero([of_number.get(number) == digest for number, digest in entries])
        known = before.numbers[places].tolist()
        new = sorted(of_number.keys() - known)
        if known and new and new[0] < known[-1]:  # their order would be another
            new, places = enrolled.tolist(), places[:0]
    numbers, prints = [], []
    progress("prepare", 0, len(new))
    for number, data in gallery.packed_templates(of=new if len(places) else None):
        try:
            prints.append(call_matcher(matcher, "prepare", unpack_template(data)))
        except MatcherError as error:
            raise named(error, f"{ENTRY}{number}") from error
        except FpmatchError as error:
            gallery.damaged[number] = str(error)
            continue
        numbers.append(number)
        progress("prepare", min(len(numbers), len(new)), len(new))
    search = WholeSearch(matcher, numbers, prints, subjects, dict(gallery.damaged))
    if isinstance(before, WholeSearch) and len(places):
        search = search.after(before, places)
    search.state = state
    search.digests = digests[np.isin(enrolled, search.numbers)]
    return search


def _warn(text: str) -> None:
    """Warn the caller of `open_search`."""
    warnings.warn(text, RuntimeWarning, stacklevel=5)
