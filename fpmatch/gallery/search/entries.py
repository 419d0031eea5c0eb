"""Searches in an open gallery: candidates with their entries, for one probe, several, or many."""

from __future__ import annotations

from collections import deque
from contextlib import closing
from dataclasses import replace
from itertools import count, islice
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import GalleryError, MatcherError
from fpmatch.gallery.index.prints.compare import packs
from fpmatch.gallery.search.consolidated import ConsolidatedFingers
from fpmatch.gallery.search.fused import identify_fused
from fpmatch.gallery.search.identification import RIVALS
from fpmatch.gallery.search.identify import ComparedProbe, compare_probe, find_candidates
from fpmatch.gallery.search.search import USUAL
from fpmatch.gallery.search.whole import ENTRY, piece_size
from fpmatch.matching.calibration import allowance
from fpmatch.matching.result import named, prepare_print
from fpmatch.matching.verify import DEFAULT_THRESHOLD
from fpmatch.prints.pair import FIRST_SHARE, other_resolutions

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.gallery.search.identification import FusedIdentification, Identification
    from fpmatch.gallery.search.search import Search, SearchOptions
    from fpmatch.prints.reading import GivenPrint
    from fpmatch.templates.minutiae import Template

MAX_BATCH: Final = 16  # probes that are searched for together
COMPARISONS_PER_TASK: Final = 20_000  # of a batch with a piece, about


def identify_entries(
    gallery: Gallery,
    search: Search,
    probe: Template,
    options: SearchOptions = USUAL,
    *,
    consolidated: ConsolidatedFingers | None = None,
    workers: int | None = None,
    **changes: Any,
) -> tuple[Identification, list[Entry]]:
    """Identify a probe as `identify` does; return the entries of the candidates, too.

    A large gallery is searched as it is now. An entry that has been removed or damaged since the
    search was opened is no candidate; the damaged ones, and those that the search has skipped, are
    in `gallery.damaged`. Raises the errors of `identify`, and GalleryError if the gallery cannot be
    read.
    """
    search = search.current(gallery)
    changes["consolidate"] = consolidated is not None
    given = replace(options, **changes)
    compared, given = compare_probe(search, probe, given, workers)
    return _with_entries(gallery, compared, given, consolidated)


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

    The outcomes are those of `identify_entries`, but the gallery is searched as it was when the
    search was opened. Probes are drawn as they are needed. An error of a plug-in has their `names`.
    """
    given = options.checked(search.matcher)
    search = search.for_loss(given.loss)
    consolidated = None
    if given.consolidate:
        consolidated = ConsolidatedFingers(gallery, search, given.calibration)
    size = batch_size(search)
    pending: deque[list[Any]] = deque()

    drawn, done = count(), 0

    def prepared(probe: Template | None) -> Any:
        number = next(drawn)
        try:
            return None if probe is None else prepare_print(search.matcher, probe, None)
        except MatcherError as error:
            raise named(error, *names[number : number + 1]) from error

    def batches() -> Iterator[list[Any]]:
        left = iter(probes)
        while batch := list(islice(left, size)):
            pending.append([prepared(probe) for probe in batch])
            yield [probe for probe in pending[-1] if probe is not None]

    with closing(search.compare(batches(), given, engine)) as compared:
        try:
            for listed in compared:
                each = iter(listed)
                for probe in pending.popleft():
                    if probe is None:
                        yield None
                    else:
                        one = ComparedProbe(search, probe, next(each))
                        yield _with_entries(gallery, one, given, consolidated)
                    done += 1
        except MatcherError as error:
            if not error.path.startswith(ENTRY):  # of one that is not compared yet
                raise
            raise named(error, *names[done : done + 1]) from error


def batch_size(search: Search) -> int:
    """Return how many probes are searched for together."""
    if search.in_stages:
        return MAX_BATCH
    if not packs(search.matcher):  # so that an error is of one probe
        return 1
    return min(MAX_BATCH, max(1, COMPARISONS_PER_TASK // piece_size(len(search))))


def _with_entries(
    gallery: Gallery,
    compared: ComparedProbe,
    options: SearchOptions,
    consolidated: ConsolidatedFingers | None,
) -> tuple[Identification, list[Entry]]:
    """Return the candidates for a probe that was compared, and their entries."""
    cached = _Entries(gallery, compared.search)
    listed = compared.listed
    likely = listed.compared[listed.most_similar(options.count + RIVALS + 1)]
    cached.read(compared.search.numbers[likely].tolist())

    def subject_of(number: int) -> str | None:
        entry = cached.entry(number)
        return None if entry is None else entry.label.subject

    while True:
        skipped = cached.skipped()
        result = find_candidates(
            compared,
            options,
            consolidated=consolidated,
            subject_of=subject_of if options.listed == "subjects" else None,
            skipped=skipped,
        )
        entries = [cached.entry(candidate.number) for candidate in result.candidates]
        if cached.skipped() == skipped:
            return result, [entry for entry in entries if entry is not None]


class _Entries:
    """Entries of an open gallery, and which of those that are searched cannot be read."""

    def __init__(self, gallery: Gallery, search: Search) -> None:
        self._gallery = gallery
        self._removed: set[int] = set()
        self._read: dict[int, Entry | None] = {}
        gallery.damaged |= search.damaged

    def read(self, numbers: Sequence[int]) -> None:
        """Read entries that are likely to be needed together; `entry` reads what is missing."""
        self._read |= {entry.id: entry for entry in self._gallery.entries_of(numbers)}

    def entry(self, number: int) -> Entry | None:
        """Return an entry, read once; None for one that was removed or is damaged."""
        if number not in self._read:
            self._read[number] = self._find(number)
        return self._read[number]

    def _find(self, number: int) -> Entry | None:
        try:
            return self._gallery.find_entry(number)
        except GalleryError as error:
            if error.code != "unknown":
                raise
            self._gallery.check_removed(number)
            self._removed.add(number)
            return None

    def skipped(self) -> set[int]:
        """Return the numbers of entries that were removed or are damaged."""
        return self._removed | self._gallery.damaged.keys()


class GallerySubjects:
    """The subjects of an open gallery; damaged entries are skipped."""

    def __init__(self, gallery: Gallery) -> None:
        self._gallery = gallery

    def __len__(self) -> int:
        return self._gallery.subjects()

    def fingers_of(self, numbers: Sequence[int]) -> dict[str, dict[str, list[int]]]:
        """Return the subjects of the entries of some numbers, with all their fingers."""
        subjects: dict[str, dict[str, list[int]]] = {}
        for entry in self._gallery.entries_of_subjects(numbers):
            fingers = subjects.setdefault(entry.label.subject, {})
            fingers.setdefault(entry.label.finger, []).append(entry.id)
        return subjects


def identify_entries_fused(
    gallery: Gallery, search: Search, probes: Sequence[Template], **options: Any
) -> tuple[FusedIdentification, dict[int, Entry]]:
    """Identify probes as `identify_fused` does; return the entries of the candidates by number.

    Damaged entries are treated, and errors raised, as by `identify_entries`.
    """
    search = search.current(gallery)
    cached = _Entries(gallery, search)
    while True:
        skipped = cached.skipped()
        result = identify_fused(
            search, probes, GallerySubjects(gallery), skipped=skipped, **options
        )
        numbers = {f.number for one in result.candidates for f in one.fingers}
        entries = {number: cached.entry(number) for number in sorted(numbers)}
        if cached.skipped() == skipped:
            return result, {n: entry for n, entry in entries.items() if entry is not None}
