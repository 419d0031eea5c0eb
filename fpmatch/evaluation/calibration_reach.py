"""How far the data behind a calibration reach, and whether the package's own would have done."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.drawing.words import odds
from fpmatch.evaluation.bootstrap import resample_fmr
from fpmatch.evaluation.calibrate import CalibrationParameters
from fpmatch.evaluation.intervals import DEFAULT_RESAMPLES, Interval, interval_of
from fpmatch.matching.calibration import (
    Calibration,
    calibrated_matchers,
    load_calibration,
    score_to_fmr,
)
from fpmatch.matching.verify import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.impostors import ImpostorSet

PARAMETERS: Final = CalibrationParameters()
CHECKED_SCORES: Final = (20.0, 30.0)
_LABEL_WIDTH: Final = 12


@dataclass(frozen=True, slots=True)
class CalibrationReach:
    """Hold what a calibration rests on.

    Parameters
    ----------
    matcher : str
        The matcher.
    sets, fingers, impostors : int
        How many databases, fingers and comparisons of different fingers.
    reach : float
        Score up to which they measure the false match rate; above, it is extrapolated.
    fmr_at_reach : Interval or None
        The 95 % interval of the false match rate at that score, by drawing fingers anew.
    highest : float
        Score of the highest of these comparisons.
    package : tuple of (float, float)
        Scores by the package's own calibration, and the share of these comparisons that reach
        each; empty where the package has none.
    """

    matcher: str
    sets: int
    fingers: int
    impostors: int
    reach: float
    fmr_at_reach: Interval | None
    highest: float
    package: tuple[tuple[float, float], ...]

    def as_json(self) -> dict[str, Any]:
        """Return what is held, as JSON values."""
        interval = self.fmr_at_reach
        return {
            "matcher": self.matcher,
            "databases": self.sets,
            "fingers": self.fingers,
            "impostors": self.impostors,
            "reach_score": self.reach,
            "reach_fmr": score_to_fmr(self.reach),
            "reach_fmr_interval": interval and [interval.low, interval.high],
            "highest_impostor_score": self.highest,
            "by_the_package": [{"score": s, "fmr": share} for s, share in self.package],
        }


def measure_reach(
    calibration: Calibration,
    sets: Sequence[ImpostorSet],
    *,
    resamples: int = DEFAULT_RESAMPLES,
    seed: int = 0,
) -> CalibrationReach:
    """Measure how far the data of a calibration reach.

    Parameters
    ----------
    calibration : Calibration
        The fit, by `calibrate_on`.
    sets : sequence of ImpostorSet
        What it was fitted to.
    resamples, seed : int
        Draws of fingers for the interval, and what makes them.

    Returns
    -------
    CalibrationReach
        The reach.
    """
    matcher = calibration.provenance.matcher
    similarity = np.concatenate([one.trials.similarity for one in sets])
    last_knot = calibration.knots[-1][0]
    package: tuple[tuple[float, float], ...] = ()
    if matcher in calibrated_matchers():
        scores = load_calibration(matcher).scores(similarity)
        package = tuple((at, float(np.mean(scores >= at))) for at in CHECKED_SCORES)
    return CalibrationReach(
        matcher=matcher,
        sets=len(sets),
        fingers=calibration.provenance.fingers,
        impostors=calibration.provenance.impostors,
        reach=calibration.largest_measured_score,
        fmr_at_reach=interval_of(
            resample_fmr([one.trials for one in sets], last_knot, resamples, seed)
        ),
        highest=calibration.score(float(similarity.max())),
        package=package,
    )


def format_reach(reach: CalibrationReach) -> str:
    """Return what a calibration rests on, in words for people.

    Parameters
    ----------
    reach : CalibrationReach
        The reach.

    Returns
    -------
    str
        A line an item.
    """
    r = reach
    rows = [
        ("Matcher", r.matcher),
        (
            "Fitted to",
            f"{r.impostors:,} comparisons of different fingers, {r.fingers} in all "
            f"({r.sets} database{'s' if r.sets > 1 else ''})",
        ),
        ("Reach", f"score {r.reach:.1f}, a false match rate of {odds(score_to_fmr(r.reach))}"),
    ]
    if r.fmr_at_reach is not None:
        low, high = r.fmr_at_reach.low, r.fmr_at_reach.high
        lowest = odds(low) if low > 0 else "none"
        rows.append(("", f"(95 % interval over fingers: {odds(high)} to {lowest})"))
    rows.append(("Beyond", "scores are extrapolated, and verify says so where it gives one"))
    if r.reach < DEFAULT_THRESHOLD:
        needed = round(PARAMETERS.min_above / score_to_fmr(DEFAULT_THRESHOLD))
        rows.append(
            ("", f"so is the default threshold, {DEFAULT_THRESHOLD:g}: to reach it takes some")
        )
        rows.append(("", f"{needed:,} comparisons of different fingers"))
    rows.append(("Highest", f"the highest of these comparisons scores {r.highest:.1f}"))
    for at, share in r.package:
        reached = f"{odds(share)} reach" if share > 0 else "none reaches"
        meant = odds(score_to_fmr(at))
        rows.append(
            ("As supplied", f"{reached} {at:g} on the package's calibration; {meant} is meant")
        )
    return "\n".join(f"  {label:<{_LABEL_WIDTH}}{text}" for label, text in rows)
