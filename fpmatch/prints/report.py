"""A verification in words for people and as a dict for programs; decisions and rates in words."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from fpmatch.matching.calibration import MAX_SCORE
from fpmatch.printable import count, rotation_text
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.matching.result import Identity
    from fpmatch.matching.scale import ScaleMeasurement
    from fpmatch.matching.verify import Verification
    from fpmatch.pointset.geometry.similarity import Similarity


def verdict(match: bool) -> str:
    """Return the decision on two sets of points in capitals."""
    return "MATCH" if match else "NO MATCH"


def decision_in_words(verification: Verification) -> str:
    """Return the decision on two prints in capitals, and whether they are identical."""
    of = "images" if verification.identical == "pixels" else "templates"
    same = "" if verification.identical is None else f", identical {of}"
    return verification.decision.upper() + same


def outcome(verification: Verification) -> str:
    """Return `decision_in_words`, and what is missing for a decision."""
    shortage = verification.shortage
    return decision_in_words(verification) + ("" if shortage is None else f": {shortage.code}")


NEARLY_ALL: Final = "nearly all"
_NEARLY_ALL_FROM: Final = 0.95  # rates above round to 1 in 1


def odds(fmr: float) -> str:
    """Write a false match rate as one in so many."""
    if not 0 < fmr <= 1:
        return "unknown"
    if fmr > _NEARLY_ALL_FROM:
        return NEARLY_ALL
    n = 1 / fmr
    for size, word in ((1e9, " billion"), (1e6, " million")):
        if n >= size * 0.9995:
            return f"1 in {n / size:.2g}{word}" if n < 100 * size else f"1 in {n / size:.0f}{word}"
    if n < 10:
        return f"1 in {n:.1f}".removesuffix(".0")
    digits = max(0, math.floor(math.log10(n)) - 1)
    return f"1 in {round(n / 10**digits) * 10**digits:,}"


def score_as_high(rate: str) -> str:
    """Return the sentence about a false match rate, as `odds` writes it."""
    verb = "score" if rate.endswith(NEARLY_ALL) else "scores"
    return f"{rate} pairs of different fingers {verb} as high"


LABEL_WIDTH: Final = 12
IDENTITY: Final[dict[Identity, str]] = {
    "pixels": "the two images have the same pixels",
    "template": "the two templates are the same",
}
SELF_COMPARED: Final = (
    "an impression is compared with itself, so the score says nothing about other impressions"
)
MOST_STRETCH: Final = 1.15  # of one impression over another, where a finger was dragged


def as_text(
    verification: Verification,
    quality: Mapping[str, PrintQuality | None] | None = None,
) -> str:
    """Return decision, evidence and reason, the decision on the first line.

    The scale between the prints is included where it is not 1, the quality of their images, by name
    of the side, where they do not match.
    """
    rows = as_rows(verification, quality)
    lines = [f"  {label:<{LABEL_WIDTH}}{text}" for label, text in rows]
    return "\n".join([outcome(verification), *lines])


def as_rows(
    verification: Verification,
    quality: Mapping[str, PrintQuality | None] | None = None,
) -> list[tuple[str, str]]:
    """Return evidence and reason as (label, words), in the order that `as_text` has them in."""
    v = verification
    scored = not math.isnan(v.score)
    score = f"{v.score:.1f} on a scale to 100" if scored else "none: the matcher is not calibrated"
    rows: list[tuple[str, str]] = []
    if v.identical is not None:
        rows.append(("Identical", f"{IDENTITY[v.identical]}: {SELF_COMPARED}"))
    if ":" in v.matcher:
        rows.append(("Matcher", v.matcher))
    if v.rho is None:
        score += f"; a match needs {v.threshold:.1f}"
    else:
        score += "; not used: rho decides" if scored else ""
        share = f"{v.matched_share:.1%} of the minutiae of the smaller print are paired"
        rows.append(("Matched", f"{share}; a match needs more than {v.rho:.4g} of them (rho)"))
    rows.append(("Score", score))
    if scored and v.identical is None:
        rate = f"{'at most ' if v.score >= MAX_SCORE else ''}{odds(v.fmr)}"  # clipped there
        reach = f" (extrapolated: measured up to {odds(v.smallest_measured_fmr)})"
        caution = reach if v.fmr < v.smallest_measured_fmr else ""
        rows.append(("FMR", f"{score_as_high(rate)}{caution}"))
    pairs = count(len(v.pairs), "pair")
    sides = f"{len(v.probe.minutiae)} of the probe and {len(v.reference.minutiae)} of the reference"
    rows.append(("Minutiae", f"{pairs} among {sides}"))
    if v.transform is not None:
        common, ridges = [], []
        overlap = f"{v.overlap:.0%} of the smaller print"
        if (c := v.compared) is not None:
            overlap += f", {c.area_mm2:.0f} mm²"
            words = "not compared"
            if c.ridge_agreement is not None:
                words = f"agreement {c.ridge_agreement:.2f} on {c.ridge_area_mm2:.0f} mm²"
            ridges = [("Ridges", words)]
        if v.overlap:
            paired = f"{v.agreement:.0%} of the minutiae where the prints overlap are paired"
            common = [("Agreement", paired), ("Overlap", overlap)]
        rows += [
            *common,
            *ridges,
            ("Transform", transform_in_words(v.transform)),
            ("Residual", f"{v.rms_px:.1f} px rms"),
        ]
    if v.dpi_assumed:
        rows.append(("Resolution", "; ".join(_resolution(v, side) for side in v.dpi_assumed)))
    if v.reason:
        rows.append(("Missing" if v.shortage else "Reason", v.reason))
    if not v.match:
        judged = [(name, one) for name, one in (quality or {}).items() if one is not None]
        rows += [("Quality", f"{name}: {one}") for name, one in judged]
    if (scale := v.scale) is not None and scale.differs:
        words = _scale_in_words(scale, v.probe.dpi, v.reference.dpi)
        rows.append(("Scale", words if v.match else f"{words}; at that scale they match"))
    return rows


def as_dict(
    verification: Verification,
    probe: str | Path,
    reference: str | Path,
    quality: Mapping[str, PrintQuality | None] | None = None,
) -> dict[str, Any]:
    """Return the object that ``--json`` prints, of the files `probe` and `reference`.

    ``transform`` and ``rms_px`` are None where no transform was found, ``compared`` where the
    matcher does not measure it, ``rho`` where the score decides; ``score``, ``fmr`` and
    ``threshold`` where rho decides and the matcher is not calibrated; ``fmr`` also where an
    impression is compared with itself; ``identical`` where the prints differ; ``missing`` where
    there is a decision; ``reachable_score`` where the matcher gives no estimate.
    """
    t = verification.transform
    residual_known = t is not None and math.isfinite(verification.rms_px)
    score, fmr, threshold = (
        None if math.isnan(value) else float(value)
        for value in (verification.score, verification.fmr, verification.threshold)
    )
    return {
        "decision": verification.decision,
        "match": bool(verification.match),
        "score": score,
        "fmr": None if verification.identical else fmr,
        "extrapolated": bool(verification.extrapolated) and not verification.identical,
        "threshold": threshold,
        "matched_share": float(verification.matched_share),
        "rho": verification.rho,
        "matcher": verification.matcher,
        "pairs": len(verification.pairs),
        "transform": None
        if t is None
        else {"scale": t.scale, "rotation_deg": t.rotation_deg, "tx": t.tx, "ty": t.ty},
        "rms_px": float(verification.rms_px) if residual_known else None,
        "compared": None if verification.compared is None else asdict(verification.compared),
        "scale": None if verification.scale is None else asdict(verification.scale),
        "missing": None if verification.shortage is None else verification.shortage.code,
        "reachable_score": verification.reachable_score,
        "identical": verification.identical,
        "reason": verification.reason,
        "quality": {
            name: None if one is None else one.as_dict() for name, one in (quality or {}).items()
        },
        "probe": str(probe),
        "reference": str(reference),
    }


def _resolution(verification: Verification, side: str) -> str:
    """Return the resolution of a side that nothing states."""
    dpi = getattr(verification, side).dpi
    source = "assumed" if dpi == STANDARD_DPI else "by the ridges"
    return f"of the {side} {dpi:g} dpi, {source}"


def _scale_in_words(scale: ScaleMeasurement, probe_dpi: float, reference_dpi: float) -> str:
    """Return which resolutions would bring both prints to one scale."""
    stretched = max(scale.ratio, 1 / scale.ratio) < MOST_STRETCH
    skin = "unless the skin was stretched, " if stretched else ""
    return (
        f"the reference is {scale.ratio:.2f} times as large as the probe: {skin}the probe is of "
        f"about {probe_dpi / scale.ratio:.0f} dpi, not {probe_dpi:g}, or the reference of about "
        f"{reference_dpi * scale.ratio:.0f}, not {reference_dpi:g}"
    )


def transform_in_words(transform: Similarity) -> str:
    """Return how the probe moves onto the reference; on screen y points down."""
    return (
        f"rotation {rotation_text(transform.rotation_deg)}, scale {transform.scale:.3f}, "
        f"shift {transform.tx:+.1f} px right, {transform.ty:+.1f} px down"
    )
