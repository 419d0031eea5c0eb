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
    check_prefix,
)
from fpmatch.gallery.listing.print_file import resolution_notes
from fpmatch.gallery.listing.prints import (
    ExtractedPrint,
    extract_opened,
    extract_print,
    folder_reader,
)
from fpmatch.gallery.store.stored_template import is_unstated
from fpmatch.gallery.store.tables import ENROLLED
from fpmatch.gallery.tasks.consistency import check_added, find_added, find_copies
from fpmatch.printable import printable
from fpmatch.prints.reading import group_by_note

if TYPE_CHECKING:
    from collections.abc import (
        Callable,
        Container,
        Generator,
        Iterable,
        Iterator,
        Mapping,
        Sequence,
    )

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Label
    from fpmatch.gallery.listing.print_file import PrintFile
    from fpmatch.gallery.listing.prints import OpenedPrint

Item = TypeVar("Item")

PRINTS_PER_COMMIT: Final = 1000
SECONDS_PER_COMMIT: Final = 0.5  # after which fewer prints are committed
LAST_ENTRIES: Final = 1000  # among which are prints of folders from which more are enrolled
PRINTS_PER_QUERY: Final = 32  # that are looked up in the gallery at once


@dataclass(frozen=True, slots=True)
class Enrolment:
    """Numbers of prints enrolled now and before, the failures, and notes on prints.

    `added` has, of each subject that was enrolled before from other files, how many of the prints
    were added to it; `unmatched` are those of them that match nothing of their finger and are
    enrolled all the same. `copies` is the number of new prints that are the same as another one.
    """

    enrolled: int
    known: int
    failures: tuple[Failure, ...]
    noted: dict[str, tuple[Path, ...]] = field(default_factory=dict)
    added: dict[str, int] = field(default_factory=dict)
    unmatched: tuple[Failure, ...] = ()
    copies: int = 0


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
            copies=whole.copies + run.copies,
        )
    return whole


def enrol(
    gallery: Gallery,
    prints: Sequence[PrintFile],
    *,
    pattern: NamePattern | None = None,
    prefix: str = "",
    engine: Engine | None = None,
    extractor: Callable[..., ExtractedPrint] | None = None,
    opener: Callable[[PrintFile], OpenedPrint] | None = None,
    progress: Progress = no_progress,
    strict: bool = False,
) -> Enrolment:
    """Enrol prints in a gallery, those that are not in it.

    Every few prints are committed: a run that was killed continues when it is started again, and
    two runs may enrol at the same time. A print that cannot be enrolled does not stop the run; it
    is a failure, in the outcome and in the gallery, until it is enrolled.

    The `pattern` gets the labels of prints without one from their paths (default: FVC's names), and
    `prefix` stands before each subject. Templates are made on the `engine` (default: all cores) by
    the `extractor`, a function at the top of a module (default: `extract_print` with the reader of
    `folder_reader`). Workers must see the files, unless there is an `opener`: it reads each print
    here, an `open_print` with its reader, and the extractor, an `extract_opened`, is called with
    what it returns. `progress` is called with stage "enrol", and with "prepare"
    while a large gallery is indexed. If `strict`, impressions that do not match the others of their
    finger, or are probably two prints in one, are refused once all are extracted; see
    `fpmatch.gallery.tasks.consistency`.
    """
    check_prefix(prefix)
    run = _Run(gallery, pattern or NamePattern(), len(prints), progress, prefix)
    notes = resolution_notes([file.dpi for file in prints])
    run.on_dpi = {file.path: one for file, one in zip(prints, notes, strict=True)}
    gallery.check_keys()
    progress("enrol", 0, len(prints))
    with engine or processes() as place:
        new = run.new(prints)
        if opener is None:
            make = extractor
            if make is None:
                earlier = earlier_resolutions(gallery, prints)
                reader = folder_reader(prints, engine=place, earlier=earlier)
                make = partial(extract_print, reader=reader)
            attempted = attempt_each(place, make, new)
        else:
            attempted = _of_files(
                attempt_each(place, extractor or extract_opened, map(opener, new))
            )
        with closing(attempted) as attempts:
            for batch in _batches(attempts):
                run.commit(batch)
    run.commit([])
    added = find_added(gallery, run.subjects, run.contents.intersection)
    refused, unmatched = check_added(gallery, run.labels, added, strict=strict)
    copies = find_copies(gallery, run.labels, run.counts)
    noted = [(run.labels[entry.label], (f"the same print as {other}",)) for entry, other in copies]
    return Enrolment(
        len(run.labels) - len(refused),
        run.known,
        (*run.failures, *refused.values()),
        group_by_note([*run.noted, *noted]),
        count_added(added, refused),
        tuple(unmatched),
        len(copies),
    )


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


