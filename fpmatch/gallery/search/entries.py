"""Searches in an open gallery: candidates with their entries, for one probe, several, or many."""

from __future__ import annotations

import os
import pickle
from contextlib import closing
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from fpmatch.errors import MatcherError
from fpmatch.gallery.encryption.keys import KEY_VARIABLE
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.search.fused import identify_fused
from fpmatch.gallery.search.identify import compare_probe, count_fingers, find_candidates
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.search.search import USUAL
from fpmatch.matching.calibration import allowance
from fpmatch.matching.decision import DEFAULT_THRESHOLD
from fpmatch.matching.result import named
from fpmatch.prints.pair import FIRST_SHARE, other_resolutions

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Sequence

    from fpmatch.gallery.encryption.keys import KeyRing
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.gallery.search.identification import FusedIdentification, Identification
    from fpmatch.gallery.search.search import Search, SearchOptions
    from fpmatch.matching.result import Matcher
    from fpmatch.prints.reading import GivenPrint
    from fpmatch.templates.minutiae import Template

BATCH: Final = 16  # probes that are searched for together


def identify_entries(
    gallery: Gallery,
    search: Search,
    probe: Template,
    options: SearchOptions = USUAL,
    *,
    workers: int | None = None,
    **changes: Any,
) -> tuple[Identification, list[Entry]]:
    """Identify a probe as `identify` does; return the entries of the candidates, too.

    The gallery is searched as it is now. An entry that has been removed or damaged since is no
    candidate; the damaged ones are in `gallery.damaged`. Raises the errors of `identify`, and
    GalleryError if the gallery cannot be read.
    """
    search = open_search(gallery, search.matcher, before=search)
    given = replace(options, **changes).checked(search.matcher)
    one = compare_probe(search, probe, given, workers=workers)
    removed = set[int]()
    while True:
        skipped = removed | gallery.damaged.keys()
        result = find_candidates(one, given, count_fingers(one, skipped=skipped), skipped=skipped)
        entries = {entry.id: entry for entry in gallery.entries_of(result.numbers)}
        if entries.keys() == {*result.numbers}:
            return result, [entries[number] for number in result.numbers]
        removed |= {*result.numbers} - entries.keys()


def identify_given(
    gallery: Gallery,
    search: Search,
    probe: GivenPrint,
    options: SearchOptions = USUAL,
    **how: Any,
) -> tuple[GivenPrint, Identification, list[Entry]]:
    """Identify an image as `identify_entries` does, also at other resolutions if it states none.

    Where no candidate matches, those are tried that its ridges allow, unless prints that came with
    it decided. As with `fpmatch.prints.pair.verify_given`, each try has a share of the false match
    rate, the first one too, which lowers its scores. The print is returned as it was at the
    resolution of the candidates.
    """
    result, entries = identify_entries(gallery, search, probe.template, options, **how)
    others = other_resolutions(probe)
    if not others:
        return probe, result, entries
    changes = {name: value for name, value in how.items() if hasattr(options, name)}
    allow = replace(options, **changes).allow
    lowered = result.lowered(allowance(FIRST_SHARE), allow)
    best = probe, lowered, [one for one in entries if one.id in lowered.numbers]
    if _best(lowered):
        return best
    for other in map(probe.at, others):
        result, entries = identify_entries(gallery, search, other.template, options, **how)
        lowered = result.lowered(allowance(1.0 - FIRST_SHARE, len(others)), allow)
        if _best(lowered) > _best(best[1]):
            best = other, lowered, [one for one in entries if one.id in lowered.numbers]
    return best


def _best(result: Identification) -> float:
    """Return the score of the first candidate where it is a match, else 0."""
    score = max((candidate.score for candidate in result.candidates), default=0.0)
    return score if score >= DEFAULT_THRESHOLD else 0.0


def identify_each(
    gallery: Gallery,
    search: Search,
    probes: Iterable[Template | None],
    options: SearchOptions,
    engine: Engine,
    names: Sequence[str] = (),
) -> Generator[tuple[Identification, list[Entry]] | None, None, None]:
    """Identify many probes with the workers of an engine, which is entered; None for no probe.

    The outcomes are as `identify_entries` returns them. Each worker opens the gallery: it must see
    its file or its server, and have its keys. Probes are drawn as they are needed. An error of a
    plug-in has their `names`.
    """
    place = _Place(gallery, search, options)
    try:
        pickle.dumps(search.matcher)
    except (AttributeError, TypeError, pickle.PicklingError):
        engine = serial()

    def batches() -> Iterator[_Batch]:
        left, first = iter(probes), 0
        while batch := list(islice(left, BATCH)):
            yield _Batch(batch, names[first : first + BATCH])
            first += BATCH

    with closing(engine.map(_identify_batch, place, batches())) as results:
        for outcomes, damaged in results:
            gallery.damaged |= damaged
            yield from outcomes


class _Batch(NamedTuple):
    probes: Sequence[Template | None]
    names: Sequence[str]


class _Place:
    """Where a worker searches: a gallery that it opens, unless it is the process that sent it."""

    def __init__(self, gallery: Gallery, search: Search, options: SearchOptions) -> None:
        self.gallery, self.search, self.options = gallery, search, options

    def __reduce__(self) -> tuple[Any, ...]:
        gallery = self.gallery
        # that of this process: the environment of workers may be of before
        key = gallery.key or os.environ.get(KEY_VARIABLE)
        return _open_place, (gallery.where, key, self.search.matcher, self.options)


def _open_place(
    where: str, key: KeyRing | str | None, matcher: Matcher, options: SearchOptions
) -> _Place:
    gallery = open_gallery(where, key=key)
    return _Place(gallery, open_search(gallery, matcher, engine=serial()), options)


def _identify_batch(
    place: _Place, batch: _Batch
) -> tuple[list[tuple[Identification, list[Entry]] | None], dict[int, str]]:
    """Return the outcomes for some probes, and the entries that are damaged."""
    gallery, outcomes = place.gallery, list[Any]()
    for k, probe in enumerate(batch.probes):
        try:
            outcome = None
            if probe is not None:
                outcome = identify_entries(gallery, place.search, probe, place.options, workers=1)
            outcomes.append(outcome)
        except MatcherError as error:
            raise named(error, *batch.names[k : k + 1]) from error
    return outcomes, dict(gallery.damaged)


def identify_entries_fused(
    gallery: Gallery, search: Search, probes: Sequence[Template], **options: Any
) -> tuple[FusedIdentification, dict[int, Entry]]:
    """Identify probes as `identify_fused` does; return the entries of the candidates by number.

    Damaged entries are treated, and errors raised, as by `identify_entries`.
    """
    search = open_search(gallery, search.matcher, before=search)
    removed = set[int]()
    while True:
        skipped = removed | gallery.damaged.keys()
        result = identify_fused(search, probes, skipped=skipped, **options)
        numbers = {*result.numbers}
        entries = {entry.id: entry for entry in gallery.entries_of(sorted(numbers))}
        if entries.keys() == numbers:
            return result, entries
        removed |= numbers - entries.keys()
