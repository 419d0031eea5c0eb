"""Several fingers of a subject: the score of all from the score of each, by Fisher's rule.

The score of a finger is ``-10·log10`` of the rate p at which other fingers score as high. Where the
fingers are independent, the rate at which fingers of another subject reach the product P of the n
rates is the tail of a chi-squared variable of 2n degrees of freedom at ``-2·ln P``, which is
``P·(1 + L + L²/2 + … + L^(n-1)/(n-1)!)`` with ``L = -ln P``.

References
----------
Fisher, "Statistical Methods for Research Workers", 4th edition (1932), section 21.1.
"""

from __future__ import annotations

import math
from collections import Counter
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.calibration import MAX_SCORE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_DECIBEL: Final = 10.0 / math.log(10.0)  # score units a factor of e in FMR


def assign_fingers(
    scores: NDArray[np.float64], allowed: NDArray[np.bool_]
) -> tuple[float, list[tuple[int, int]]]:
    """Return the score of a subject's fingers, and which finger each probe is compared with.

    Of P probes of different fingers and F fingers of a subject, `allowed` (P, F) states which may
    be the same. Of the assignments of as many probes as possible to fingers of their own, the one
    of the highest score counts. Its false match rate is multiplied by the number of assignments,
    which is 1 where the positions of all fingers are known. The score is 0 where no probe may be
    one of the fingers; the pairs are each assigned probe and its finger, by probe.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch.gallery.fingers.fused_fingers import assign_fingers
    >>> two = np.array([[50.0, 10.0], [0.0, 40.0]])
    >>> score, pairs = assign_fingers(two, np.eye(2, dtype=bool))
    >>> round(score, 2), pairs
    (76.63, [(0, 0), (1, 1)])
    >>> round(assign_fingers(two, np.ones((2, 2), bool))[0], 2)
    73.62
    """
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415

    worth = np.where(allowed, scores + 2 * len(scores) * MAX_SCORE, 0.0)  # most pairs come first
    probes, fingers = linear_sum_assignment(worth, maximize=True)
    pairs = [
        (i, f) for i, f in zip(probes.tolist(), fingers.tolist(), strict=True) if allowed[i, f]
    ]
    if not pairs:
        return 0.0, []
    fused = fuse_fingers([float(scores[pair]) for pair in pairs])
    fused -= 10.0 * math.log10(_assignments(tuple(map(tuple, allowed.tolist()))))
    return min(max(0.0, fused), MAX_SCORE), pairs


def fuse_fingers(scores: Sequence[float]) -> float:
    """Return the score of a subject from its fingers' scores, in any order; it may be over 100.

    It is ``-10·log10`` of the rate at which as many fingers of other subjects score as high
    together; of one finger its own score.

    Examples
    --------
    >>> from fpmatch.gallery.fingers.fused_fingers import fuse_fingers
    >>> [round(fuse_fingers(scores), 2) for scores in ([40.0], [40.0, 0.0], [40.0, 40.0])]
    [40.0, 29.91, 67.12]
    """
    total = sum(sorted(scores))
    exponent = total / _DECIBEL
    term = series = 1.0
    for k in range(1, len(scores)):
        term = term * exponent / k
        series += term
    return total - _DECIBEL * math.log(series)


@lru_cache(maxsize=1024)
def _assignments(allowed: tuple[tuple[bool, ...], ...]) -> int:
    """Return the number of assignments of as many probes as possible."""
    some = [row for row in allowed if not all(row)]
    taken = {0: 1}  # fingers that these probes have, as bits: in how many ways
    for row in some:
        more = Counter(taken)
        for bits, ways in taken.items():
            for f, may in enumerate(row):
                if may and not bits >> f & 1:
                    more[bits | 1 << f] += ways
        taken = dict(more)
    fingers, free = len(allowed[0]), len(allowed) - len(some)  # the others may have any finger
    sizes = {bits: min(bits.bit_count() + free, fingers) for bits in taken}
    most = max(sizes.values())
    assignments = 0
    for bits, ways in taken.items():
        if sizes[bits] == most:
            left = fingers - bits.bit_count()
            assignments += ways * math.perm(max(left, free), min(left, free))
    return assignments
