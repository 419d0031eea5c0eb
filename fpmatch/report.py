"""A verification in words for people and as a dict for programs."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from fpmatch.drawing.words import odds, verdict
from fpmatch.matching.calibration import MAX_SCORE

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.matching.result import Compared, Verification
    from fpmatch.pointset.similarity import Similarity
    from fpmatch.scale import ScaleMeasurement

LABEL_WIDTH: Final = 12
MOST_STRETCH: Final = 1.15  # of one impression over another, where a finger was dragged


def as_text(
    verification: Verification,
    scale: ScaleMeasurement | None = None,
    quality: Mapping[str, PrintQuality | None] | None = None,
) -> str:
    """Return decision, evidence and reason, the decision on the first line.

    The scale between the prints is included where it is not 1, the quality of their images, by name
    of the side, where they do not match.
    """
    rows = as_rows(verification, scale, quality)
    lines = (f"  {label:<{LABEL_WIDTH}}{text}" for label, text in rows)
    return "\n".join([verdict(verification.match), *lines])


def as_rows(
    verification: Verification,
    scale: ScaleMeasurement | None = None,
    quality: Mapping[str, PrintQuality | None] | None = None,
) -> list[tuple[str, str]]:
    """Return evidence and reason as (label, words), in the order that `as_text` has them in."""
    v = verification
    bound = "at most " if v.score >= MAX_SCORE else ""  # the score is clipped there
    caution = (
        f" (extrapolated: measured up to {odds(v.smallest_measured_fmr)})" if v.extrapolated else ""
    )
    rows = _decision_rows(v)
    if not math.isnan(v.score):
        rows.append(
            ("FMR", f"{bound}{odds(v.fmr)} pairs of different fingers scores as high{caution}")
        )
    rows += [
        (
            "Minutiae",
            f"{len(v.pairs)} pair{'s' * (len(v.pairs) != 1)} among {len(v.probe.minutiae)} of the "
            f"probe and {len(v.reference.minutiae)} of the reference",
        ),
    ]
    if v.transform is not None:
        rows += [
            (
                "Agreement",
                f"{v.agreement:.0%} of the minutiae where the prints overlap are paired",
            ),
            ("Overlap", f"{v.overlap:.0%} of the smaller print{_area(v)}"),
            *_ridge_rows(v),
            ("Transform", transform_in_words(v.transform)),
            ("Residual", f"{v.rms_px:.1f} px rms"),
        ]
    if v.reason:
        rows.append(("Reason", v.reason))
    if not v.match:
        judged = [(name, one) for name, one in (quality or {}).items() if one is not None]
        rows += [("Quality", f"{name}: {one}") for name, one in judged]
    if scale is not None and scale.differs:
        words = scale_in_words(scale, v.probe.dpi, v.reference.dpi)
        rows.append(("Scale", words if v.match else f"{words}; at that scale they match"))
    return rows


def _area(v: Verification) -> str:
    return "" if v.compared is None else f", {v.compared.area_mm2:.0f} mm2"


def _ridge_rows(v: Verification) -> list[tuple[str, str]]:
    """Return how well the ridges agree, and how much they add to the score."""
    if v.compared is None:
        return []
    if v.compared.ridge_agreement is None:
        return [("Ridges", "not compared")]
    words = ridges_in_words(v.compared)
    return [("Ridges", words if math.isnan(v.score) else f"{words} of the score")]


def ridges_in_words(compared: Compared) -> str:
    """Return the agreement of the ridges, on what area, and about how much they add to the score.

    Examples
    --------
    >>> from fpmatch.matching.result import Compared
    >>> ridges_in_words(Compared(40, 120.0, 0.81, 104.0, 17.24))
    'agreement 0.81 on 104 mm2, about +17.2'
    """
    return (
        f"agreement {compared.ridge_agreement:.2f} on {compared.ridge_area_mm2:.0f} mm2, about "
        f"{compared.ridge_score:+.1f}"
    )


def _decision_rows(v: Verification) -> list[tuple[str, str]]:
    """Return what decided, and the score."""
    if v.rho is None:
        return [("Score", f"{v.score:.1f} on a scale to 100; a match needs {v.threshold:.1f}")]
    if math.isnan(v.score):
        score = "none: the matcher is not calibrated"
    else:
        score = f"{v.score:.1f} on a scale to 100; it does not decide here"
    share = (
        f"{v.matched_share:.1%} of the minutiae of the smaller print are paired; a match needs "
        f"more than {v.rho:.4g} of them (rho)"
    )
    return [("Matched", share), ("Score", score)]


def as_dict(
    verification: Verification,
    probe: str | Path,
    reference: str | Path,
    scale: ScaleMeasurement | None = None,
    quality: Mapping[str, PrintQuality | None] | None = None,
) -> dict[str, Any]:
    """Return the object that ``--json`` prints.

    Parameters
    ----------
    verification : Verification
        The decision and its evidence.
    probe, reference : str or Path
        Names of the files compared.
    scale : ScaleMeasurement, optional
        The scale between the prints, where it is known.
    quality : mapping of str to PrintQuality or None, optional
        Of the images of "probe" and "reference"; None for a template.

    Returns
    -------
    dict
        JSON values only; ``transform`` and ``rms_px`` are None where no transform was found,
        ``pairs`` is their number; ``compared`` is None where the matcher does not say how much
        was compared; ``rho`` is None where the score decides, ``score``, ``fmr`` and
        ``threshold`` are None where rho decides and the matcher is not calibrated.
    """
    t = verification.transform
    found = t is not None and math.isfinite(verification.rms_px)
    return {
        "match": bool(verification.match),
        "score": _number(verification.score),
        "fmr": _number(verification.fmr),
        "extrapolated": bool(verification.extrapolated),
        "threshold": _number(verification.threshold),
        "matched_share": float(verification.matched_share),
        "rho": verification.rho,
        "pairs": len(verification.pairs),
        "transform": None
        if t is None
        else {"scale": t.scale, "rotation_deg": t.rotation_deg, "tx": t.tx, "ty": t.ty},
        "rms_px": float(verification.rms_px) if found else None,
        "compared": None if verification.compared is None else asdict(verification.compared),
        "scale": None if scale is None else asdict(scale),
        "reason": verification.reason,
        "quality": {
            name: None if one is None else one.as_dict() for name, one in (quality or {}).items()
        },
        "probe": str(probe),
        "reference": str(reference),
    }


def _number(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


def scale_in_words(scale: ScaleMeasurement, probe_dpi: float, reference_dpi: float) -> str:
    """Return which resolutions would bring both prints to one scale."""
    skin = "unless the skin was stretched, " if _is_within_stretch(scale.ratio) else ""
    return (
        f"the reference is {scale.ratio:.2f} times as large as the probe: {skin}the probe is of "
        f"about {probe_dpi / scale.ratio:.0f} dpi, not {probe_dpi:g}, or the reference of about "
        f"{reference_dpi * scale.ratio:.0f}, not {reference_dpi:g}"
    )


def _is_within_stretch(ratio: float) -> bool:
    return max(ratio, 1 / ratio) < MOST_STRETCH


def transform_in_words(transform: Similarity) -> str:
    """Return how the probe moves onto the reference; on screen y points down."""
    degrees = transform.rotation_deg
    sense = "clockwise" if degrees >= 0 else "counter-clockwise"
    return (
        f"rotation {abs(degrees):.1f}° {sense}, scale {transform.scale:.3f}, "
        f"shift {transform.tx:+.1f} px right, {transform.ty:+.1f} px down"
    )
