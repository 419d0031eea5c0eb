"""Enrol prints: find the new ones, extract their templates, compare them with their fingers."""

from __future__ import annotations

import hashlib
import time
from collections import Counter, deque
from contextlib import closing
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import sqlalchemy as sa

from fpmatch.base.output import reason
from fpmatch.errors import GalleryError, TemplateError, without_path
from fpmatch.gallery.engine.engine import make_engine
from fpmatch.gallery.engine.workers import Progress, attempt_each, no_progress
from fpmatch.gallery.listing.entry import EnrolmentRequest, Failure, NamePattern
from fpmatch.gallery.listing.prints import ExtractedPrint, extract_print, folder_reader
from fpmatch.gallery.listing.two_prints import find_doubts
from fpmatch.gallery.store.audit import ranges
from fpmatch.gallery.store.rows import new_entry
from fpmatch.gallery.store.stored_template import is_unstated, unpack_template
from fpmatch.gallery.store.tables import ENROLLED, ENTRY
from fpmatch.gallery.tasks.consistency import find_unmatched
from fpmatch.printable import printable
from fpmatch.prints.reading import group_by_note

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Label, NewEntry, PrintFile
    from fpmatch.templates.minutiae import Template

    Requested = tuple[PrintFile, EnrolmentRequest]

Item = TypeVar("Item")

PRINTS_PER_COMMIT: Final = 1000
SECONDS_PER_COMMIT: Final = 0.5  # after which fewer prints are committed
LAST_ENTRIES: Final = 1000  # among which are prints of folders from which more are enrolled
PRINTS_PER_QUERY: Final = 32  # that are looked up in the gallery at once


class Enrolment:
    """Enrol the prints of a run, and count what becomes of them.

    Prints of subjects that existed before are compared with their fingers first, and if `strict`
    all are; those are refused then that do not match, and those that are probably two prints in one
    or of no finger.
    """

    def __init__(self, gallery: Gallery, *, strict: bool = False) -> None:
        self._gallery, self._strict = gallery, strict
        self._given: set[bytes] = set()  # contents of the prints of this run
        self._doubted: set[Label] = set()  # of its prints that do not match their finger
        self._unsaved: list[Failure] = []  # which the gallery does not contain yet
        self.enrolled, self.known = 0, 0
        """Numbers of prints enrolled now and before."""
        self.failures: list[Failure] = []
        """Prints that could not be enrolled, with reasons."""
        self.noted: dict[str, tuple[Path, ...]] = {}
        """Notes, and the prints that each is about."""
        self.added: Counter[str] = Counter()
        """Numbers of prints that were added to subjects which other files enrolled before."""
        self.unmatched: list[Failure] = []
        """Prints that were enrolled although they do not match their finger."""

    def __repr__(self) -> str:
        counts = f"enrolled={self.enrolled}, known={self.known}, failures={self.failures}"
        return f"Enrolment({counts}, added={dict(self.added)}, unmatched={self.unmatched})"

    @property
    def counted(self) -> int:
        """The number of prints whose outcome is known."""
        return self.enrolled + self.known + len(self.failures)

    def fail(self, source: str, why: str) -> None:
        """Count a print that cannot be enrolled; `add` records it in the gallery."""
        self.failures.append(Failure(source, why))
        self._unsaved.append(self.failures[-1])

    def note_known(self, content: bytes) -> None:
        """Count a print that was enrolled before, by the SHA-256 of its file."""
        self.known += 1
        self._given.add(content)

    def add(self, new: Sequence[NewEntry]) -> None:
        """Enrol prints, and record the failures until now, in one transaction."""
        accepted = self._screen(new)
        failed, self._unsaved = self._unsaved, []
        if not (accepted or failed):
            return
        conflicts = self._gallery.add([entry for entry, *_ in accepted], failed)
        for (entry, existed, unmatched), conflict in zip(accepted, conflicts, strict=True):
            if conflict is None:
                self.enrolled += 1
                self.added.update([entry.label.subject] if existed else [])
                self.unmatched += [Failure(entry.source, unmatched)] if unmatched else []
            elif conflict == ENROLLED:
                self.note_known(entry.content)
            else:
                self.failures.append(Failure(entry.source, str(conflict)))

    def _screen(self, new: Sequence[NewEntry]) -> list[tuple[NewEntry, bool, str | None]]:
        """Return the new prints that are not refused, in the order in which they are enrolled.

        With each is stated if its subject was enrolled before from files that were not given, and
        why it does not match its finger.
        """
        self._given.update(entry.content for entry in new)
        enrolled = self._gallery.entries_by_subject({entry.label.subject for entry in new})
        earlier: dict[Label, list[tuple[Label, Template]]] = {}
        accepted: list[tuple[NewEntry, bool, str | None]] = []
        for entry in new:
            existing = enrolled.get(entry.label.subject, [])
            existed = any(other.content not in self._given for other in existing)
            known = any(other.content == entry.content for other in existing)
            if known or not (existed or self._strict):
                accepted.append((entry, False, None))
                continue
            template = unpack_template(entry.template)
            existing = [other for other in existing if other.label not in self._doubted]
            others = earlier.setdefault(entry.label.of_finger, [])
            unmatched = find_unmatched(self._gallery, entry.label, template, existing, others)
            refused = ("; ".join(find_doubts(template)) or unmatched) if self._strict else None
            if unmatched:
                self._doubted.add(entry.label)
            elif not refused:
                others.append((entry.label, template))
            if refused:
                self.fail(entry.source, f"refused: {refused}")
            else:
                accepted.append((entry, existed, unmatched))
        return accepted


