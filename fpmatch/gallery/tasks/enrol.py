"""Enrol prints: find the new ones, extract their templates, keep them."""

from __future__ import annotations

import hashlib
import time
from collections import Counter, deque
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from fpmatch.base.output import reason
from fpmatch.errors import GalleryError, without_path
from fpmatch.gallery.engine.engine import processes
from fpmatch.gallery.engine.workers import Attempt, Progress, attempt_each, no_progress
from fpmatch.gallery.listing.entry import (
    EnrolmentRequest,
    Failure,
    NamePattern,
    NewEntry,
)
from fpmatch.gallery.listing.print_file import resolution_notes
from fpmatch.gallery.listing.prints import ExtractedPrint, extract_print, folder_reader
from fpmatch.gallery.store.rows import pack_entry
from fpmatch.gallery.store.stored_template import is_unstated
from fpmatch.gallery.store.tables import ENROLLED
from fpmatch.gallery.tasks.screening import Screening
from fpmatch.printable import printable
from fpmatch.prints.reading import group_by_note

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.print_file import PrintFile

Item = TypeVar("Item")

PRINTS_PER_COMMIT: Final = 1000
SECONDS_PER_COMMIT: Final = 0.5  # after which fewer prints are committed
LAST_ENTRIES: Final = 1000  # among which are prints of folders from which more are enrolled
PRINTS_PER_QUERY: Final = 32  # that are looked up in the gallery at once


@dataclass(frozen=True, slots=True)
class Enrolment:
    """Numbers of prints enrolled now and before, the failures, and notes on prints.

    `added` has, of each subject that was enrolled before from other files, how many of the prints
    were added to it now; `unmatched` are those of them that match nothing of their finger and are
    enrolled all the same.
    """

    enrolled: int
    known: int
    failures: tuple[Failure, ...]
    noted: dict[str, tuple[Path, ...]] = field(default_factory=dict)
    added: dict[str, int] = field(default_factory=dict)
    unmatched: tuple[Failure, ...] = ()


def outcome_of(
    screening: Screening, noted: Mapping[str, tuple[Path, ...]] | None = None
) -> Enrolment:
    """Return what a run has enrolled, with notes on prints."""
    failures, unmatched = tuple(screening.failures), tuple(screening.unmatched)
    counts = screening.enrolled, screening.known
    return Enrolment(*counts, failures, dict(noted or {}), dict(screening.added), unmatched)


def joined(runs: Iterable[Enrolment]) -> Enrolment:
    """Return the sums of several runs."""
    whole = Enrolment(0, 0, ())
    for run in runs:
        whole = Enrolment(
            enrolled=whole.enrolled + run.enrolled,
            known=whole.known + run.known,
            failures=(*whole.failures, *run.failures),
            noted={**whole.noted, **run.noted},
            added=dict(Counter(whole.added) + Counter(run.added)),
            unmatched=(*whole.unmatched, *run.unmatched),
        )
    return whole


def enrol(
    gallery: Gallery,
    prints: Sequence[PrintFile],
    *,
    pattern: NamePattern | None = None,
    engine: Engine | None = None,
    extractor: Callable[..., ExtractedPrint] | None = None,
    progress: Progress = no_progress,
    strict: bool = False,
) -> Enrolment:
    """Enrol prints in a gallery, those that are not in it.

    Every few prints are committed: a run that was killed continues when it is started again, and
    two runs may enrol at the same time. A print that cannot be enrolled does not stop the run; it
    is a failure, in the outcome and in the gallery, until it is enrolled.

    The `pattern` gets the labels of prints without one from their paths (default: FVC's names).
    Templates are made on the `engine` (default: all cores), whose workers must see the files, by
    the `extractor`, a function at the top of a module (default: `extract_print` with the reader of
    `folder_reader`). `progress` is called with stage "enrol". If `strict`, prints are refused that
    do not match the others of their finger, or are probably two prints in one; see
    `fpmatch.gallery.tasks.screening.Screening`.
    """
    screening = Screening(gallery, strict=strict)
    run = _Run(gallery, screening, pattern or NamePattern(), len(prints), progress)
    notes = resolution_notes([file.dpi for file in prints])
    run.on_dpi = {file.path: one for file, one in zip(prints, notes, strict=True)}
    gallery.check_keys()
    progress("enrol", 0, len(prints))
    with engine or processes() as place:
        if extractor is None:
            earlier = earlier_resolutions(gallery, prints)
            reader = folder_reader(prints, engine=place, earlier=earlier)
            extractor = partial(extract_print, reader=reader)
        with closing(attempt_each(place, extractor, run.new(prints))) as attempts:
            for batch in _batches(attempts):
                run.commit(batch)
    run.commit([])
    return outcome_of(screening, group_by_note(run.noted))


