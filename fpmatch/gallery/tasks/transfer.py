"""Enrol the entries of another gallery: the file format of templates by the million."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Final

from fpmatch.errors import GalleryError
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.listing.entry import Failure
from fpmatch.gallery.store.audit import ranges
from fpmatch.gallery.tasks.enrol import Enrolment, outcome_of
from fpmatch.gallery.tasks.screening import Screening

if TYPE_CHECKING:
    from fpmatch.gallery.gallery import Gallery

ENTRIES_PER_COMMIT: Final = 1000


def enrol_gallery(
    gallery: Gallery,
    source: Gallery,
    *,
    progress: Progress = no_progress,
    strict: bool = False,
) -> Enrolment:
    """Enrol the entries of another gallery that are not in this one.

    Templates are checked and copied as they are, with their labels, sources and SHA-256; entries
    get new numbers, in the same order. A thousand are committed at once: a run that was killed
    continues when it is started again. A failure is a damaged entry, or one whose label or picture
    is enrolled otherwise. Either gallery may be encrypted.
    `progress` and `strict` are as for `fpmatch.gallery.tasks.enrol.enrol`; GalleryError is raised
    if both are the same, too.
    """
    if gallery.name == source.name or _same_file(gallery, source):
        raise gallery.error("its entries cannot be enrolled in itself", "same gallery")
    gallery.check_keys()
    source.check_keys()
    before, total = dict(source.damaged), len(source)
    progress("enrol", 0, total)
    entries = source.packed_entries()
    screening, done = Screening(gallery, strict=strict), 0
    while batch := list(islice(entries, ENTRIES_PER_COMMIT)):
        source.record("export", entries=ranges(number for number, _ in batch))
        screening.add([entry for _, entry in batch])
        done += len(batch)
        progress("enrol", min(done, total), total)
    damaged = source.damaged.items() - before.items()
    skipped = [
        Failure(f"{source.name}: entry {k}", f"damaged: {why}") for k, why in sorted(damaged)
    ]
    screening.add([], skipped)
    return outcome_of(screening)


def _same_file(one: Gallery, other: Gallery) -> bool:
    try:
        return one.file is not None and other.file is not None and one.file.samefile(other.file)
    except OSError as error:
        raise GalleryError(str(error.strerror or error), path=other.name) from error
