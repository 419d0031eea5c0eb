"""One-to-one comparison of two given prints, as the commands and the web interface request it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import fmr_to_score, load_calibration
from fpmatch.matching.registry import DEFAULT_MATCHER, matcher_name, states_rho
from fpmatch.matching.verify import find_identity, verify
from fpmatch.prints.report import as_dict

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.matching.verification import Verification
    from fpmatch.matching.verify import Identity
    from fpmatch.prints.reading import GivenPrint


@dataclass(frozen=True, slots=True)
class PairOptions:
    """The options of a comparison; the name of the matcher may state parameters."""

    matcher: str = DEFAULT_MATCHER
    fmr: float | None = None
    threshold: float | None = None
    calibration: Path | None = None

    def decision_score(self) -> float | None:
        """Return the score to decide at; None for the matcher's own rule."""
        if self.fmr is not None and self.threshold is not None:
            raise MatcherError("fmr and threshold exclude each other", code="exclusive")
        if states_rho(self.matcher) and (self.fmr, self.threshold) != (None, None):
            raise MatcherError(
                "rho decides without a score: give neither fmr nor threshold", code="exclusive"
            )
        return self.threshold if self.fmr is None else fmr_to_score(self.fmr)


@dataclass(frozen=True, eq=False)
class ComparedPair:
    """Two prints and the decision on them."""

    probe: GivenPrint
    reference: GivenPrint
    verification: Verification

    @cached_property
    def quality(self) -> dict[str, PrintQuality | None]:
        """Quality of both images; None for a template."""
        return {"probe": self.probe.quality, "reference": self.reference.quality}

    @cached_property
    def identical(self) -> Identity | None:
        """What of the two prints is the same; see `find_identity`."""
        sides = self.probe, self.reference
        images = [None if one.image is None else one.image.pixels for one in sides]
        return find_identity([one.template for one in sides], images)

    def as_dict(self) -> dict[str, Any]:
        """Return the object that ``fpmatch verify --json`` prints."""
        names = self.probe.name, self.reference.name
        return as_dict(self.verification, *names, self.quality, identical=self.identical)


def compare_pair(probe: GivenPrint, reference: GivenPrint, options: PairOptions) -> ComparedPair:
    """Decide whether two given prints come from the same finger."""
    file = options.calibration
    verification = verify_given(
        probe,
        reference,
        matcher=options.matcher,
        threshold=options.decision_score(),
        calibration=None if file is None else load_calibration(matcher_name(options.matcher), file),
    )
    return ComparedPair(probe, reference, verification)


def verify_given(probe: GivenPrint, reference: GivenPrint, **options: Any) -> Verification:
    """Verify two given prints; inconclusive where an assumed resolution decides."""
    sides = {"probe": probe, "reference": reference}
    assumed = tuple(name for name, given in sides.items() if given.dpi_assumed)
    images = [None if one.image is None else one.image.pixels for one in sides.values()]
    verified = verify(probe.template, reference.template, images=images, **options)
    return replace(verified, dpi_assumed=assumed)