def earlier_resolutions(gallery: Gallery, prints: Sequence[PrintFile]) -> dict[Path, float]:
    """Return the resolution of the last print from each folder of those that state none.

    Of the gallery, the `LAST_ENTRIES` are looked at; `folder_reader` takes what is returned.
    """
    folders = {printable(f.path.absolute().parent): f.path.parent for f in prints if f.dpi is None}
    if not folders or not len(gallery):
        return {}
    last = gallery.packed_templates(after=max(gallery.last_number() - LAST_ENTRIES, 0))
    unstated = [number for number, data in last if is_unstated(data)]
    entries = sorted(gallery.entries_of(unstated), key=lambda entry: entry.id)
    of_folder = {str(Path(entry.source).parent): entry.dpi for entry in entries}
    return {folders[name]: dpi for name, dpi in of_folder.items() if name in folders}


def _batches(items: Iterable[Item]) -> Iterator[list[Item]]:
    """Yield lists of items, as many as arrive within a time, and not too many."""
    batch: list[Item] = []
    begin = time.monotonic()
    for item in items:
        batch.append(item)
        if len(batch) == PRINTS_PER_COMMIT or time.monotonic() - begin >= SECONDS_PER_COMMIT:
            yield batch
            batch, begin = [], time.monotonic()
    if batch:
        yield batch


@dataclass(slots=True)
class _Run:
    """State of one run of `enrol`; `unsaved` are failures that are not in the gallery yet."""

    gallery: Gallery
    screening: Screening
    pattern: NamePattern
    total: int
    progress: Progress
    unsaved: list[Failure] = field(default_factory=list)
    on_dpi: dict[Path, tuple[str, ...]] = field(default_factory=dict)
    noted: list[tuple[Path, tuple[str, ...]]] = field(default_factory=list)
    extracting: deque[EnrolmentRequest] = field(default_factory=deque)

    def new(self, prints: Sequence[PrintFile]) -> Iterator[PrintFile]:
        """Yield the prints that are not enrolled and can be; their requests are `extracting`."""
        for k in range(0, len(prints), PRINTS_PER_QUERY):
            given = [(file, self._request(file)) for file in prints[k : k + PRINTS_PER_QUERY]]
            requested = [(file, request) for file, request in given if request is not None]
            conflicts = self.gallery.find_conflicts([request for _, request in requested])
            for (file, request), conflict in zip(requested, conflicts, strict=True):
                if conflict is None:
                    self.extracting.append(request)
                    yield file
                elif conflict == ENROLLED:
                    self.screening.note_known(request.content)
                else:
                    self._fail(file, str(conflict))
            self._report_progress()

    def _request(self, file: PrintFile) -> EnrolmentRequest | None:
        """Return what is known of a file; None, with a failure, where it cannot be enrolled."""
        label = file.label or self.pattern.label(file.path)
        if label is None:
            self._fail(file, f"its name does not fit the pattern {self.pattern.text}")
            return None
        try:
            content = hashlib.sha256(file.path.read_bytes()).digest()
            return EnrolmentRequest(label, content, file.dpi)
        except OSError as error:
            self._fail(file, reason(error))
        except GalleryError as error:
            self._fail(file, str(error))
        return None

    def _fail(self, file: PrintFile, why: str) -> None:
        source = printable(file.path.absolute())
        self.unsaved.append(Failure(source, without_path(why, file.path)))

    def commit(self, attempts: Sequence[tuple[PrintFile, Attempt[ExtractedPrint]]]) -> None:
        """Add extracted prints, and what has failed since, to the gallery."""
        new = []
        for file, attempt in attempts:
            request, made = self.extracting.popleft(), attempt.result
            if made is None:
                self._fail(file, attempt.reason)
                continue
            source = printable(file.path.absolute())
            entry = NewEntry(request.label, source, request.content, made.template)
            new.append(pack_entry(entry))
            self.noted.append((file.path, (*made.all_notes, *self.on_dpi[file.path])))
        failures, self.unsaved = self.unsaved, []
        self.screening.add(new, failures)
        self._report_progress()

    @property
    def done(self) -> int:
        """Number of prints whose outcome is known."""
        counted = self.screening
        return counted.enrolled + counted.known + len(counted.failures) + len(self.unsaved)

    def _report_progress(self) -> None:
        self.progress("enrol", self.done, self.total)