def count_added(added: Mapping[str, Sequence[int]], refused: Container[int]) -> dict[str, int]:
    """Return how many of the entries of each subject were not refused, where some were not."""
    kept = {name: sum(k not in refused for k in numbers) for name, numbers in added.items()}
    return {name: count for name, count in kept.items() if count}


def _of_files(
    attempts: Generator[tuple[OpenedPrint, Attempt[ExtractedPrint]], None, None],
) -> Generator[tuple[PrintFile, Attempt[ExtractedPrint]], None, None]:
    """Yield attempts at prints that were read here with their files."""
    with closing(attempts):
        for (file, _), attempt in attempts:
            yield file, attempt


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
    pattern: NamePattern
    total: int
    progress: Progress
    prefix: str
    known: int = 0
    labels: dict[Label, Path] = field(default_factory=dict)  # of the prints enrolled
    failures: list[Failure] = field(default_factory=list)
    unsaved: list[Failure] = field(default_factory=list)
    on_dpi: dict[Path, tuple[str, ...]] = field(default_factory=dict)
    noted: list[tuple[Path, tuple[str, ...]]] = field(default_factory=list)
    extracting: deque[EnrolmentRequest] = field(default_factory=deque)
    subjects: set[str] = field(default_factory=set)  # of the given prints that are in the gallery
    contents: set[bytes] = field(default_factory=set)
    counts: set[int] = field(default_factory=set)  # of minutiae of the prints enrolled

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
                    self._note_known(request.label, request.content)
                else:
                    self._fail(file, str(conflict))
            self._report_progress()

    def _note_known(self, label: Label, content: bytes) -> None:
        self.known += 1
        self.subjects.add(label.subject)
        self.contents.add(content)

    def _request(self, file: PrintFile) -> EnrolmentRequest | None:
        """Return what is known of a file; None, with a failure, where it cannot be enrolled."""
        label = file.label or self.pattern.label(file.path)
        if label is None:
            self._fail(file, f"its name does not fit the pattern {self.pattern.text}")
            return None
        label = label.prefixed(self.prefix)
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
        new, paths = [], []
        for file, attempt in attempts:
            request, made = self.extracting.popleft(), attempt.result
            if made is None:
                self._fail(file, attempt.reason)
                continue
            source = printable(file.path.absolute())
            new.append(NewEntry(request.label, source, request.content, made.template))
            paths.append(file.path)
            self.noted.append((file.path, (*made.all_notes, *self.on_dpi[file.path])))
        if new or self.unsaved:
            failures, self.unsaved = self.unsaved, []
            conflicts = self.gallery.add(new, failures)
            self.failures += failures
            for entry, path, conflict in zip(new, paths, conflicts, strict=True):
                if conflict is None:
                    self.labels[entry.label] = path
                    self.subjects.add(entry.label.subject)
                    self.contents.add(entry.content)
                    self.counts.add(len(entry.template.minutiae))
                elif conflict == ENROLLED:
                    self._note_known(entry.label, entry.content)
                else:
                    self.failures.append(Failure(entry.source, str(conflict)))
        self._report_progress()

    @property
    def done(self) -> int:
        """Number of prints whose outcome is known."""
        return len(self.labels) + self.known + len(self.failures) + len(self.unsaved)

    def _report_progress(self) -> None:
        self.progress("enrol", self.done, self.total)