def enrol(
    gallery: Gallery,
    prints: Sequence[PrintFile],
    *,
    pattern: NamePattern | None = None,
    engine: Engine | None = None,
    extractor: Callable[..., ExtractedPrint] | None = None,
    progress: Progress = no_progress,
    strict: bool = False,
    into: Enrolment | None = None,
    min_quality: int = 0,
    **reading: Any,
) -> Enrolment:
    """Enrol prints in a gallery, those that are not in it.

    Every few prints are committed: a run that was killed continues when it is started again, and
    two runs may enrol at the same time. A print that cannot be enrolled does not stop the run; it
    is a failure, in the outcome and in the gallery, until it is enrolled.

    The `pattern` gets the labels of prints without one from their paths (default: FVC's names).
    Templates are made on the `engine` (default: all cores), whose workers must see the files, by
    the `extractor`, a function at the top of a module (default: `extract_print` with `min_quality`
    and the reader that `folder_reader` makes of the options `reading`). `progress` is called with
    stage "enrol". If `strict`, prints are refused that do not match the others of their finger, or
    are probably two prints in one. The prints are counted `into` a run that was begun, or a new
    one, which is returned.
    """
    done = into or Enrolment(gallery, strict=strict)
    before, pattern = done.counted, pattern or NamePattern()
    noted: list[tuple[Path, tuple[str, ...]]] = []

    def report() -> None:
        progress("enrol", done.counted - before, len(prints))

    gallery.check_keys()
    report()
    with engine or make_engine() as place:
        if extractor is None:
            earlier = earlier_resolutions(gallery, prints)
            reader = folder_reader(prints, engine=place, earlier=earlier, **reading)
            extractor = partial(extract_print, reader=reader, min_quality=min_quality)
        requests = deque[EnrolmentRequest]()  # which stay here: workers need no database library

        def files() -> Iterator[PrintFile]:
            for file, request in _requested(gallery, prints, pattern, done, report):
                requests.append(request)
                yield file

        with closing(attempt_each(place, extractor, files())) as attempts:
            for batch in _batches(attempts):
                new = []
                for file, attempt in batch:
                    request, made, source = requests.popleft(), attempt.result, _source(file)
                    if made is None:
                        done.fail(source, without_path(attempt.reason, file.path))
                        continue
                    noted.append((file.path, made.all_notes))
                    about = request.label, source, request.content
                    try:
                        new.append(new_entry(*about, made.template))
                    except TemplateError as error:
                        done.fail(source, str(error))
                done.add(new)
                report()
    done.add([])  # what has failed since
    done.noted |= group_by_note(noted)
    return done


