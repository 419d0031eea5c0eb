"""Enrol the entries of another gallery: the file format of templates by the million."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Final

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.errors import GalleryError
from fpmatch.gallery.audit import ranges
from fpmatch.gallery.consistency import refuse_disagreeing
from fpmatch.gallery.enrol import Enrolment
from fpmatch.gallery.enrolment_index import EnrolmentIndex
from fpmatch.gallery.entry import Failure
from fpmatch.gallery.tables import ENROLLED

if TYPE_CHECKING:
    from fpmatch.gallery.entry import Label
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
    continues when it is started again. A damaged entry, and one whose label or picture is enrolled
    otherwise, is a failure.

    Parameters
    ----------
    gallery, source : Gallery
        Open galleries; either may be encrypted.
    progress : callable
        Called with stage "enrol", and with "prepare" while a large gallery is indexed, and numbers
        of entries.
    strict : bool
        Whether to refuse, once all are copied, impressions that do not match the others of their
        finger; see `fpmatch.gallery.consistency`.

    Raises
    ------
    GalleryError
        If a gallery cannot be read or written, or both are the same.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.gallery.gallery import open_gallery
    >>> from fpmatch.gallery.transfer import enrol_gallery
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open_gallery(Path(folder, "all.db"), create=True) as gallery:
    ...         with open_gallery(Path(folder, "more.db"), create=True) as more:
    ...             enrol_gallery(gallery, more)
    Enrolment(enrolled=0, known=0, failures=(), noted={})
    """
    if gallery.name == source.name or _same_file(gallery, source):
        raise gallery.error("its entries cannot be enrolled in itself", "same gallery")
    gallery.check_keys()
    source.check_keys()
    before, total = dict(source.damaged), len(source)
    progress("enrol", 0, total)
    entries = source.packed_entries()
    index = EnrolmentIndex(gallery, progress=progress)
    enrolled, known, done = 0, 0, 0
    labels: list[Label] = []
    failures: list[Failure] = []
    while batch := list(islice(entries, ENTRIES_PER_COMMIT)):
        source.record("export", entries=ranges(number for number, _ in batch))
        conflicts = gallery.add_packed([entry for _, entry in batch])
        for (_, entry), conflict in zip(batch, conflicts, strict=True):
            if conflict is None:
                enrolled += 1
                labels += [entry.label] if strict else []
            elif conflict == ENROLLED:
                known += 1
            else:
                failures.append(Failure(entry.source, conflict))
        done += len(batch)
        progress("enrol", min(done, total), total)
        index.extend(enrolled, max(0, total - done))
    damaged = source.damaged.items() - before.items()
    skipped = [
        Failure(f"{source.name}: entry {k}", f"damaged: {why}") for k, why in sorted(damaged)
    ]
    gallery.add_packed([], skipped)
    refused = refuse_disagreeing(gallery, labels) if strict else []
    if enrolled:
        index.finish()
    return Enrolment(enrolled - len(refused), known, (*failures, *skipped, *refused))


def _same_file(one: Gallery, other: Gallery) -> bool:
    try:
        return one.file is not None and other.file is not None and one.file.samefile(other.file)
    except OSError as error:
        raise GalleryError(str(error.strerror or error), path=other.name) from error
