"""Quality of a print: how well it will compare, and what could be done better.

The score says how much prints like this have in common with good ones of the same finger, in
percent of what good ones have among themselves. It was learned from synthetic prints by
``scripts/train_quality``.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import FpmatchError
from fpmatch.image.quality.measures import MM_PER_PX
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.image.quality.measures import QualityMeasures

WEIGHTS_FILE: Final = Path(__file__).with_name("print_quality.json")
TYPICAL_PERIOD_PX: Final = 9.0
"""Distance from ridge to ridge of most fingers, in pixels at 500 dpi: 0.46 mm."""
WRONG_RESOLUTION: Final = "wrong resolution"
"""What a reason is called whose ridges lie too near or too far apart."""
FEATURES: Final = ("ridges", "minutiae", "ridge spread", "valley spread", "period", "blur")
"""What the score is made of; see `quality_features`."""


@dataclass(frozen=True, slots=True)
class QualityLimits:
    """Set from where on something is said; areas in mm², periods in pixels at 500 dpi.

    Parameters
    ----------
    min_image_mm2, min_ridges_mm2 : float
        Areas of image and ridges.
    min_dark, max_dark : float
        Share of a print that is dark.
    periods_px : tuple of float
        Between which ridges of people lie apart.
    min_detail : float
        Energy of what is finer than ridges.
    min_concentration : float
        Share of the energy about one period below which it is not one of ridges.
    far_periods_px : tuple of float
        Beyond which the strongest period is not one of people's ridges.
    min_peak_shares : tuple of float
        Share of the energy about a strongest period too short, and too long, below which it is not
        one of ridges.
    blur_lengthens : float
        Factor by which blur may lengthen the strongest period.
    """

    min_image_mm2: float = 100.0
    min_ridges_mm2: float = 80.0
    min_dark: float = 0.25
    max_dark: float = 0.62
    periods_px: tuple[float, float] = (6.75, 12.0)
    min_detail: float = 0.003
    min_concentration: float = 0.6
    far_periods_px: tuple[float, float] = (6.0, 12.3)
    min_peak_shares: tuple[float, float] = (0.5, 0.6)
    blur_lengthens: float = 1.15


@dataclass(frozen=True, slots=True)
class Reason:
    """Hold one thing that is wrong with a print, and what to do about it.

    Parameters
    ----------
    what : str
        "no ridges", "too small", "partial", "too dry", "too wet", "blurred" or "wrong resolution".
    why : str
        What is seen, and what helps.
    """

    what: str
    why: str

    def __str__(self) -> str:
        return f"{self.what}: {self.why}"


@dataclass(frozen=True, slots=True)
class PrintQuality:
    """Hold the quality of a print.

    Parameters
    ----------
    score : int
        0, of no use, to 100.
    reasons : tuple of Reason
        What is wrong with it; empty where nothing stands out.
    """

    score: int
    reasons: tuple[Reason, ...] = ()

    def in_words(self) -> str:
        """Return it on one line."""
        return "; ".join([f"quality {self.score}", *map(str, self.reasons)])

    def as_dict(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "score": self.score,
            "reasons": [{"what": reason.what, "why": reason.why} for reason in self.reasons],
        }


@dataclass(frozen=True, slots=True, eq=False)
class QualityWeights:
    """Hold what was learned: of each of `FEATURES` middle, spread and weight; and the bias."""

    middle: NDArray[np.float64]
    spread: NDArray[np.float64]
    weight: NDArray[np.float64]
    bias: float
    provenance: Mapping[str, Any]

    def score(self, features: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the scores, 0 to 100, of features of shape (..., 6)."""
        total = self.bias + ((features - self.middle) / self.spread) @ self.weight
        return np.asarray(50.0 * (1.0 + np.tanh(total / 2)))

    def as_json(self) -> str:
        """Return the weights as the text of a JSON file."""
        columns = zip(self.middle.tolist(), self.spread.tolist(), self.weight.tolist(), strict=True)
        features = [
            {"name": name, "middle": middle, "spread": spread, "weight": weight}
            for name, (middle, spread, weight) in zip(FEATURES, columns, strict=True)
        ]
        document = {"provenance": self.provenance, "bias": self.bias, "features": features}
        return f"{json.dumps(document, indent=1)}\n"

    @classmethod
    def from_json(cls, text: str) -> QualityWeights:
        """Read what `as_json` wrote.

        Raises
        ------
        FpmatchError
            If the text is no such thing, or its features are others than `FEATURES`.
        """
        try:
            document = json.loads(text)
            rows = document["features"]
            if tuple(row["name"] for row in rows) != FEATURES:
                raise FpmatchError("weights of the quality: of other features than this version's")
            middle, spread, weight = (
                np.array([float(row[key]) for row in rows])
                for key in ("middle", "spread", "weight")
            )
            return cls(middle, spread, weight, float(document["bias"]), document["provenance"])
        except (LookupError, TypeError, ValueError) as error:
            raise FpmatchError("weights of the quality: not such a file") from error


@cache
def load_quality_weights() -> QualityWeights:
    """Return the weights in the package."""
    return QualityWeights.from_json(WEIGHTS_FILE.read_text(encoding="utf-8"))