def enrol_gallery(
    gallery: Gallery,
    source: Gallery,
    *,
    progress: Progress = no_progress,
    strict: bool = False,
    into: Enrolment | None = None,
) -> Enrolment:
    """Enrol the entries of another gallery that are not in this one.

    Templates are checked and copied as they are, with their labels, sources and SHA-256; entries
    get new numbers, in the same order. A thousand are committed at once: a run that was killed
    continues when it is started again. A failure is a damaged entry, or one whose label or picture
    is enrolled otherwise. Either gallery may be encrypted. `progress`, `strict` and `into` are as
    for `enrol`; GalleryError is raised if both are the same, too.
    """
    one, other = gallery.file, source.file
    if gallery.name == source.name or (one and other and one.samefile(other)):
        raise gallery.error("its entries cannot be enrolled in itself", "same gallery")
    gallery.check_keys()
    source.check_keys()
    earlier, total = dict(source.damaged), len(source)
    run, done = into or Enrolment(gallery, strict=strict), 0
    entries = source.packed_entries()
    progress("enrol", 0, total)
    while batch := list(islice(entries, PRINTS_PER_COMMIT)):
        source.record("export", entries=ranges(number for number, _ in batch))
        run.add([entry for _, entry in batch])
        done += len(batch)
        progress("enrol", min(done, total), total)
    for number, why in sorted(source.damaged.items() - earlier.items()):
        run.fail(f"{source.name}: entry {number}", f"damaged: {why}")
    run.add([])
    return run


def earlier_resolutions(gallery: Gallery, prints: Sequence[PrintFile]) -> dict[Path, float]:
    """Return the resolution of the last print from each folder of those that state none.

    Of the gallery, the `LAST_ENTRIES` are looked at; `folder_reader` takes what is returned.
    """
    folders = {printable(f.path.absolute().parent): f.path.parent for f in prints if f.dpi is None}
    if not folders:
        return {}
    last = gallery.count(sa.select(sa.func.max(ENTRY.c.id)))
    numbers = range(max(last - LAST_ENTRIES, 0) + 1, last + 1)
    templates = gallery.packed_templates(of=numbers)
    unstated = [number for number, data in templates if is_unstated(data)]
    of_folder = {str(Path(one.source).parent): one.dpi for one in gallery.entries_of(unstated)}
    return {folders[name]: dpi for name, dpi in of_folder.items() if name in folders}


def _requested(
    gallery: Gallery,
    prints: Sequence[PrintFile],
    pattern: NamePattern,
    done: Enrolment,
    report: Callable[[], None],
) -> Iterator[Requested]:
    """Yield the prints that are not enrolled and can be; count the others."""
    for k in range(0, len(prints), PRINTS_PER_QUERY):
        given: list[Requested] = []
        for file in prints[k : k + PRINTS_PER_QUERY]:
            try:
                given.append((file, _request(file, pattern)))
            except OSError as error:
                done.fail(_source(file), reason(error))
            except GalleryError as error:
                done.fail(_source(file), without_path(str(error), file.path))
        conflicts = gallery.find_conflicts([request for _, request in given])
        for (file, request), conflict in zip(given, conflicts, strict=True):
            if conflict is None:
                yield file, request
            elif conflict == ENROLLED:
                done.note_known(request.content)
            else:
                done.fail(_source(file), str(conflict))
        report()


def _request(file: PrintFile, pattern: NamePattern) -> EnrolmentRequest:
    """Return what is known of a file; GalleryError where it has no label that may be enrolled."""
    label = file.label or pattern.label(file.path)
    if label is None:
        raise GalleryError(f"its name does not fit the pattern {pattern.text}")
    return EnrolmentRequest(label, hashlib.sha256(file.path.read_bytes()).digest(), file.dpi)


def _source(file: PrintFile) -> str:
    return printable(file.path.absolute())


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
