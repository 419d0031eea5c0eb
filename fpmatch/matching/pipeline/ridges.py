"""The correlation of the ridges of two prints, and the alignment of prints by their ridges."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.pipeline._kernels._ridge_kernel import RidgeCorrelator
from fpmatch.matching.pipeline.alignment import aligner_of

if TYPE_CHECKING:
    from fpmatch.matching.pipeline.alignment import Alignment
    from fpmatch.matching.prepare import PreparedTemplate


@dataclass(frozen=True, slots=True)
class RidgeSearchParameters:
    """Set the search for alignments by the ridges (`_ridge_search_kernel`); px at 500 dpi.

    The agreement of the orientation is the mean cosine of twice the difference, -1 to 1.
    """

    compared: int = 64  # pairs of minutiae whose ridges are compared, of a small print; 1 to 128
    found: int = 4  # pairs by which a small print is aligned; 1 to 8
    candidates: int = 3  # local matches whose ridges are compared, of larger prints; 1 to 128
    candidate_flow: float = 0.9  # least agreement of their orientation
    candidate_value: float = 3.0  # least surplus of their correlation, times the root of the cells
    least_common: float = 0.25  # share of the smaller print that must lie in the larger
    least_flow: float = 0.8  # least agreement of the orientation, for a small print
    usual_correlation: float = 0.2  # of the ridges of different fingers
    apart_px: float = 12.0  # between the images of a print's middle under different transforms,
    apart_deg: float = 12.0  # or between their rotations

    @property
    def apart_cosine(self) -> float:
        """Cosine of `apart_deg`."""
        return math.cos(math.radians(self.apart_deg))


def correlate(
    a: PreparedTemplate, b: PreparedTemplate, alignment: Alignment
) -> tuple[RidgeCorrelator, int]:
    """Correlate the ridges of two prints under an alignment of A with B.

    Every cell of A is mapped to B by the mesh of pairs around it. It and the cells
    that touch it may be shifted by up to half a ridge period to where they agree best.

    Returns
    -------
    RidgeCorrelator
        The correlator that has compared them: its ``correlation`` is the mean of the cells, -1 to
        1; about 0.2 for different fingers whose ridges have the same orientation. 0 where there
        are none.
    int
        Number of cells compared: those that lie in both prints, at least three of the cells that
        touch them beside them; 0 where either print does not show its ridges.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.matching.pipeline.alignment import identity_alignment
    >>> from fpmatch.matching.prepare import prepare
    >>> bare = prepare(Template(Minutiae(x=[20, 60], y=[20, 30], angle=[0, 1]), 100, 100))
    >>> correlator, cells = correlate(bare, bare, identity_alignment(bare.points))
    >>> correlator.correlation, cells
    (0.0, 0)
    """
    correlator = RidgeCorrelator(len(b))
    c, s, x, y = alignment.transform.tolist()
    aligner = aligner_of(a.points, b.points)
    with np.errstate(over="ignore", invalid="ignore"):  # of transforms that lead nowhere
        aligner.impose(alignment.partner, c, s, x, y)
        cells = correlator.compare(a.for_kernels(), b.for_kernels(), aligner.mesh, c, s, x, y)
    return correlator, cells