def quality_features(
    figures: QualityMeasures, limits: QualityLimits | None = None
) -> NDArray[np.float64]:
    """Return what the score is made of, shape (6,), in the order of `FEATURES`.

    Logarithms of the area of ridges and of the minutiae, how uneven ridges and valleys are, and how
    far, in octaves, period and detail lie beyond their limits.
    """
    limit = limits or QualityLimits()
    shortest, longest = limit.periods_px
    off = max(math.log2(shortest / figures.period_px), math.log2(figures.period_px / longest), 0.0)
    blur = max(math.log2(limit.min_detail / max(figures.detail, limit.min_detail / 64)), 0.0)
    return np.array(
        [
            math.log(figures.ridges_mm2),
            math.log1p(figures.minutiae),
            figures.ridge_spread,
            figures.valley_spread,
            off,
            blur,
        ]
    )


def grade(
    figures: QualityMeasures,
    dpi: float,
    *,
    limits: QualityLimits | None = None,
    weights: QualityWeights | None = None,
) -> PrintQuality:
    """Judge a print by its figures.

    Parameters
    ----------
    figures : QualityMeasures
        From `fpmatch.image.quality.measures.measure_quality`.
    dpi : float
        The resolution that it was taken for.
    limits : QualityLimits, optional
        From where on something is said.
    weights : QualityWeights, optional
        What the score is made with (default: those in the package).

    Returns
    -------
    PrintQuality
        Its score and what is wrong with it.

    Examples
    --------
    >>> from fpmatch.image.quality.measures import QualityMeasures
    >>> found = grade(QualityMeasures(200, 40, 9, 0.45, 0.5, 0.3, 9.0, 0.9, 0.05), dpi=500)
    >>> [reason.what for reason in found.reasons]
    ['partial']
    """
    limit = limits or QualityLimits()
    reasons = tuple(_reasons(figures, dpi, limit))
    measured = (figures.ridge_spread, figures.valley_spread, figures.period_px, figures.detail)
    if figures.ridges_mm2 <= 0 or not all(map(math.isfinite, measured)):
        return PrintQuality(0, reasons)
    score = (weights or load_quality_weights()).score(quality_features(figures, limit))
    return PrintQuality(round(float(score)), reasons)


def _reasons(f: QualityMeasures, dpi: float, limit: QualityLimits) -> list[Reason]:
    blurred = f.detail < limit.min_detail and f.concentration >= limit.min_concentration / 2
    if _is_far_off(f, limit, blurred=blurred):  # then no length or area is what it seems
        return [*_about_ink(f, limit), _wrong_resolution(f.peak_px, dpi)]
    found = _about_area(f, limit) + _about_ink(f, limit)
    if blurred:
        found.append(
            Reason("blurred", "edges of ridges are soft (hold still, focus, clean the sensor)")
        )
    shortest, longest = limit.periods_px
    odd = f.period_px < shortest or (f.period_px > longest and not blurred)  # blur lengthens it
    if odd and f.concentration >= limit.min_concentration:
        found.append(_wrong_resolution(f.period_px, dpi))
    return found


def _is_far_off(f: QualityMeasures, limit: QualityLimits, *, blurred: bool) -> bool:
    """Tell whether ridges lie as far apart, or as near, as no finger has them."""
    shortest, longest = limit.far_periods_px
    if blurred:
        longest *= limit.blur_lengthens
    if_short, if_long = limit.min_peak_shares
    return (f.peak_px < shortest and f.peak_share >= if_short) or (
        f.peak_px > longest and f.peak_share >= if_long
    )


def _about_area(f: QualityMeasures, limit: QualityLimits) -> list[Reason]:
    found = []
    if f.ridges_mm2 <= 0:
        found.append(Reason("no ridges", "no fingerprint is found in the image"))
    if f.image_mm2 < limit.min_image_mm2:
        side = math.sqrt(limit.min_image_mm2)
        found.append(
            Reason(
                "too small",
                f"the image shows {f.image_mm2:.0f} mm² of skin at most "
                f"(a larger sensor, {side:.0f} x {side:.0f} mm at least)",
            )
        )
    elif 0 < f.ridges_mm2 < limit.min_ridges_mm2:
        found.append(
            Reason(
                "partial",
                f"ridges on {f.ridges_mm2:.0f} mm² only (lay the whole fingertip on the sensor)",
            )
        )
    return found


def _about_ink(f: QualityMeasures, limit: QualityLimits) -> list[Reason]:
    if f.dark_share < limit.min_dark:
        return [Reason("too dry", "ridges are thin and broken (moisten the finger, press on)")]
    if f.dark_share > limit.max_dark:
        return [Reason("too wet", "ridges run together (dry the finger, press less)")]
    return []


def _wrong_resolution(period_px: float, dpi: float) -> Reason:
    """Return the reason for ridges that lie `period_px` apart, in pixels at 500 dpi."""
    usual = TYPICAL_PERIOD_PX * MM_PER_PX
    return Reason(
        WRONG_RESOLUTION,
        f"ridges lie {period_px * dpi / STANDARD_DPI:.1f} px apart, {period_px * MM_PER_PX:.2f} mm "
        f"at {dpi:g} dpi, and {usual:.2f} of most fingers: the resolution is probably not "
        f"{dpi:g} dpi but about {round(dpi * period_px / TYPICAL_PERIOD_PX, -1):.0f} dpi (set it)",
    )
