"""The search of a gallery: its prints as a matcher prepares them, or their index."""

from __future__ import annotations

import os
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from fpmatch.base.plugins import call_matcher, named
from fpmatch.base.threads import available_cores, chunks_of
from fpmatch.errors import FpmatchError, MatcherError, number_text
from fpmatch.gallery.encryption.keys import KEY_VARIABLE
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.engine.workers import no_progress
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index.compare import PreparedPrints, packs, similarities
from fpmatch.gallery.store.stored_template import unpack_template
from fpmatch.matching.calibration import MAX_SCORE, load_calibration
from fpmatch.matching.constants import COMPILED
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.result import compare_prepared

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.encryption.keys import KeyRing
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.index.follow import GalleryIndex
    from fpmatch.gallery.search.identification import Candidate, SubjectCandidate
    from fpmatch.gallery.store.gallery import Gallery
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher

EXHAUSTIVE_UP_TO: Final = 2_000  # prints, which are all compared
COMPARED_AT_ONCE: Final = 64  # prints that one thread compares before it takes others
ENTRY: Final = "entry "  # before its number, in errors

ListedAs = Literal["subjects", "fingers"]
EFFORTS: Final = (1, 2, 4)


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchOptions:
    """State what a search compares and lists.

    Parameters
    ----------
    count : int
        Largest number of candidates.
    threshold : float
        Smallest score of a candidate.
    by_chance : float
        Number of others that are expected to score as high by chance, under which a candidate is
        listed: of ``1 / by_chance`` searches without a mate, about one lists any.
    listed : "subjects" or "fingers"
        What is a candidate: each subject once, by its best finger; or each finger, by the score of
        its impressions together (see `fpmatch.gallery.fingers.finger`).
    calibration : Calibration, optional
        Turns similarities into scores (default: that of the package).
    transforms : bool
        Whether candidates have their transforms, too.
    effort : int
        1, 2 or 4: how many prints of a large gallery are compared, and so how few mates are lost
        (see docs/explanation/searching.md).
    """

    count: int = 10
    threshold: float = 0.0
    by_chance: float = inf
    listed: ListedAs = "fingers"
    calibration: Calibration | None = None
    transforms: bool = False
    effort: int = 1

    def checked(self, matcher: Matcher) -> SearchOptions:
        """Return the options of a search with a matcher, with its calibration.

        Raises MatcherError if some are out of range, or it has none.
        """
        if self.count < 1:
            raise MatcherError(f"the number of candidates must be at least 1, not {self.count}")
        if not 0 <= self.threshold <= MAX_SCORE:
            raise MatcherError(
                f"a threshold is between 0 and {MAX_SCORE:g}, not {number_text(self.threshold)}"
            )
        if not self.by_chance > 0:
            raise MatcherError(f"the number by chance is over 0, not {number_text(self.by_chance)}")
        if self.effort not in EFFORTS:
            raise MatcherError(f"an effort is 1, 2 or 4, not {number_text(self.effort)}")
        return replace(self, calibration=self.calibration or load_calibration(matcher.name))

    def allow(self, candidate: Candidate | SubjectCandidate) -> bool:
        """Return whether a candidate is listed."""
        return candidate.score >= self.threshold and candidate.expected_false < self.by_chance


USUAL: Final = SearchOptions()


Similarity = dict[int, float]
"""Of the prints that were compared with a probe, by number, ascending."""


