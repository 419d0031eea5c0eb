"""Verification of a claimed identity: a probe against the impressions of a subject or finger."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fpmatch.matching.finger import verify_finger
from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.matching.verify import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.finger import FingerVerification
    from fpmatch.matching.result import Matcher
    from fpmatch.minutiae import Template


@dataclass(frozen=True, slots=True, eq=False)
class CheckedClaim:
    """Hold the decision on a claimed identity, and the impressions enrolled under it."""

    entries: tuple[Entry, ...]
    result: FingerVerification

    @property
    def best(self) -> Entry:
        """The most similar impression."""
        return self.entries[self.result.best]

    def as_dict(self) -> dict[str, Any]:
        """Return what was compared as JSON values."""
        label = self.best.label
        return {
            "subject": label.subject,
            "impressions": len(self.entries),
            "compared": len(self.result.compared),
            "best": {
                "id": self.best.id,
                "finger": label.finger,
                "impression": label.impression,
                "source": self.best.source,
                "score": self.result.best_score,
            },
        }

    def in_words(self) -> str:
        """Return what was compared as a sentence."""
        count, compared = len(self.entries), len(self.result.compared)
        of_them = f", {compared} of them compared" if compared < count else ""
        return (
            f"{count} impression{'s' if count > 1 else ''} of subject {self.best.label.subject}"
            f"{of_them}; the most similar is {self.best.label}, entry {self.best.id}, by itself "
            f"{self.result.best_score:.1f}"
        )


def check_claim(
    gallery: Gallery,
    probe: Template,
    subject: str,
    finger: str | None = None,
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    threshold: float = DEFAULT_THRESHOLD,
    calibration: Calibration | None = None,
) -> CheckedClaim:
    """Decide whether a probe comes from the claimed subject.

    Parameters
    ----------
    gallery : Gallery
        An open gallery.
    probe : Template
        The probe.
    subject : str
        The claimed subject.
    finger : str, optional
        The claimed finger (default: any; the score is of the impressions of all fingers).
    matcher, threshold, calibration
        As for `fpmatch.matching.finger.verify_finger`.

    Raises
    ------
    GalleryError
        If the gallery cannot be read, or nothing of the subject or finger is enrolled.
    MatcherError
        If the matcher is unknown or not calibrated, or the threshold is out of range.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.gallery.entry import Label, NewEntry
    >>> from fpmatch.gallery.gallery import open_gallery
    >>> minutiae = Minutiae(x=[50, 90, 60, 70], y=[40, 50, 80, 60], angle=[0, 1, 2, 3])
    >>> template = Template(minutiae, 100, 100)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open_gallery(Path(folder, "gallery.db"), create=True) as gallery:
    ...         _ = gallery.add([NewEntry(Label("ada"), "ada.tif", bytes(32), template)])
    ...         checked = check_claim(gallery, template, "ada")
    >>> checked.best.label, len(checked.entries)
    (Label(subject='ada', finger='', impression=''), 1)
    """
    entries = tuple(
        entry
        for entry in gallery.entries(subject=subject)
        if finger is None or entry.label.finger == finger
    )
    if not entries:
        claim = f"subject {subject}" if finger is None else f"finger {finger} of subject {subject}"
        raise gallery.database.error(f"no impression of {claim} is enrolled", "unknown")
    references = [gallery.template(entry.id) for entry in entries]
    result = verify_finger(
        probe, references, matcher=matcher, threshold=threshold, calibration=calibration
    )
    return CheckedClaim(entries, result)
