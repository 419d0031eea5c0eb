"""A verification in words for people and as a dict for programs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fpmatch.drawing.caption import facts, verdict

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.matching.result import Verification

LABEL_WIDTH = 28


def as_text(verification: Verification) -> str:
    """Return decision, evidence and reason, the decision alone on the first line."""
    score = f"{verification.score:.1f} of 100 (a match needs {verification.threshold:.1f})"
    rows = [("Score", score), *facts(verification)]
    if verification.reason:
        rows.append(("Why", verification.reason))
    return "\n".join(
        [verdict(verification), *(f"  {label:<{LABEL_WIDTH}}{value}" for label, value in rows)]
    )


def as_dict(verification: Verification, probe: Path, reference: Path) -> dict[str, Any]:
    """Return the object that ``--json`` prints.

    Parameters
    ----------
    verification : Verification
        The decision and its evidence.
    probe, reference : Path
        The files compared.

    Returns
    -------
    dict
        JSON values only; ``transform`` and ``rms_px`` are None where no transform was found,
        ``pairs`` is their number.
    """
    t = verification.transform
    found = t is not None and math.isfinite(verification.rms_px)
    return {
        "match": bool(verification.match),
        "score": float(verification.score),
        "fmr": float(verification.fmr),
        "threshold": float(verification.threshold),
        "pairs": len(verification.pairs),
        "transform": None
        if t is None
        else {"scale": t.scale, "rotation_deg": t.rotation_deg, "tx": t.tx, "ty": t.ty},
        "rms_px": float(verification.rms_px) if found else None,
        "reason": verification.reason,
        "probe": str(probe),
        "reference": str(reference),
    }
