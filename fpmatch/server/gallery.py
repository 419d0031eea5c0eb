"""Work on the gallery of a server; no response contains where it is on this machine."""

from __future__ import annotations

import hashlib
import logging
import time
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

from sqlalchemy.exc import SQLAlchemyError

from fpmatch.errors import EncryptionError, GalleryError, TemplateError
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Entry, Label, NamePattern
from fpmatch.gallery.search.identify import identify_given
from fpmatch.gallery.search.search import Search
from fpmatch.gallery.store.rows import new_entry
from fpmatch.gallery.store.tables import ENROLLED
from fpmatch.gallery.tasks.claim import check_claim
from fpmatch.gallery.tasks.consistency import find_unmatched
from fpmatch.matching.decision import DEFAULT_THRESHOLD
from fpmatch.matching.registry import DEFAULT_MATCHER
from fpmatch.prints.report import as_dict
from fpmatch.server.errors import NotReadyError, RequestError
from fpmatch.server.prints import open_upload, open_upload_with_minutiae
from fpmatch.server.watch import CHECK_S

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.prints.pair import PairOptions
    from fpmatch.server.prints import Upload

_PATIENCE_S: Final = 10.0  # of one call of a database, for requests that have begun
_DECISION: Final = ("decision", "match", "score", "fmr", "extrapolated", "threshold", "reason")
_log: Final = logging.getLogger(__name__)
# The latest search of this worker process, by gallery and matcher.
_kept: dict[tuple[str, str], Search] = {}


@contextmanager
def open_served_gallery(where: str, patience: float = _PATIENCE_S) -> Iterator[Gallery]:
    """Open a gallery as `open_gallery` does; whatever it cannot do is a GalleryError.

    Its message is for the log of the server only, but for those with the code "label". What the
    gallery does not contain is a RequestError; where the database does not answer, NotReadyError.
    """
    try:
        with open_gallery(where, patience=patience) as gallery:
            yield gallery
    except GalleryError as error:
        if error.code == "late":
            raise NotReadyError(str(error), code=error.code) from error
        if error.code == "unknown":
            raise RequestError(error.detail, status=404) from error
        raise
    except EncryptionError as error:  # the source of the keys cannot be read
        raise GalleryError(str(error), path=short_name(where), code="missing key") from error
    except (OSError, SQLAlchemyError) as error:
        raise GalleryError(str(error), path=short_name(where)) from error


def short_name(place: str) -> str:
    """Return the last part of a path or URL, without its host and options.

    Examples
    --------
    >>> short_name("/home/ada/prints.db"), short_name("postgresql://ada@host/prints?port=99")
    ('prints.db', 'prints')
    >>> short_name("postgresql://ada:secret@host")
    'gallery'
    """
    if "://" in place:
        return PurePosixPath(urlsplit(place).path).name or "gallery"
    return PurePosixPath(place.replace("\\", "/")).name or place


def describe_gallery(where: str) -> dict[str, Any]:
    """Return the counts that ``fpmatch gallery list --summary --json`` prints."""
    with open_served_gallery(where) as gallery:
        return {"gallery": short_name(gallery.name), **gallery.summarize()}


def check_gallery(where: str) -> None:
    """Open a gallery; raise GalleryError if it cannot be opened, or its keys are missing."""
    with open_served_gallery(where, CHECK_S) as gallery:
        gallery.check_keys()


def list_prints(where: str, subject: str) -> list[dict[str, Any]]:
    """Return the enrolled prints of a subject, as ``fpmatch gallery list --json`` prints them."""
    with open_served_gallery(where) as gallery:
        gallery.record("list", subject=subject, failures=False)
        return [
            entry.as_dict() | {"source": short_name(entry.source)}
            for entry in gallery.entries(subject=subject)
        ]


def remove_prints(where: str, which: int | str) -> dict[str, int]:
    """Remove the entry with a number, or all of a subject; return how many they were."""
    with open_served_gallery(where) as gallery:
        numbers = [which] if isinstance(which, int) else gallery.numbers_of(which)
        gallery.remove(numbers)
    return {"removed": len(numbers)}


