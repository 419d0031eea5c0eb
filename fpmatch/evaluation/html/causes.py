"""Why two prints came out alike or not, in words: what the comparison itself can tell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from fpmatch.matching.result import Verification


@dataclass(frozen=True, slots=True)
class CauseLimits:
    """Set from where on something counts as a cause.

    Parameters
    ----------
    few_minutiae : int
        A print with fewer says little.
    small_overlap : float
        Share of the smaller print; below, little can be compared.
    low_agreement : float
        Share of the minutiae in the overlap that are paired; below, extraction found different
        ones, or the prints lie wrong on each other.
    poor_quality : float
        Median quality of a print's minutiae, 0 to 100.
    stretched_px : float
        Residual of the pairs at 500 dpi; above, skin was stretched or the pairs are false.
    odd_turn_deg, odd_scale : float
        A turn, or a factor of size beyond those of resolution, that prints of one finger rarely
        need.
    """

    few_minutiae: int = 20
    small_overlap: float = 0.5
    low_agreement: float = 0.4
    poor_quality: float = 35.0
    stretched_px: float = 5.0
    odd_turn_deg: float = 60.0
    odd_scale: float = 1.07


LIMITS: Final = CauseLimits()


def explain_false_non_match(
    verification: Verification, limits: CauseLimits = LIMITS
) -> tuple[str, ...]:
    """Return likely causes for prints of one finger that were found little alike.

    Parameters
    ----------
    verification : Verification
        Their comparison.
    limits : CauseLimits
        From where on something is a cause.

    Returns
    -------
    tuple of str
        Short phrases; the matcher's own reason where there is no other.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template, verify
    >>> empty = Template(Minutiae.empty(), width=300, height=300)
    >>> explain_false_non_match(verify(empty, empty))[0]
    'the probe has only 0 minutiae'
    """
    v = verification
    found = _poor_prints(v, limits)
    if v.reason:
        found.append(v.reason)
    if v.transform is None:
        return tuple(found)
    odd = _odd_placement(v, limits)
    if odd:  # what is measured under a wrong placement says nothing of the prints
        return (*found, *(f"placed wrongly, it seems: {words}" for words in odd))
    if v.overlap < limits.small_overlap:
        found.append(f"as placed they overlap by only {v.overlap:.0%} of the smaller print")
    if v.agreement < limits.low_agreement:
        found.append(
            f"only {v.agreement:.0%} of the minutiae in the overlap are paired: "
            "found in one print and not in the other, or wrongly placed"
        )
    found += _stretch(v, limits)
    return tuple(found) or (f"{len(v.pairs)} pairs agree; nothing stands out",)


def explain_false_match(
    verification: Verification, limits: CauseLimits = LIMITS
) -> tuple[str, ...]:
    """Return what speaks for prints of different fingers that were found alike, and against them.

    Parameters
    ----------
    verification, limits
        As for `explain_false_non_match`.

    Returns
    -------
    tuple of str
        Short phrases.
    """
    v = verification
    found = [
        f"{len(v.pairs)} pairs, {v.agreement:.0%} of the minutiae where they overlap, "
        "agree by chance"
    ]
    if v.overlap < limits.small_overlap:
        found.append(
            f"they overlap by only {v.overlap:.0%} of the smaller print, which leaves little "
            "to disagree"
        )
    odd = [f"only {words}" for words in _odd_placement(v, limits)]
    return (*found, *_stretch(v, limits), *odd, *_poor_prints(v, limits))


def _poor_prints(v: Verification, limits: CauseLimits) -> list[str]:
    found = []
    for name, side in (("probe", v.probe), ("reference", v.reference)):
        count = len(side.minutiae)
        if count < limits.few_minutiae:
            found.append(f"the {name} has only {count} minutiae")
        elif (quality := float(np.median(side.minutiae.quality))) < limits.poor_quality:
            found.append(f"the {name} is poor: its minutiae have a median quality of {quality:.0f}")
    return found


def _stretch(v: Verification, limits: CauseLimits) -> list[str]:
    at_500_dpi = v.rms_px * STANDARD_DPI / v.reference.dpi
    if math.isfinite(at_500_dpi) and at_500_dpi > limits.stretched_px:
        return [f"the pairs lie {at_500_dpi:.1f} px (rms, at 500 dpi) off each other"]
    return []


def _odd_placement(v: Verification, limits: CauseLimits) -> list[str]:
    if v.transform is None:
        return []
    found = []
    if abs(v.transform.rotation_deg) > limits.odd_turn_deg:
        found.append(f"after a turn by {abs(v.transform.rotation_deg):.0f}°")
    factor = v.transform.scale * v.probe.dpi / v.reference.dpi
    if max(factor, 1 / factor) > limits.odd_scale:
        found.append(f"after a change of size by {factor - 1:+.0%}")
    return found
