import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from matching_prints import EMPTY, spread_points, template_of

from fpmatch import extract, read_image
from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import load_calibration, score_to_fmr
from fpmatch.matching.registry import get_matcher, matcher_names
from fpmatch.matching.result import Comparison, Matcher
from fpmatch.matching.verify import verify
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.prints.report import as_dict, as_text

POINTS = spread_points(np.random.default_rng(1), 18, 20.0)
PROBE = template_of(POINTS)
IMPOSTOR = template_of(spread_points(np.random.default_rng(2), 18, 20.0))


@pytest.mark.parametrize("matcher", matcher_names())
def test_result_hands_on_what_the_matcher_found(matcher):
    chosen = get_matcher(matcher)
    prepared = chosen.prepare(PROBE), chosen.prepare(IMPOSTOR)
    compared = chosen.compare(*prepared)
    compared = chosen.explain(*prepared, compared)
    found = verify(PROBE, IMPOSTOR, matcher=matcher)
    assert found.matcher == matcher
    assert found.score == load_calibration(matcher).score(compared.similarity)
    assert found.fmr == score_to_fmr(found.score)
    assert found.pairs.tolist() == compared.pairs.tolist()
    for name in ("transform", "rms_px", "agreement", "overlap"):
        assert getattr(found, name) == getattr(compared, name)
    assert found.probe is PROBE
    assert found.reference is IMPOSTOR


@pytest.mark.parametrize("matcher", matcher_names())
def test_a_match_needs_no_reason_and_a_no_has_one(matcher):
    same = verify(PROBE, PROBE, matcher=matcher, threshold=1)
    assert same.match
    assert same.reason == ""
    for reference in (IMPOSTOR, EMPTY):
        other = verify(PROBE, reference, matcher=matcher, threshold=100)
        assert not other.match
        assert other.reason
        assert "\n" not in other.reason


def test_the_score_decides_from_the_threshold_on():
    # As little of the print as can be told from nothing, so that the score is not at an end.
    parts = (template_of(POINTS[:, :n].copy()) for n in range(3, 18))
    part, score = next((p, s) for p in parts if (s := verify(PROBE, p).score) > 0)
    assert score < 100
    assert verify(PROBE, part, threshold=score).match
    assert not verify(PROBE, part, threshold=math.nextafter(score, 100)).match


class _Halves(Matcher):
    """A matcher that nobody calibrated: half of the minutiae are always paired."""

    name = "halves"

    def __init__(self, rho):
        self.rho = rho

    def prepare(self, template):
        return template

    def compare(self, probe, reference):
        pairs = np.column_stack([np.arange(9, dtype=np.int32)] * 2)
        return Comparison(0.5, Similarity(), pairs, 1.0, 1.0, 1.0)


def test_a_matcher_with_a_rule_of_its_own_needs_no_calibration():
    found = verify(PROBE, PROBE, matcher=_Halves(0.4))
    assert found.match
    assert (found.matcher, found.rho, found.matched_share) == ("halves", 0.4, 0.5)
    assert math.isnan(found.score)
    assert not found.extrapolated
    assert not verify(PROBE, PROBE, matcher=_Halves(0.5)).match
    with pytest.raises(MatcherError, match="'halves' has no calibration"):
        verify(PROBE, PROBE, matcher=_Halves(0.4), threshold=1)
    document = as_dict(found, "a", "b")
    assert (document["score"], document["fmr"], document["threshold"]) == (None, None, None)
    assert (document["match"], document["rho"]) == (True, 0.4)
    text = as_text(found)
    assert "a match needs more than 0.4 of them (rho)" in text
    assert "Score       none: the matcher is not calibrated" in text
    assert "FMR" not in text


@pytest.mark.parametrize("second", ["101_3", "101_2"])
def test_the_map_of_ridges_is_of_the_number_that_the_score_used(second):
    """Both ways round: the cells are of either print."""
    samples = Path(__file__).parents[2] / "sample_data"
    prints = [extract(read_image(samples / f"{name}.tif")) for name in ("101_1", second)]
    for probe, reference in (prints, prints[::-1]):
        found = verify(probe, reference)
        assert found.ridge_map.mean == pytest.approx(found.compared.ridge_agreement, rel=1e-12)
        size = found.reference.width, found.reference.height
        assert ((found.ridge_map.xy > -8) & (found.ridge_map.xy < np.add(size, 8))).all()
    for matcher in ("unit-circle", "paper"):  # ridges were not compared
        assert verify(PROBE, PROBE, matcher=matcher).ridge_map is None


def test_without_ridges_a_verification_contains_what_was_compared():
    found = verify(PROBE, PROBE).compared
    assert found.minutiae == 36
    assert found.area_mm2 > 0
    assert (found.ridge_agreement, found.ridge_area_mm2) == (None, 0.0)
    nothing = verify(PROBE, EMPTY, threshold=0)  # no match at any threshold
    assert (nothing.match, nothing.score, nothing.fmr) == (False, 0.0, 1.0)
    assert (nothing.transform, nothing.pairs.shape, nothing.compared) == (None, (0, 2), None)
    assert verify(PROBE, PROBE, matcher="paper").compared is None


@pytest.mark.parametrize(
    ("options", "reason"),
    [({"threshold": one}, "threshold must lie in 0..100, not") for one in (-0.1, 100.1, math.nan)]
    + [({"matcher": one}, "is no subclass of fpmatch.matching.result.") for one in (3, None)],
)
def test_what_is_no_threshold_or_matcher_is_refused(options, reason):
    with pytest.raises(MatcherError) as caught:
        verify(EMPTY, EMPTY, **options)
    assert reason in str(caught.value)


def test_a_verification_equals_itself_alone_and_can_be_sent():
    found, again = verify(PROBE, IMPOSTOR), verify(PROBE, IMPOSTOR)
    assert found != again
    assert len({found, found, again}) == 2
    copy = pickle.loads(pickle.dumps(found))
    assert (copy.reason, copy.transform) == (found.reason, found.transform)
    assert copy.pairs.tolist() == found.pairs.tolist()
    assert copy.reachable_score == found.reachable_score
