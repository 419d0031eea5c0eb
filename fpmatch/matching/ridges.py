"""Ridges: how well those of two prints fall on one another, once their minutiae are paired."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fpmatch.matching._ridge_kernel import RidgeLens

if TYPE_CHECKING:
    from fpmatch.matching.align import Alignment
    from fpmatch.matching.prepare import PreparedTemplate


@dataclass(frozen=True, slots=True)
class RidgeParameters:
    """Set how ridges are laid on one another.

    Parameters
    ----------
    bend_sigma_px : float
        How far the displacement of a pair of minutiae reaches, in pixels at 500 dpi.
    stillness : float
        Weight of the belief that skin has not bent, in pairs of minutiae.
    """

    bend_sigma_px: float = 30.0
    stillness: float = 0.05


def ridge_correlation(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    parameters: RidgeParameters | None = None,
) -> tuple[float, int]:
    """Correlate the ridges of two prints under an alignment.

    Every cell of A is laid on B, displaced as the paired minutiae around it are. It and the cells
    that touch it may be shifted by up to half a ridge period to where they agree best.

    Parameters
    ----------
    a, b : PreparedTemplate
        The two prints.
    alignment : Alignment
        How A lies on B.
    parameters : RidgeParameters, optional
        How skin bends.

    Returns
    -------
    float
        Mean correlation of the cells, -1 to 1; about 0.2 for ridges of different fingers that run
        alike. 0 where there are none.
    int
        Number of cells compared: those that lie in both prints, at least three of the cells that
        touch them beside them; 0 where either print does not show its ridges.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.matching.align import identity_alignment
    >>> from fpmatch.matching.prepare import prepare
    >>> bare = prepare(Template(Minutiae(x=[20, 60], y=[20, 30], angle=[0, 1]), 100, 100))
    >>> ridge_correlation(bare, bare, identity_alignment(bare.points))
    (0.0, 0)
    """
    lens = RidgeLens(parameters or RidgeParameters(), len(a))
    c, s, x, y = alignment.transform.tolist()
    cells = lens.compare(a.for_kernels(), b.for_kernels(), alignment.partner, c, s, x, y)
    return lens.correlation, cells
