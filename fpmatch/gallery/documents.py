"""What a gallery holds and what is found in it, as JSON objects for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.identify import Candidate
    from fpmatch.gallery.summary import GallerySummary


def summary_document(name: str, summary: GallerySummary) -> dict[str, Any]:
    """Return a gallery in figures, as ``gallery info --json`` prints it.

    Parameters
    ----------
    name : str
        What the gallery is called.
    summary : GallerySummary
        Its figures.

    Returns
    -------
    dict
        JSON values only.
    """
    return {
        "gallery": name,
        "version": summary.version,
        "impressions": summary.impressions,
        "subjects": summary.subjects,
        "minutiae": summary.minutiae,
        "template_bytes": summary.template_bytes,
        "dpi": [{"dpi": dpi, "impressions": count} for dpi, count in summary.dpi.items()],
        "failures": summary.failures,
    }


def candidate_document(candidate: Candidate, entry: Entry, reach: float) -> dict[str, Any]:
    """Return one candidate of an identification, as ``identify --json`` prints it.

    Parameters
    ----------
    candidate : Candidate
        The candidate.
    entry : Entry
        Its entry in the gallery.
    reach : float
        Lowest FMR that the calibration data measure.

    Returns
    -------
    dict
        JSON values only: of a finger, the id and the impression are those of its most similar
        impression, which by itself has ``impression_score``; ``transform``, ``pairs`` and
        ``rms_px`` are there where they were asked for, the first and the last None where no
        transform was found.
    """
    document: dict[str, Any] = {
        "rank": candidate.rank,
        "id": entry.id,
        "subject": entry.label.subject,
        "finger": entry.label.finger,
        "impression": entry.label.impression,
        "source": entry.source,
        "score": candidate.score,
        "fmr": candidate.fmr,
        "extrapolated": candidate.fmr < reach,
        "expected_false_matches": candidate.expected_false,
        "impressions": candidate.impressions,
        "impression_score": candidate.impression_score,
    }
    comparison = candidate.comparison
    if comparison is not None:
        t = comparison.transform
        document["transform"] = (
            None
            if t is None
            else {"scale": t.scale, "rotation_deg": t.rotation_deg, "tx": t.tx, "ty": t.ty}
        )
        document["pairs"] = len(comparison.pairs)
        document["rms_px"] = comparison.rms_px if t is not None else None
    return document
