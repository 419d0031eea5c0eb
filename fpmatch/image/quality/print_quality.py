"""Quality of a print: how well it will compare, and how to improve it.

The score estimates the similarity of prints like this to good prints of the same finger, in percent
of the similarity among the good ones. It was learned from synthetic prints by
``python -m research train quality``.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.image.preprocess.foreground import FAINT_CONTRAST
from fpmatch.image.quality.measures import MM_PER_PX
from fpmatch.image.quality.ridge_scale import PERIODS_PX
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI, STANDARD_DPI

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Doubles
    from fpmatch.image.quality.measures import QualityMeasures

WEIGHTS_FILE: Final = Path(__file__).with_name("print_quality.json")
TYPICAL_PERIOD_PX: Final = 9.0  # ridge period of most fingers, in pixels at 500 dpi: 0.46 mm
WRONG_RESOLUTION: Final = "wrong resolution"  # code of the reason
FEATURES: Final = ("ridges", "minutiae", "ridge spread", "valley spread", "period", "blur")

# Thresholds for reasons; areas in mm², periods in pixels at 500 dpi.
MIN_IMAGE_MM2, MIN_RIDGES_MM2 = 100.0, 80.0
MIN_DARK, MAX_DARK = 0.25, 0.62  # share of a print that is dark
CLEAR_CONTRAST: Final = 13  # grey levels, of lines too close to be found as ridges
MIN_DETAIL: Final = 0.003  # energy finer than ridges
BLUR_LENGTHENS: Final = 1.15  # factor by which blur may lengthen the period


@dataclass(frozen=True, slots=True)
class Reason:
    """One fault of a print."""

    code: str  # no ridges, too small, partial, faint, too dry, too wet, blurred, wrong resolution
    message: str  # what is wrong, and what to do about it
    dpi: float | None = None  # the probable resolution, where the given one is wrong

    def __str__(self) -> str:
        return f"{self.code}: {self.message}"


@dataclass(frozen=True, slots=True)
class PrintQuality:
    """The quality of a print; ``str()`` gives it on one line.

    Parameters
    ----------
    score : int
        0, useless, to 100.
    reasons : tuple of Reason
        Its faults.
    """

    score: int
    reasons: tuple[Reason, ...] = ()

    def __str__(self) -> str:
        return "; ".join([f"quality {self.score}", *map(str, self.reasons)])

    def at_found_resolution(self) -> PrintQuality:
        """Return it without the reason that the resolution is wrong, for one that was found."""
        return replace(self, reasons=tuple(r for r in self.reasons if r.code != WRONG_RESOLUTION))

    def as_dict(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        reasons = [{"code": reason.code, "message": reason.message} for reason in self.reasons]
        return {"score": self.score, "reasons": reasons}


def why_no_minutiae(quality: PrintQuality | None) -> str:
    """Return the message about a print without minutiae, with its probable resolution if known."""
    reasons = () if quality is None else quality.reasons
    wrong = [str(reason) for reason in reasons if reason.code == WRONG_RESOLUTION]
    return "; ".join(["no minutiae found", *wrong])


def quality_features(measures: QualityMeasures) -> Doubles:
    """Return the features of the score, shape (6,), in the order of `FEATURES`.

    Logarithms of the area of ridges and of the number of minutiae, spread of ridges and valleys,
    and by how many octaves period and detail exceed their limits.
    """
    shortest, longest = PERIODS_PX
    period = measures.period_px
    off = 0.0
    if math.isfinite(period):
        off = max(math.log2(shortest / period), math.log2(period / longest), 0.0)
    blur = max(math.log2(MIN_DETAIL / max(measures.detail, MIN_DETAIL / 64)), 0.0)
    amounts = math.log(measures.ridges_mm2), math.log1p(measures.minutiae)
    return np.array([*amounts, measures.ridge_spread, measures.valley_spread, off, blur])


class QualityWeights(NamedTuple):
    """Middle, spread and weight of each of `FEATURES`, and the bias of the sum."""

    middle: Doubles
    spread: Doubles
    weight: Doubles
    bias: float


@cache
def shipped_weights() -> QualityWeights:
    """Return the weights that belong to the package."""
    document = json.loads(WEIGHTS_FILE.read_bytes())
    numbers = np.array([list(row.values())[1:] for row in document["features"]])
    middle, spread, weight = numbers.T
    return QualityWeights(middle, spread, weight, document["bias"])


def quality_score(features: Doubles, weights: QualityWeights) -> Doubles:
    """Return the scores, 0 to 100, of features of shape (..., 6)."""
    standardized = (features - weights.middle) / weights.spread
    total = weights.bias + standardized @ weights.weight
    return np.asarray(50.0 * (1.0 + np.tanh(total / 2)))


def grade(measures: QualityMeasures, dpi: float) -> PrintQuality:
    """Grade a print, whose resolution was taken to be `dpi`, by its measures."""
    reasons = tuple(_reasons(measures, dpi))
    needed = (measures.ridge_spread, measures.valley_spread, measures.detail)
    if measures.ridges_mm2 <= 0 or not all(map(math.isfinite, needed)):
        return PrintQuality(0, reasons)
    score = quality_score(quality_features(measures), shipped_weights())
    return PrintQuality(round(float(score)), reasons)


def _reasons(m: QualityMeasures, dpi: float) -> list[Reason]:
    """Return the faults of a print: of its area, of its ink or skin, of its sharpness."""
    blurred = m.detail < MIN_DETAIL
    area: list[Reason] = []
    if m.ridges_mm2 <= 0:
        area.append(Reason("no ridges", "no fingerprint is found in the image"))
    if m.image_mm2 < MIN_IMAGE_MM2:
        side = math.sqrt(MIN_IMAGE_MM2)
        shown = f"the image shows {m.image_mm2:.0f} mm² of skin at most"
        advice = f"a larger sensor, {side:.0f} x {side:.0f} mm at least"
        area.append(Reason("too small", f"{shown} ({advice})"))
    elif 0 < m.ridges_mm2 < MIN_RIDGES_MM2:
        shown = f"ridges on {m.ridges_mm2:.0f} mm² only"
        area.append(Reason("partial", f"{shown} (lay the whole fingertip on the sensor)"))
    ink: list[Reason] = []
    if m.ridges_mm2 > 0 and m.contrast < FAINT_CONTRAST:
        contrast = f"contrast of {m.contrast:.0f} grey levels of 255"
        ink.append(Reason("faint", f"{contrast} (set exposure and range of the scanner or sensor)"))
    if m.dark_share < MIN_DARK:
        ink.append(Reason("too dry", "ridges are thin and broken (moisten the finger, press on)"))
    elif m.dark_share > MAX_DARK:
        ink.append(Reason("too wet", "ridges run together (dry the finger, press less)"))
    shortest, longest = PERIODS_PX
    longest *= BLUR_LENGTHENS if blurred else 1.0
    # where no ridges are found, lines too close for them are believed, but no blots or faint grain
    believed = m.ridges_mm2 > 0 or (m.period_px < shortest and m.contrast >= CLEAR_CONTRAST)
    if believed and not shortest <= m.period_px <= longest and math.isfinite(m.period_px):
        return [*ink, wrong_resolution(m.period_px, dpi)]  # then no area is right
    soft = "edges of ridges are soft (hold still, focus, clean the sensor)"
    return [*area, *ink, *([Reason("blurred", soft)] if blurred else [])]


def wrong_resolution(period_px: float, dpi: float) -> Reason:
    """Return the reason for a ridge period of `period_px` pixels at 500 dpi."""
    probable = min(max(round(dpi * period_px / TYPICAL_PERIOD_PX, -1), MIN_DPI), MAX_DPI)
    return Reason(
        WRONG_RESOLUTION,
        f"ridges lie {period_px * dpi / STANDARD_DPI:.1f} px apart, {period_px * MM_PER_PX:.2f} mm "
        f"at {dpi:g} dpi, and {TYPICAL_PERIOD_PX * MM_PER_PX:.2f} mm on most fingers: the "
        f"resolution is probably not {dpi:g} dpi but about {probable:.0f} dpi (set it)",
        dpi=probable,
    )
