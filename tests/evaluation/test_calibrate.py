from __future__ import annotations

import numpy as np
import pytest

import fpmatch
from fpmatch.errors import MatcherError
from fpmatch.evaluation.calibrate import calibrate
from fpmatch.evaluation.run import evaluate
from fpmatch.matching.calibration import fit_calibration


def test_fits_the_impostors_of_all_sets_without_failed_prints(bench, make_database):
    folders = [make_database(name, fingers=10, contents={"3_3": "broken"}) for name in "ab"]
    report = evaluate(folders, matcher=bench.MATCHER, extractor=bench.extractor, workers=1)
    calibration = calibrate(report, command="here")
    impostors = np.concatenate([r.outcomes["similarity"][~r.pairs.genuine] for r in report.sets])
    expected = fit_calibration(impostors[impostors > 0])
    assert calibration.knots == expected.knots
    assert (calibration.tail_scale, calibration.tail_shape) == (
        expected.tail_scale,
        expected.tail_shape,
    )
    origin = calibration.provenance
    assert origin.sets == ("a", "b")
    assert origin.impostors == 2 * (720 - 36)
    assert (origin.version, origin.command) == (fpmatch.__version__, "here")


def test_too_few_impostors(bench, make_database):
    report = evaluate(
        [make_database()], matcher=bench.MATCHER, extractor=bench.extractor, workers=1
    )
    with pytest.raises(MatcherError, match="160 impostor comparisons are too few"):
        calibrate(report)
