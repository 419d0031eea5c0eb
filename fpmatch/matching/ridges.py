"""Ridges: the correlation of those of two prints, once their minutiae are paired."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching._ridge_kernel import RidgeCorrelator
from fpmatch.matching.align import aligner_of

if TYPE_CHECKING:
    from fpmatch.matching.align import Alignment
    from fpmatch.matching.prepare import PreparedTemplate


def ridge_correlation(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
) -> tuple[float, int]:
    """Correlate the ridges of two prints under an alignment.

    Every cell of A is mapped to B by the mesh of pairs around it. It and the cells
    that touch it may be shifted by up to half a ridge period to where they agree best.

    Parameters
    ----------
    a, b : PreparedTemplate
        The two prints.
    alignment : Alignment
        Of A with B.

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
    correlator = RidgeCorrelator(len(b))
    c, s, x, y = alignment.transform.tolist()
    aligner = aligner_of(a.points, b.points)
    with np.errstate(over="ignore", invalid="ignore"):  # of transforms that lead nowhere
        aligner.impose(alignment.partner, c, s, x, y)
        cells = correlator.compare(a.for_kernels(), b.for_kernels(), aligner.mesh, c, s, x, y)
    return correlator.correlation, cells
