"""Verification of a claimed identity: a probe against the impressions of a subject or finger."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from fpmatch.gallery.fingers.finger import verify_finger
from fpmatch.matching.calibration import allowance
from fpmatch.printable import count, printable
from fpmatch.prints.pair import FIRST_SHARE, other_resolutions

if TYPE_CHECKING:
    from fpmatch.gallery.fingers.finger import FingerVerification
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.prints.reading import GivenPrint


@dataclass(frozen=True, slots=True, eq=False)
class CheckedClaim:
    """The decision on a claimed identity, and the impressions enrolled under it.

    `probe` is the print at the resolution of the decision; `damaged` is the number of impressions
    that could not be read, which are not among `entries`.
    """

    probe: GivenPrint
    entries: tuple[Entry, ...]
    result: FingerVerification
    damaged: int = 0

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
            "damaged": self.damaged,
            "identical": self.result.verification.identical,
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
        enrolled, compared = len(self.entries), len(self.result.compared)
        of_them = f", {compared} of them compared" if compared < enrolled else ""
        of_them += f", {self.damaged} more damaged" if self.damaged else ""
        return printable(
            f"{count(enrolled, 'impression')} of subject {self.best.label.subject}"
            f"{of_them}; the most similar is {self.best.label}, entry {self.best.id}, by itself "
            f"{self.result.best_score:.1f}"
        )


def check_claim(
    gallery: Gallery,
    probe: GivenPrint,
    subject: str,
    finger: str | None = None,
    **options: Any,
) -> CheckedClaim:
    """Decide whether a probe comes from the claimed subject of an open gallery.

    `finger` is the claimed finger (default: any; the score is of the impressions of all fingers).
    Impressions that are damaged are skipped. An image that states no resolution is tried at the
    others that its ridges allow where it does not match, and each try has a share of the false
    match rate; see `fpmatch.prints.pair.verify_given`. The options matcher, threshold and
    calibration, and the errors, are as for `fpmatch.gallery.fingers.finger.verify_finger`; raises
    GalleryError if the gallery cannot be read, or nothing of the subject or finger is enrolled, or
    all of it is damaged.
    """
    entries = {
        entry.id: entry
        for entry in gallery.entries(subject=subject)
        if finger is None or entry.label.finger == finger
    }
    sound = {entries[k]: template for k, template in gallery.templates(of=entries)}
    damaged = len(entries) - len(sound)
    if not sound:
        claim = f"subject {subject}" if finger is None else f"finger {finger} of subject {subject}"
        if damaged:
            raise gallery.error(f"damaged: all impressions of {claim}", "damaged")
        raise gallery.error(f"no impression of {claim} is enrolled", "unknown")
    verify = partial(verify_finger, references=list(sound.values()), **options)
    given, others = probe, other_resolutions(probe)
    result = verify(probe=probe.template, allowance=allowance(FIRST_SHARE) if others else 0.0)
    if not result.verification.match:
        lowered = allowance(1.0 - FIRST_SHARE, len(others))
        for other in map(probe.at, others):
            tried = verify(probe=other.template, allowance=lowered)
            if tried.verification.match and tried.verification.score > result.verification.score:
                given, result = other, tried
    if not given.dpi_stated:
        verification = replace(result.verification, dpi_assumed=("probe",))
        result = replace(result, verification=verification)
    return CheckedClaim(given, tuple(sound), result, damaged)
