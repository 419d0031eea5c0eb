"""The data behind a calibration: the scores that it measures, and the package's own beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.batch.decision import calibration_of
from fpmatch.lab.evaluation.calibrate import MIN_ABOVE
from fpmatch.lab.evaluation.rates.bootstrap import DEFAULT_BOOTSTRAP, bootstrap_fmr
from fpmatch.lab.evaluation.rates.intervals import Interval, interval_of
from fpmatch.matching.calibration import Calibration, score_to_fmr
from fpmatch.matching.verify import DEFAULT_THRESHOLD
from fpmatch.printable import count
from fpmatch.prints.words import odds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.lab.evaluation.impostors import ImpostorSet

CHECKED_SCORES: Final = (20.0, 30.0)


@dataclass(frozen=True, slots=True)
class CalibrationReport:
    """The comparisons that a calibration is based on, and the FMR that they measure.

    Its comparisons measure the FMR up to `largest_measured_score`, where its 95 % interval over
    fingers is `fmr_interval`; above, it is extrapolated. `package` holds scores of the package's
    own calibration, if any, and the share of these comparisons that reach each.
    """

    matcher: str
    sets: int
    fingers: int
    impostors: int
    largest_measured_score: float
    fmr_interval: Interval | None
    highest_score: float
    package: tuple[tuple[float, float], ...]

    @property
    def smallest_measured_fmr(self) -> float:
        """The false match rate at the largest measured score."""
        return score_to_fmr(self.largest_measured_score)

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON values."""
        return {
            "matcher": self.matcher,
            "databases": self.sets,
            "fingers": self.fingers,
            "impostors": self.impostors,
            "largest_measured_score": self.largest_measured_score,
            "smallest_measured_fmr": self.smallest_measured_fmr,
            "smallest_measured_fmr_interval": self.fmr_interval,
            "highest_impostor_score": self.highest_score,
            "package_calibration": [{"score": s, "fmr": share} for s, share in self.package],
        }

    def as_text(self) -> str:
        """Return the report as text, a line an item."""
        databases = count(self.sets, "database")
        measured, fmr = self.largest_measured_score, odds(self.smallest_measured_fmr)
        fingers = count(self.fingers, "finger") if self.fingers else "unknown fingers"
        rows = [
            ("Matcher", self.matcher),
            ("Fitted to", f"{self.impostors:,} impostor comparisons"),
            ("", f"of {fingers} ({databases})"),
            ("Measured", f"up to score {measured:.1f}, a false match rate of {fmr}"),
        ]
        if self.fmr_interval is not None:
            low, high = self.fmr_interval
            lowest = odds(low) if low > 0 else "none"
            rows.append(("", f"(95 % interval over fingers: {odds(high)} to {lowest})"))
        rows.append(("Beyond", "scores are extrapolated, and verify notes it"))
        if self.largest_measured_score < DEFAULT_THRESHOLD:
            needed = round(MIN_ABOVE / score_to_fmr(DEFAULT_THRESHOLD))
            rows += [
                ("", f"so is the default threshold, {DEFAULT_THRESHOLD:g}: to measure it takes"),
                ("", f"some {needed:,} impostor comparisons"),
            ]
        highest = f"the highest of these comparisons scores {self.highest_score:.1f}"
        rows.append(("Highest", highest))
        for at, share in self.package:
            reached = f"{odds(share)} reach" if share > 0 else "none reaches"
            meant = f"{odds(score_to_fmr(at))} is meant"
            rows.append(("As supplied", f"{reached} {at:g} on the package's calibration; {meant}"))
        return "\n".join(f"  {label:<12}{text}" for label, text in rows)


def report_calibration(
    calibration: Calibration,
    sets: Sequence[ImpostorSet],
    *,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
) -> CalibrationReport:
    """Return the report on a calibration that `calibrate_on` fitted to these databases."""
    matcher = calibration.provenance.matcher
    similarity = np.concatenate([one.trials.similarity for one in sets])
    package: tuple[tuple[float, float], ...] = ()
    if own := calibration_of(matcher):
        scores = own.scores(similarity)
        package = tuple((at, float(np.mean(scores >= at))) for at in CHECKED_SCORES)
    last_knot = calibration.knots[-1][0]
    trials = [one.trials for one in sets]
    fmr_interval = None
    if all(t.fingers for t in trials):
        fmr_interval = interval_of(bootstrap_fmr(trials, last_knot, bootstrap, seed))
    return CalibrationReport(
        matcher=matcher,
        sets=len(sets),
        fingers=calibration.provenance.fingers,
        impostors=calibration.provenance.impostors,
        largest_measured_score=calibration.largest_measured_score,
        fmr_interval=fmr_interval,
        highest_score=calibration.score(float(similarity.max())),
        package=package,
    )
