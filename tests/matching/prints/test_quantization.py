from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from matching_prints import any_points, flow_of, seeds

from fpmatch.matching.constants.prints import ORIENTATIONS
from fpmatch.matching.prints.neighbourhood import neighbourhoods
from fpmatch.matching.prints.prepared import ROOT_WEIGHTS, qualities, root_weight_codes, rounded
from fpmatch.matching.prints.print_area import orientation_codes
from fpmatch.templates.plausibility import FEW_MINUTIAE, LEAST_EVEN, LEAST_EVEN_OF_FEW


def test_every_orientation_has_a_code_and_comes_back_from_it():
    orientation = np.linspace(0, np.pi, 5001)[None]
    mask = np.ones(orientation.shape, bool)
    codes = orientation_codes(orientation, mask)
    assert set(codes.ravel().tolist()) == set(range(1, ORIENTATIONS + 1))
    cosine, sine = flow_of(codes)
    off = np.angle(np.exp(2j * orientation) * (cosine - 1j * sine))
    assert np.abs(off).max() <= np.pi / ORIENTATIONS + 1e-9
    known = np.arctan2(sine, cosine) / 2 % np.pi
    assert orientation_codes(known, mask).tolist() == codes.tolist()


def test_outside_the_mask_there_is_no_orientation():
    orientation = np.array([[np.nan, 1.0, np.inf]])
    codes = orientation_codes(orientation, np.array([[False, True, False]]))
    assert (codes > 0).tolist() == [[False, True, False]]
    assert not flow_of(codes)[:, codes == 0].any()


@given(seeds)
def test_rounding_is_slight_and_rounds_no_further_a_second_time(seed):
    exact = neighbourhoods(any_points(seed))
    before = exact.frame.copy()
    once = rounded(exact).frame.copy()
    assert once[:, :5].tolist() == before[:, :5].tolist()
    few = np.minimum(before[:, 5], ROOT_WEIGHTS[-1])
    assert once[:, 5] == pytest.approx(few, abs=0.00501)
    assert rounded(exact).frame.tolist() == once.tolist()


def test_a_weight_beyond_all_codes_takes_the_last():
    codes = root_weight_codes(np.array([0.0, 1.0, 2.55, 9.0], np.float32))
    assert codes.tolist() == [0, 100, 255, 255]


@given(seeds)
def test_qualities_that_few_minutiae_have_are_the_usual_one(seed):
    rng = np.random.default_rng(seed)
    quality = rng.choice([0, 40, 100], 9, p=rng.dirichlet(np.full(3, 0.3))).astype(np.uint8)
    start = np.array([0, *np.sort(rng.integers(0, 10, 2)), 9], np.int64)

    def expected_of(part):
        squares = part.astype(float) ** 2
        given_ = part.any() and not (part == 100).all()
        least = LEAST_EVEN if len(part) >= FEW_MINUTIAE else LEAST_EVEN_OF_FEW
        even = given_ and np.minimum(squares, squares.mean()).mean() >= least * squares.mean()
        return part / 100 if even else np.full(len(part), 0.7)

    expected = [expected_of(quality[a:b]) for a, b in pairwise(start)]
    assert qualities(quality, start, 0.7).tolist() == np.concatenate(expected).tolist()