def verify_claim(
    upload: Upload, where: str, subject: str, finger: str | None, options: PairOptions
) -> dict[str, Any]:
    """Return the decision on a claimed subject (None: any finger), and what was compared."""
    threshold = options.decision_score()
    probe = open_upload(upload)
    with open_served_gallery(where) as gallery:
        checked = check_claim(
            gallery,
            probe,
            subject,
            finger,
            matcher=options.matcher,
            threshold=DEFAULT_THRESHOLD if threshold is None else threshold,
        )
        match, best = checked.result.verification.match, checked.best.id
        claim = {"subject": subject, "finger": finger, "best": best, "match": match}
        gallery.record("verify", probe=upload.data, **claim)
    document = checked.as_dict()
    best = document["best"]
    decided = as_dict(checked.result.verification, "", best["source"])
    return {
        **{name: decided[name] for name in _DECISION},
        **document,
        "best": best | {"source": short_name(best["source"])},
        "notes": list(checked.probe.notes),
    }


def identify_print(
    upload: Upload, where: str, matcher: str, count: int, threshold: float
) -> dict[str, Any]:
    """Return what ``fpmatch identify --json`` prints of one probe, and the transforms."""
    most = upload.limits.candidates
    if count > most:
        raise RequestError(f"at most {most} candidates can be listed, not {count}")
    given = open_upload_with_minutiae(upload)
    with open_served_gallery(where) as gallery:
        search = _search(gallery, matcher)
        start = time.perf_counter()
        given, result = identify_given(
            search,
            given,
            count=count,
            threshold=threshold,
            transforms=True,
            listed="subjects",
            workers=1,
        )
        seconds = time.perf_counter() - start
        gallery.record("identify", probe=upload.data, candidates=result.numbers)
        name, damaged = short_name(gallery.name), len(gallery.damaged)
    candidates = result.candidate_dicts()
    return {
        "gallery": name,
        "matcher": matcher,
        "damaged": damaged,
        **result.as_dict(),
        "probe": given.name,
        "notes": list(given.notes),
        "seconds": round(seconds, 4),
        "candidates": [one | {"source": short_name(one["source"])} for one in candidates],
    }


def enrol_print(upload: Upload, where: str, label: Label | None) -> dict[str, Any]:
    """Enrol one print in a gallery, by default under the label in its name, as in 101_3.tif.

    In what is returned, ``enrolled`` is false where the same file was enrolled before, and
    ``unmatched`` is the reason where the print matches no other of its finger.
    """
    used = label or NamePattern().label(Path(upload.name))
    if used is None:
        raise RequestError(
            "its name does not contain the subject (as 101_3.tif does); give subject and "
            "impression",
            path=upload.name,
        )
    used.check()
    given = open_upload_with_minutiae(upload)
    content = hashlib.sha256(upload.data).digest()
    try:
        new = new_entry(used, upload.name, content, given.template)
    except TemplateError as error:
        raise RequestError(error.detail, path=upload.name, status=400) from error
    with open_served_gallery(where) as gallery:
        (conflict,) = gallery.find_conflicts([new])
        existing, unmatched = list[Entry](), None
        if conflict is None:  # nothing takes long once the print is stored
            existing = list(gallery.entries(subject=used.subject))
            unmatched = find_unmatched(gallery, used, given.template, existing)
            (conflict,) = gallery.add([new])
        if conflict is not None and conflict != ENROLLED:
            shown = replace(conflict, source=short_name(conflict.source))  # not its whole path
            raise RequestError(str(shown), path=upload.name, status=409)
    return {
        "enrolled": conflict is None,
        "name": upload.name,
        **asdict(used),
        "minutiae": len(given.template.minutiae),
        "subject_existed": bool(existing),
        "unmatched": unmatched,
        "notes": list(given.notes),
    }


def make_index(where: str) -> None:
    """Open the search of a gallery; the index of a large one is made where it has none."""
    with open_served_gallery(where) as gallery:
        _search(gallery, DEFAULT_MATCHER)
        for number, why in gallery.damaged.items():
            _log.warning("entry %d cannot be searched: %s", number, why)


def _search(gallery: Gallery, matcher: str) -> Search:
    """Return the search of a gallery as it is now, the kept one where it is unchanged."""
    key = gallery.name, matcher
    search = _kept.get(key)
    if search is not None:
        search.follow(gallery)
        return search
    _kept.clear()
    _kept[key] = Search(gallery, matcher, engine=serial(), note=_log.warning)
    return _kept[key]
