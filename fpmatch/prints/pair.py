"""One-to-one comparison of two given prints, as the commands and the web interface request it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.plugins import named
from fpmatch.errors import MatcherError
from fpmatch.image.quality.ridge_scale import is_sound, possible_dpi
from fpmatch.matching.calibration import allowance, fmr_to_score, load_calibration
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher, states_rho
from fpmatch.matching.scale import CANDIDATE_RATIOS
from fpmatch.matching.verify import verify
from fpmatch.prints.reading import GivenPrint
from fpmatch.prints.report import as_dict

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.matching.verify import Verification

# Shares of the false match rate where not all resolutions are stated; their sum is 1:
FIRST_SHARE: Final = 0.9  # for the first try,
USUAL_SHARE: Final = 0.06  # for all other usual resolutions together,
SCALE_SHARE: Final = 0.04  # and for the one by which the scale differs
MOST_UNLIKE: Final = math.log(1.2)  # ratio of the distances of ridges in two prints of a finger


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
        if (self.fmr, self.threshold) != (None, None) and states_rho(self.matcher):
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

    @property
    def quality(self) -> dict[str, PrintQuality | None]:
        """Quality of both images; None for a template."""
        return {"probe": self.probe.quality, "reference": self.reference.quality}

    def as_dict(self) -> dict[str, Any]:
        """Return the object that ``fpmatch verify --json`` prints."""
        sides = {"probe": self.probe, "reference": self.reference}
        names = self.probe.name, self.reference.name
        resolution = {
            side: {"dpi": given.template.dpi, "source": given.dpi_source}
            for side, given in sides.items()
        }
        document = as_dict(self.verification, *names, self.quality)
        return document | {"resolution": resolution}


def compare_pair(probe: GivenPrint, reference: GivenPrint, options: PairOptions) -> ComparedPair:
    """Decide whether two given prints come from the same finger."""
    file, calibration = options.calibration, None
    if file is not None:
        calibration = load_calibration(get_matcher(options.matcher).name, file)
    return verify_given(
        probe,
        reference,
        matcher=options.matcher,
        threshold=options.decision_score(),
        calibration=calibration,
    )


def verify_given(probe: GivenPrint, reference: GivenPrint, **options: Any) -> ComparedPair:
    """Verify two given prints, also at other resolutions where nothing states theirs.

    Others are tried where the prints do not match, or match at two scales: the usual ones, then
    that by which the scale differs. Each try gets a share of the stated rate, the first one too,
    which lowers its score; see `allowance`.
    """
    if all(side.dpi_stated or side.image is None for side in (probe, reference)):
        return _verified(probe, reference, options)
    pair = _verified(probe, reference, options, allowance(FIRST_SHARE))
    first = pair.verification
    if first.rho is not None or (first.match and not _differ_in_scale(pair)):
        return pair
    usual = _other_resolutions(probe, reference)
    at = cache(GivenPrint.at)
    kinds = (
        (usual, allowance(USUAL_SHARE, len(usual))),
        (_by_scale(pair), allowance(SCALE_SHARE, len(CANDIDATE_RATIOS))),
    )
    for others, lowered in kinds:
        tried = [_verified(at(probe, a), at(reference, b), options, lowered) for a, b in others]
        matching = [one for one in tried if one.verification.match]
        if first.match:
            matching = [one for one in matching if not _differ_in_scale(one)]
        if matching:
            return max(matching, key=lambda one: one.verification.score)
    return pair


def other_resolutions(probe: GivenPrint) -> list[float]:
    """Return the resolutions that an image may have besides that of its template, by its ridges.

    None where one is stated, or where prints that came with it decided.
    """
    if probe.dpi_stated or probe.image is None or probe.image.likely_dpi is not None:
        return []
    possible = possible_dpi(probe.ridge_period_px, probe.image.pixels.shape)
    return [dpi for dpi in possible if dpi != probe.template.dpi]


def _verified(
    probe: GivenPrint, reference: GivenPrint, options: dict[str, Any], lowered: float = 0.0
) -> ComparedPair:
    """Verify two prints at the resolutions of their templates, by a score `lowered` so much."""
    sides = {"probe": probe, "reference": reference}
    unstated = tuple(name for name, given in sides.items() if not given.dpi_stated)
    images = [None if one.image is None else one.image.pixels for one in sides.values()]
    try:
        verified = verify(
            probe.template,
            reference.template,
            images=images,
            allowance=lowered,
            dpi_assumed=unstated,
            **options,
        )
    except MatcherError as error:
        raise named(error, probe.name, reference.name) from error
    return ComparedPair(probe, reference, verified)


def _differ_in_scale(pair: ComparedPair) -> bool:
    scale = pair.verification.scale
    return scale is not None and scale.differs


def _other_resolutions(probe: GivenPrint, reference: GivenPrint) -> list[tuple[float, float]]:
    """Return pairs of resolutions at which the ridges of two prints are about as far apart."""
    own = probe.template.dpi, reference.template.dpi
    both = product(_resolutions(probe, reference), _resolutions(reference, probe))
    periods = probe.ridge_period_px, reference.ridge_period_px
    if periods[0] is None or periods[1] is None:
        return [dpi for dpi in both if dpi != own]
    apart = math.log(periods[0] / periods[1])
    unlike = {dpi: abs(apart - math.log(dpi[0] / dpi[1])) for dpi in both}
    return [dpi for dpi, much in unlike.items() if much <= MOST_UNLIKE and dpi != own]


def _by_scale(pair: ComparedPair) -> list[tuple[float, float]]:
    """Return resolutions at which two prints have one scale; none if they have, or unknown."""
    v, scale = pair.verification, pair.verification.scale
    if scale is None or not scale.differs:
        return []
    probe_dpi, reference_dpi = v.probe.dpi, v.reference.dpi
    if not pair.probe.dpi_stated:
        probe_dpi = round(probe_dpi / scale.ratio)
    else:
        reference_dpi = round(reference_dpi * scale.ratio)
    sides = ((pair.probe, probe_dpi), (pair.reference, reference_dpi))
    sound = all(one.image is None or is_sound(one.image.pixels.shape, dpi) for one, dpi in sides)
    return [(probe_dpi, reference_dpi)] if sound else []


def _resolutions(given: GivenPrint, other: GivenPrint) -> list[float]:
    """Return the resolutions that a print may have, by the ridges of the other if need be."""
    own, period = given.template.dpi, given.ridge_period_px
    if period is None and not other.dpi_stated:
        period = other.ridge_period_px
    if given.dpi_stated or given.image is None or (period is None and not other.dpi_stated):
        return [own]
    return list(dict.fromkeys([own, *possible_dpi(period, given.image.pixels.shape)]))
