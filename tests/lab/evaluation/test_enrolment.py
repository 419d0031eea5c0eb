from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import MatcherError
from fpmatch.gallery.fingers.finger import fused_score
from fpmatch.lab.evaluation import enrolment, run
from fpmatch.lab.evaluation.databases import comparison
from fpmatch.lab.evaluation.databases.protocol import Impression
from fpmatch.lab.evaluation.enrolment import Enrolment, plan_enrolment
from fpmatch.matching.calibration import Calibration
from fpmatch.templates.minutiae import Minutiae, Template
from tests.lab.evaluation.made_sets import extracted_set

CURVE = Calibration(((0.0, 0.0), (1.0, 100.0)), tail_scale=1.0)


def impressions_of(fingers, numbers):
    return [Impression(f, n, Path(f"{f}_{n}.tif")) for f in fingers for n in range(1, numbers + 1)]


def extracted(name, places):
    """Return a database of one print for each (finger, x); None for no template."""
    made = [x if x is None else Template(Minutiae([x], [0.0], [0.0]), 10, 10) for _, x in places]
    return extracted_set({(places[k][0], k): one for k, one in enumerate(made)}, name)


@pytest.fixture
def fake(bench, monkeypatch):
    monkeypatch.setattr(comparison, "load_calibration", lambda name: CURVE)
    return bench.MATCHER


@given(st.integers(1, 4), st.integers(1, 5), st.one_of(st.none(), st.integers(0, 99)))
def test_every_other_impression_meets_every_enrolled_finger_once(fingers, count, seed):
    prints = impressions_of(range(fingers), 6)
    plan = plan_enrolment(prints, Enrolment(count, seed))
    assert len(plan.enrolled) == fingers
    taken = [k for group in plan.enrolled.values() for k in group]
    assert all(len({prints[k].finger for k in group}) == 1 for group in plan.enrolled.values())
    assert len(set(taken)) == fingers * count
    assert not set(taken) & set(plan.pairs.probe.tolist())
    assert set(plan.pairs.reference.tolist()) == set(plan.enrolled)
    assert len(plan.pairs) == fingers * fingers * (6 - count)
    assert int(plan.pairs.genuine.sum()) == fingers * (6 - count)
    if seed is None:
        assert {prints[k].number for k in taken} == set(range(1, count + 1))


def test_a_probe_has_the_score_of_the_finger(fake):
    prints = [(1, 0.0), (1, 9.0), (1, 1.0), (2, 99.0), (2, None), (2, 98.0), (3, None), (3, 7.0)]
    one = extracted("one", prints)
    report = run.evaluate_templates([one], matcher=fake, enrolment=Enrolment(2), workers=1)
    (row,) = report.sets
    pairs = zip(row.pairs.probe.tolist(), row.pairs.reference.tolist(), strict=True)
    outcomes = dict(zip(pairs, row.outcomes["similarity"].tolist(), strict=True))
    assert outcomes[2, 0] == pytest.approx(fused_score([100 / 2, 100 / 9]))
    assert outcomes[5, 3] == pytest.approx(50.0)  # the other impression has no template
    assert row.genuine == 2
    document = enrolment.enrolment_document(report, Enrolment(2))
    assert document["impressions"] == 2
    at_40 = document["scores"][-1]
    assert (at_40["stated_fmr"], at_40["fmr"], at_40["fnmr"]) == (pytest.approx(1e-4), 0.0, 0.0)
    words = enrolment.enrolment_text(document)
    assert words.startswith("Enrolled: 2 impressions of each finger, the first.")


def test_a_finger_without_any_template_scores_nothing(fake):
    one = extracted("one", [(1, None), (1, 1.0), (2, 2.0), (2, 2.5)])
    report = run.evaluate_templates([one], matcher=fake, enrolment=Enrolment(1), workers=1)
    reasons = report.sets[0].outcomes["reason"]
    assert reasons[report.sets[0].pairs.reference == 0].tolist() == ["no template"] * 2
    assert np.isfinite(report.sets[0].outcomes["similarity"]).all()


def test_a_matcher_without_calibration_is_refused(bench):
    one = extracted("one", [(1, 1.0), (1, 2.0)])
    with pytest.raises(MatcherError, match="no calibration"):
        run.evaluate_templates([one], matcher=bench.MATCHER, enrolment=Enrolment(1), workers=1)