class Search:
    """Search an open gallery.

    More than `EXHAUSTIVE_UP_TO` prints are indexed, for the default matcher, and few of them are
    compared with a probe: the search is `preselected`. Else all are, prepared in memory. `numbers`
    has the numbers of the entries of the prints, ascending; entries that are `damaged` are not
    among them. `content` is the `content_hash` of the gallery when it was read. In another process
    the gallery is opened again, by its name.

    The `engine` prepares prints of an index (default: all cores); `progress` is called with stage
    "prepare" and numbers of prints, and `note` with a line on files that cannot be used, and are
    built again (default: a RuntimeWarning). Raises GalleryError if the gallery cannot be read;
    MatcherError if the matcher is unknown.
    """

    def __init__(
        self,
        gallery: Gallery,
        matcher: str | Matcher = DEFAULT_MATCHER,
        *,
        engine: Engine | None = None,
        progress: Progress = no_progress,
        note: Callable[[str], object] | None = None,
    ) -> None:
        self.matcher = get_matcher(matcher) if isinstance(matcher, str) else matcher
        self.gallery = gallery
        self.numbers = np.empty(0, np.int64)
        self.damaged: Collection[int] = ()
        self.preselected = False
        self.content = ""
        self._engine, self._progress, self._note = engine, progress, note or _warn
        self._fingers: int | None = None
        self._index: GalleryIndex | None = None
        self._prepared: dict[int, tuple[int, Any]] = {}  # digests and prints, by number
        self._together = PreparedPrints([])  # the same prints, where the matcher packs them
        self.follow()

    def follow(self, gallery: Gallery | None = None) -> None:
        """Search what is in the gallery now, which may have been opened again.

        If it has not changed, that takes one short query. Raises GalleryError where the gallery
        cannot be read.
        """
        gallery = self.gallery if gallery is None else gallery
        state = gallery.content_hash()
        if state != self.content:
            gallery.check_keys()
            own = COMPILED and packs(self.matcher) and self.matcher.name == DEFAULT_MATCHER
            self.preselected = own and len(gallery) > EXHAUSTIVE_UP_TO
            if self.preselected:
                self._follow_index(gallery)
            else:
                self._prepare(gallery)
            self.content, self._fingers = state, None
        self.gallery = gallery

    def __len__(self) -> int:
        return len(self.numbers)

    def __reduce__(self) -> tuple[Any, ...]:
        # that of this process: the environment of workers may be of before
        key = self.gallery.key or os.environ.get(KEY_VARIABLE)
        return _open_again, (self.gallery.where, key, self.matcher)

    def fingers(self) -> int:
        """Return how many fingers are enrolled."""
        if self._fingers is None:
            self._fingers = self.gallery.count_fingers()
        return self._fingers

    def threads(self, workers: int | None = None) -> ThreadPoolExecutor:
        """Return threads to compare prints in: so many, by default one a core."""
        return ThreadPoolExecutor(available_cores() if workers is None else workers)

    def compare(
        self, probe: Any, options: SearchOptions, threads: ThreadPoolExecutor
    ) -> tuple[Similarity, tuple[int, ...]]:
        """Compare a probe, which the matcher prepared, with the prints that may be its mates.

        Also return how many prints each stage of a pre-selection has passed on.
        """
        if self._index is None or not self.preselected:
            return self.compare_some(probe, self.numbers.tolist(), threads), ()
        from fpmatch.gallery.search.shortlist import shortlist  # noqa: PLC0415 (imports an index)

        chosen, passed_on = shortlist(self._index, probe, options.effort, options.count, threads)
        return self.compare_some(probe, chosen, threads), passed_on

    def compare_some(
        self, probe: Any, numbers: Sequence[int], threads: ThreadPoolExecutor
    ) -> Similarity:
        """Compare a probe with the prints of some entries; those that are gone are left out."""
        if self.preselected:
            rows = sorted(self.gallery.packed_templates(of=numbers))
            there, work = [n for n, _ in rows], partial(_compare_stored, self.matcher, probe)
            chunks: Any = chunks_of(rows, COMPARED_AT_ONCE)
        else:
            places = np.flatnonzero(np.isin(self.numbers, numbers)).tolist()
            there = self.numbers[places].tolist()
            if not packs(self.matcher):
                return self._compare_one_by_one(probe, there)
            work = partial(_compare_prepared, self.matcher, self._together, probe)
            chunks = chunks_of(places, COMPARED_AT_ONCE)
        parts = threads.map(work, chunks)
        return dict(zip(there, np.concatenate([np.empty(0), *parts]).tolist(), strict=True))

    def print_of(self, number: int) -> Any:
        """Return a print as the matcher prepares it; None where it is gone."""
        if not self.preselected:
            return self._prepared.get(number, (0, None))[1]
        template = self.gallery.find_template(number)
        return None if template is None else self.matcher.prepare(template)

    def _follow_index(self, gallery: Gallery) -> None:
        """Let the index have all prints; none is prepared in memory."""
        if self._index is None:
            from fpmatch.gallery.index.follow import GalleryIndex  # noqa: PLC0415 (imports an index)

            how: dict[str, Any] = {"engine": self._engine, "progress": self._progress}
            self._index = GalleryIndex(self.matcher, note=self._note, **how)
        self._index.follow(gallery)
        self._prepared, self._together = {}, PreparedPrints([])
        self.numbers, self.damaged = self._index.numbers, self._index.damaged

    def _prepare(self, gallery: Gallery) -> None:
        """Prepare all prints, but those that are prepared."""
        digests = dict(zip(*(column.tolist() for column in gallery.digests()), strict=True))
        prepared = {n: one for n, one in self._prepared.items() if digests.get(n) == one[0]}
        new = digests.keys() - prepared.keys()
        done = 0
        self._progress("prepare", done, len(new))
        for number, data in gallery.packed_templates(of=new if prepared else None):
            if number not in digests:  # enrolled meanwhile
                continue
            try:
                print_ = call_matcher(self.matcher, "prepare", unpack_template(data))
                prepared[number] = digests[number], print_
            except MatcherError as error:
                raise named(error, f"{ENTRY}{number}") from error
            except FpmatchError as error:
                gallery.damaged[number] = str(error)
            done += 1
            self._progress("prepare", done, len(new))
        self._prepared = dict(sorted(prepared.items()))
        self.numbers, self.damaged = np.array([*self._prepared], np.int64), {*gallery.damaged}
        if packs(self.matcher):
            self._together = PreparedPrints(print_ for _, print_ in self._prepared.values())

    def _compare_one_by_one(self, probe: Any, numbers: Sequence[int]) -> Similarity:
        """Compare a probe with prepared prints by a matcher that may be a plug-in."""
        similarity: Similarity = {}
        number = 0
        try:
            for number in numbers:
                compared = compare_prepared(self.matcher, probe, self.print_of(number))
                similarity[number] = compared.similarity
        except MatcherError as error:
            raise named(error, f"{ENTRY}{number}") from error
        return similarity


def _open_again(where: str, key: KeyRing | str | None, matcher: Matcher) -> Search:
    return Search(open_gallery(where, key=key), matcher, engine=serial())


def _warn(text: str) -> None:
    """Warn the caller of `Search`."""
    warnings.warn(text, RuntimeWarning, stacklevel=8)


def _compare_stored(
    matcher: Matcher, probe: Any, rows: Sequence[tuple[int, bytes]]
) -> NDArray[np.float64]:
    """Return the similarities of a probe to packed templates."""
    prints = PreparedPrints(matcher.prepare(unpack_template(data)) for _, data in rows)
    return similarities(matcher, probe, prints)


def _compare_prepared(
    matcher: Matcher, prints: PreparedPrints, probe: Any, places: Sequence[int]
) -> NDArray[np.float64]:
    """Return the similarities of a probe to some of many prepared prints."""
    return similarities(matcher, probe, prints.take(places))
