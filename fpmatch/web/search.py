"""The gallery of a server: who may it be, enrol one more, what does it hold."""

from __future__ import annotations

import hashlib
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.engine.engine import serial
from fpmatch.errors import ImageError
from fpmatch.gallery.documents import candidate_document, summary_document
from fpmatch.gallery.duplicates import Claim
from fpmatch.gallery.entry import Label, NewEntry
from fpmatch.gallery.identify import identify
from fpmatch.gallery.names import NamePattern
from fpmatch.gallery.search import open_search
from fpmatch.gallery.summary import summarise
from fpmatch.web.errors import ConflictError, RequestError
from fpmatch.web.place import opened_gallery, short_name
from fpmatch.web.prints import open_upload

if TYPE_CHECKING:
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.search import Search
    from fpmatch.web.settings import Limits
    from fpmatch.web.upload import Upload

# The search that this worker process made last, by matcher and content of the gallery.
_kept: dict[tuple[str, str, str], Search] = {}


def describe_gallery(where: str) -> dict[str, Any]:
    """Return a gallery in figures, as ``fpmatch gallery info --json`` prints it.

    Raises
    ------
    GalleryError
        If it cannot be read.
    """
    with opened_gallery(where) as gallery:
        return summary_document(short_name(gallery.name), summarise(gallery))


def identify_print(
    upload: Upload,
    where: str,
    matcher: str,
    count: int,
    threshold: float,
    dpi: float | None,
    limits: Limits,
) -> dict[str, Any]:
    """Rank the prints of a gallery by how well they match a probe.

    Parameters
    ----------
    upload : Upload
        The probe.
    where : str
        The gallery.
    matcher : str
        Name of the matcher.
    count : int
        How many candidates, at most.
    threshold : float
        Score that a candidate must reach.
    dpi : float or None
        Resolution of the probe.
    limits : Limits
        What is refused.

    Returns
    -------
    dict
        As ``fpmatch identify --transform --json`` prints it of one probe.

    Raises
    ------
    FpmatchError
        If the probe or the gallery cannot be read, or an option is out of its range.
    """
    if count > limits.candidates:
        raise RequestError(f"at most {limits.candidates} candidates can be listed, not {count}")
    given = open_upload(upload, limits, dpi=dpi)
    if not len(given.template.minutiae):
        raise ImageError(f"{given.name}: no minutiae found")
    with opened_gallery(where) as gallery:
        search = _search(gallery, matcher)
        start = time.perf_counter()
        found = identify(search, given.template, count=count, threshold=threshold, transforms=True)
        seconds = time.perf_counter() - start
        entries = [gallery.entry(candidate.number) for candidate in found.candidates]
        name = short_name(gallery.name)
    return {
        "gallery": name,
        "matcher": matcher,
        "enrolled": found.enrolled,
        "compared": found.compared,
        "probe": given.name,
        "notes": list(given.notes),
        "seconds": round(seconds, 4),
        "candidates": [
            candidate_document(candidate, entry, found.fmr_reach)
            | {"source": short_name(entry.source)}
            for candidate, entry in zip(found.candidates, entries, strict=True)
        ],
    }


def enrol_print(
    upload: Upload,
    where: str,
    label: Label | None,
    pattern: str,
    dpi: float | None,
    limits: Limits,
) -> dict[str, Any]:
    """Enrol one print in a gallery.

    Parameters
    ----------
    upload : Upload
        The print.
    where : str
        The gallery.
    label : Label or None
        Whose it is; None where its name tells.
    pattern : str
        How its name tells.
    dpi : float or None
        Its resolution.
    limits : Limits
        What is refused.

    Returns
    -------
    dict
        ``enrolled``, false where the same file was enrolled before; the label; ``minutiae``.

    Raises
    ------
    FpmatchError
        If the print cannot be read, its name tells nothing, another print has its label, or the
        gallery cannot be written.
    """
    called = label or NamePattern(pattern).label(Path(upload.name))
    if called is None:
        raise RequestError(
            f"{upload.name}: its name does not tell whose it is (as 101_3.tif does); say subject "
            "and impression"
        )
    given = open_upload(upload, limits, dpi=dpi)
    if not len(given.template.minutiae):
        raise ImageError(f"{given.name}: no minutiae found")
    content = hashlib.sha256(upload.data).digest()
    with opened_gallery(where) as gallery:
        (objection,) = gallery.find_conflicts([Claim(called, content, given.template.dpi)])
        if objection is None:
            new = NewEntry(called, upload.name, content, given.template)
            (objection,) = gallery.add([new])
        if objection:
            raise ConflictError(f"{upload.name}: {objection}")
    return {
        "enrolled": objection is None,
        "name": upload.name,
        "subject": called.subject,
        "finger": called.finger,
        "impression": called.impression,
        "minutiae": len(given.template.minutiae),
        "notes": list(given.notes),
    }


def _search(gallery: Gallery, matcher: str) -> Search:
    """Return the search of a gallery as it is now, the kept one where it has not changed."""
    key = (gallery.name, matcher, gallery.content_hash())
    if key not in _kept:
        _kept.clear()
        _kept[key] = open_search(gallery, matcher, engine=serial())
    return _kept[key]
