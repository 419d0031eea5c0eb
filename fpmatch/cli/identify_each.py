"""The probes of `fpmatch identify`, searched for one after the other."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fpmatch.evaluation.batch.sources import FolderSource
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.identify import Identification
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.gallery.listing.print_file import PrintFile
    from fpmatch.gallery.listing.prints import Reader
    from fpmatch.gallery.prepared_search import Search


@dataclass(frozen=True, slots=True)
class Found:
    """Outcome for one probe: entries are those of the candidates."""

    probe: Path
    result: Identification
    entries: Sequence[Entry]
    seconds: float
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the object that ``--json`` prints."""
        return {
            "probe": str(self.probe),
            "seconds": round(self.seconds, 4),
            "passed_on": list(self.result.passed_on),
            "candidates": self.result.candidate_dicts(self.entries),
        }


def identify_near(
    gallery: Gallery, search: Search, files: Sequence[PrintFile], reader: Reader, **options: Any
) -> Iterator[Found | FpmatchError]:
    """Yield the outcome for each probe, or why it cannot be read."""
    from fpmatch.gallery.candidates import identify_entries
    from fpmatch.gallery.listing.prints import extract_print

    for file in files:
        try:
            probe = extract_print(file, reader=reader)
        except FpmatchError as error:
            yield error
            continue
        start = time.perf_counter()
        result, entries = identify_entries(gallery, search, probe.template, **options)
        seconds = time.perf_counter() - start
        numbers = [candidate.number for candidate in result.candidates]
        gallery.record("identify", probe=file.path, candidates=numbers)
        yield Found(file.path, result, entries, seconds, probe.all_notes)


def identify_far(
    gallery: Gallery, search: Search, probes: FolderSource, engine: Engine, **options: Any
) -> Iterator[Found | FpmatchError]:
    """Yield the same outcomes as `identify_near`, of a cluster; seconds are those of waiting."""
    from fpmatch.evaluation.batch.candidates import SearchOptions, identify_each
    from fpmatch.gallery.search_pieces import hold_search

    chosen = SearchOptions(**options)
    with engine, hold_search(engine, search, chosen.candidate_list) as held:
        start = time.perf_counter()
        for one in identify_each(gallery, held, probes, chosen, engine):
            path, seconds = Path(probes.paths[one.number]), time.perf_counter() - start
            if one.result is None:
                yield FpmatchError(one.probe.reason, path=path)
            else:
                yield Found(path, one.result, one.entries, seconds, one.probe.all_notes)
            start = time.perf_counter()
