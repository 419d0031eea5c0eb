"""Likely causes of false matches and false non-matches, from the comparison itself."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from fpmatch.matching.result import Verification


FEW_MINUTIAE: Final = 20
SMALL_OVERLAP: Final = 0.5  # of the smaller print
LOW_AGREEMENT: Final = 0.4  # share of the minutiae in the overlap that are paired
POOR_QUALITY: Final = 35.0  # median over the minutiae, 0 to 100
STRETCHED_PX: Final = 5.0  # rms residual of the pairs at 500 dpi
ODD_ROTATION_DEG: Final = 60.0
ODD_SCALE: Final = 1.07  # beyond that of the resolutions


def explain_false_non_match(verification: Verification) -> tuple[str, ...]:
    """Return likely causes of a low score of two prints of one finger, as short phrases."""
    v = verification
    found = _poor_prints(v)
    if v.reason:
        found.append(v.reason)
    if v.transform is None:
        return tuple(found)
    odd = _odd_placement(v)
    if odd:  # measures under a wrong placement do not describe the prints
        return (*found, *(f"placed wrongly, it seems: {words}" for words in odd))
    if v.overlap < SMALL_OVERLAP:
        found.append(f"as placed they overlap by only {v.overlap:.0%} of the smaller print")
    if v.agreement < LOW_AGREEMENT:
        found.append(
            f"only {v.agreement:.0%} of the minutiae in the overlap are paired: "
            "found in one print and not in the other, or wrongly placed"
        )
    found += _stretch(v)
    return tuple(found) or (f"{len(v.pairs)} pairs agree; nothing stands out",)


def explain_false_match(verification: Verification) -> tuple[str, ...]:
    """Return evidence for and against prints of different fingers with a high score."""
    v = verification
    found = [
        f"{len(v.pairs)} pairs, {v.agreement:.0%} of the minutiae where they overlap, "
        "agree by chance"
    ]
    if v.overlap < SMALL_OVERLAP:
        found.append(
            f"they overlap by only {v.overlap:.0%} of the smaller print, which leaves little "
            "to disagree"
        )
    odd = [f"only {words}" for words in _odd_placement(v)]
    return (*found, *_stretch(v), *odd, *_poor_prints(v))


def _poor_prints(v: Verification) -> list[str]:
    found = []
    for name, side in (("probe", v.probe), ("reference", v.reference)):
        count = len(side.minutiae)
        if count < FEW_MINUTIAE:
            found.append(f"the {name} has only {count} minutiae")
        elif (quality := float(np.median(side.minutiae.quality))) < POOR_QUALITY:
            found.append(f"the {name} is poor: its minutiae have a median quality of {quality:.0f}")
    return found


def _stretch(v: Verification) -> list[str]:
    at_500_dpi = v.rms_px * STANDARD_DPI / v.reference.dpi
    if math.isfinite(at_500_dpi) and at_500_dpi > STRETCHED_PX:
        return [f"the pairs lie {at_500_dpi:.1f} px (rms, at 500 dpi) off each other"]
    return []


def _odd_placement(v: Verification) -> list[str]:
    if v.transform is None:
        return []
    found = []
    if abs(v.transform.rotation_deg) > ODD_ROTATION_DEG:
        found.append(f"after a turn by {abs(v.transform.rotation_deg):.0f}°")
    factor = v.transform.scale * v.probe.dpi / v.reference.dpi
    if max(factor, 1 / factor) > ODD_SCALE:
        found.append(f"after a change of size by {factor - 1:+.0%}")
    return found
