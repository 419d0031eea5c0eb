"""Error rates of a set of genuine and impostor scores, exact where scores are tied.

A comparison is a match where its score is at least the threshold t. Then

- FMR(t), the false match rate, is the share of impostor scores ≥ t;
- FNMR(t), the false non-match rate, is the share of genuine scores < t.

Only the order of the scores matters, so any increasing function of them gives the same rates.

References
----------
ISO/IEC 19795-1, "Biometric performance testing and reporting", for FMR and FNMR; Maio et al.,
"FVC2000: Fingerprint Verification Competition", PAMI 24 (2002), for EER, FMR100, FMR1000,
ZeroFMR and ZeroFNMR.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]

FMR_LIMITS: Final = {"fmr100": 1 / 100, "fmr1000": 1 / 1000, "fmr10000": 1 / 10_000}
"""The FMR at which each rate of that name gives the FNMR."""
POOLED: Final = "pooled"
"""The name of what all databases' scores together give."""
ROUNDING: Final = 1e-9
"""floor(share * n + ROUNDING) loses no comparison to the rounding of `share`."""


@dataclass(frozen=True, slots=True)
class Rates:
    """The error rates of a test, as fractions; None where the pairs do not allow one.

    `eer`: equal error rate; None without genuine or without impostor scores. `fmr100`, `fmr1000`,
    `fmr10000`: FNMR at the lowest threshold whose FMR is at most 1 %, 0.1 %, 0.01 %; None under
    100, 1,000, 10,000 impostor scores. `zero_fmr`: FNMR at the lowest threshold that no impostor
    score reaches. `zero_fnmr`: FMR at the highest threshold that every genuine score reaches.
    `d_prime`: decidability; no rate, see `d_prime`.
    """

    eer: float | None
    fmr100: float | None
    fmr1000: float | None
    fmr10000: float | None
    zero_fmr: float | None
    zero_fnmr: float | None
    d_prime: float | None = None


def error_rates(genuine: ArrayLike, impostor: ArrayLike) -> Rates:
    """Compute the error rates of genuine and impostor scores.

    `genuine`, `impostor` (G,): scores, greater for more similar prints; either may be empty. Raises
    a `DatasetError` if a score is not a finite number.

    Examples
    --------
    >>> from fpmatch.lab.evaluation.rates.error_rates import error_rates
    >>> error_rates([2, 3, 4, 5], [0, 0, 1, 3]).eer
    0.25
    """
    g, i = _sorted_scores("genuine", genuine), _sorted_scores("impostor", impostor)
    if not g.size or not i.size:
        return Rates(None, None, None, None, None, None)
    return Rates(
        eer=_equal_error_rate(*error_curves(g, i)),
        **{name: fnmr_at_fmr(g, i, fmr) for name, fmr in FMR_LIMITS.items()},
        zero_fmr=fnmr_at_fmr(g, i, 0.0),
        zero_fnmr=float((i.size - np.searchsorted(i, g[0], side="left")) / i.size),
        d_prime=d_prime(g, i),
    )


def mean_rates(rates: Iterable[Rates]) -> Rates:
    """Return the mean of each rate; None where one is."""
    columns = zip(*(astuple(one) for one in rates), strict=True)
    return Rates(*(None if None in column else float(np.mean(column)) for column in columns))


def d_prime(genuine: ArrayLike, impostor: ArrayLike) -> float | None:
    """Compute the decidability d': the distance of the means in units of the mean deviation.

    It is ``abs(mean(g) - mean(i)) / sqrt((var(g) + var(i)) / 2)``, which describes normal scores
    well and others poorly; None where a side is empty or no score varies.

    References
    ----------
    Daugman, "The importance of being random: statistical principles of iris recognition", Pattern
    Recognition 36 (2003).

    Examples
    --------
    >>> from fpmatch.lab.evaluation.rates.error_rates import d_prime
    >>> d_prime([3, 5], [0, 2])
    3.0
    """
    g, i = np.asarray(genuine, np.float64), np.asarray(impostor, np.float64)
    if not g.size or not i.size:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        deviation = float(np.sqrt((g.var() + i.var()) / 2))
        distance = abs(float(g.mean() - i.mean()))
    return distance / deviation if 0 < deviation < math.inf else None


def fnmr_at_fmr(genuine: ArrayLike, impostor: ArrayLike, fmr: float) -> float | None:
    """Return the FNMR at the lowest threshold whose FMR is at most `fmr`.

    None without genuine scores, or where `fmr` is less than one of the impostor scores.

    Examples
    --------
    >>> from fpmatch.lab.evaluation.rates.error_rates import fnmr_at_fmr
    >>> fnmr_at_fmr([1, 2, 3, 4], [0, 1, 2, 3], 0.25)
    0.5
    """
    g, highest = _sorted_scores("genuine", genuine), threshold_at_fmr(impostor, fmr)
    if not g.size or highest is None:
        return None
    return float(np.searchsorted(g, highest, side="right") / g.size)


def error_curves(genuine: ArrayLike, impostor: ArrayLike) -> tuple[Floats, Floats]:
    """Compute FMR and FNMR (N,) at every distinct score in increasing order, then at infinity.

    FMR falls from 1 to 0, FNMR rises from 0 to 1. `genuine`, `impostor` (G,): scores, greater for
    more similar prints. Raises a `DatasetError` if a score is not a finite number, or a side has
    none.

    Examples
    --------
    >>> from fpmatch.lab.evaluation.rates.error_rates import error_curves
    >>> fmr, fnmr = error_curves([1, 2], [0, 1])
    >>> fmr.tolist(), fnmr.tolist()
    ([1.0, 0.5, 0.0, 0.0], [0.0, 0.0, 0.5, 1.0])
    """
    g, i = _sorted_scores("genuine", genuine), _sorted_scores("impostor", impostor)
    if not g.size or not i.size:
        raise DatasetError("error curves need at least one genuine and one impostor score")
    threshold = np.append(np.unique(np.concatenate([g, i])), np.inf)
    fmr = (i.size - np.searchsorted(i, threshold, side="left")) / i.size
    return fmr, np.searchsorted(g, threshold, side="left") / g.size


def threshold_at_fmr(impostor: ArrayLike, fmr: float) -> float | None:
    """Return the highest impostor score that must not match for an FMR of at most `fmr`, under 1.

    The lowest threshold is just above it. None where `fmr` is less than one of the scores.
    """
    i = _sorted_scores("impostor", impostor)
    allowed = math.floor(fmr * i.size + ROUNDING)
    if not i.size or (fmr > 0 and allowed < 1):
        return None
    return float(i[i.size - 1 - allowed])


def _equal_error_rate(fmr: Floats, fnmr: Floats) -> float:
    """Return where the polyline through the (FMR, FNMR) points crosses FMR = FNMR."""
    surplus = fmr - fnmr  # falls from 1 to -1
    after = int(np.argmax(surplus <= 0))
    share = surplus[after - 1] / (surplus[after - 1] - surplus[after])
    return float(fmr[after - 1] + share * (fmr[after] - fmr[after - 1]))


def _sorted_scores(name: str, scores: ArrayLike) -> Floats:
    array = np.sort(np.asarray(scores, dtype=np.float64).ravel())
    if not np.isfinite(array).all():
        raise DatasetError(f"{name} scores must be finite numbers")
    return array
