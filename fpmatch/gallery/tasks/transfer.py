"""Enrol the entries of another gallery: the file format of templates by the million."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Final

from fpmatch.errors import GalleryError
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.listing.entry import Failure, PackedEntry, check_prefix
from fpmatch.gallery.store.audit import ranges
from fpmatch.gallery.store.tables import ENROLLED
from fpmatch.gallery.tasks.consistency import check_added, find_added
from fpmatch.gallery.tasks.enrol import Enrolment, count_added

if TYPE_CHECKING:
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Label

ENTRIES_PER_COMMIT: Final = 1000


def enrol_gallery(
    gallery: Gallery,
    source: Gallery,
    *,
    prefix: str = "",
    progress: Progress = no_progress,
    strict: bool = False,
) -> Enrolment:
    """Enrol the entries of another gallery that are not in this one.

    Templates are checked and copied as they are, with their labels, sources and SHA-256; entries
    get new numbers, in the same order. A thousand are committed at once: a run that was killed
    continues when it is started again. A failure is a damaged entry, or one whose label or picture
    is enrolled otherwise. Either gallery may be encrypted. `prefix`,
    `progress` and `strict` are as for `fpmatch.gallery.tasks.enrol.enrol`; GalleryError is raised
    if both are the same, too.
    """
    if gallery.name == source.name or _same_file(gallery, source):
        raise gallery.error("its entries cannot be enrolled in itself", "same gallery")
    check_prefix(prefix)
    gallery.check_keys()
    source.check_keys()
    before, total = dict(source.damaged), len(source)
    progress("enrol", 0, total)
    entries = source.packed_entries()
    enrolled, known, done = 0, 0, 0
    labels: list[Label] = []
    failures: list[Failure] = []
    added: dict[str, list[int]] = {}
    while batch := list(islice(entries, ENTRIES_PER_COMMIT)):
        source.record("export", entries=ranges(number for number, _ in batch))
        new = [_prefixed(entry, prefix) for _, entry in batch]
        conflicts = gallery.add_packed(new)
        subjects = set()
        for entry, conflict in zip(new, conflicts, strict=True):
            if isinstance(entry, Failure) or conflict not in {None, ENROLLED}:
                failures.append(Failure(entry.source, str(conflict)))
                continue
            subjects.add(entry.label.subject)
            if conflict == ENROLLED:
                known += 1
                continue
            enrolled += 1
            labels += [entry.label] if strict else []
        given = partial(_given_of, source, {entry.content for _, entry in batch})
        added |= find_added(gallery, subjects, given)
        done += len(batch)
        progress("enrol", min(done, total), total)
    damaged = source.damaged.items() - before.items()
    skipped = [
        Failure(f"{source.name}: entry {k}", f"damaged: {why}") for k, why in sorted(damaged)
    ]
    gallery.add_packed([], skipped)
    refused, unmatched = check_added(gallery, labels, added, strict=strict)
    return Enrolment(
        enrolled - len(refused),
        known,
        (*failures, *skipped, *refused.values()),
        added=count_added(added, refused),
        unmatched=tuple(unmatched),
    )


def _given_of(source: Gallery, known: set[bytes], contents: set[bytes]) -> set[bytes]:
    """Return those of some contents that the source has; `known` ones are not looked up."""
    return known | source.enrolled_contents(contents - known)


def _prefixed(entry: PackedEntry, prefix: str) -> PackedEntry | Failure:
    """Return an entry with a text before its subject, or why that is no label."""
    if not prefix:
        return entry
    label = entry.label.prefixed(prefix)
    try:
        label.check()
    except GalleryError as error:
        return Failure(entry.source, str(error))
    return replace(entry, label=label)


def _same_file(one: Gallery, other: Gallery) -> bool:
    try:
        return one.file is not None and other.file is not None and one.file.samefile(other.file)
    except OSError as error:
        raise GalleryError(str(error.strerror or error), path=other.name) from error
