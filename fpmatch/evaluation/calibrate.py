"""Measure what a matcher's similarity is worth, on the impostor pairs of some databases."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch._version import __version__
from fpmatch.matching.calibration import Calibration, Provenance, fit_calibration

if TYPE_CHECKING:
    from fpmatch.evaluation.report import EvaluationReport


def calibrate(report: EvaluationReport, command: str = "") -> Calibration:
    """Fit a calibration to the impostor comparisons of an evaluation, all databases together.

    Pairs with an image that gave no template are left out: their similarity of 0 would make the
    matcher look more certain than it is.

    Parameters
    ----------
    report : EvaluationReport
        An evaluation by the extended protocol, which has impostors enough.
    command : str
        What ran it, kept in the calibration's provenance.

    Returns
    -------
    Calibration
        The calibration, with its provenance.

    Raises
    ------
    MatcherError
        If there are too few impostor comparisons, or too few distinct similarities.
    """
    impostors = np.concatenate(
        [
            row.outcomes["similarity"][~row.pairs.genuine & np.isfinite(row.outcomes["cpu_us"])]
            for row in report.sets
        ]
    )
    provenance = Provenance(
        sets=tuple(row.name for row in report.sets),
        impostors=int(impostors.size),
        version=__version__,
        command=command,
    )
    return fit_calibration(impostors, provenance=provenance)
