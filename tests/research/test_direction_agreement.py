import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import TemplateError
from fpmatch.templates.minutiae import Minutiae, Template
from research.experiments.direction_agreement import (
    Agreement,
    compare_directions,
    measure_agreement,
)
from tests.lab.evaluation.made_sets import extracted_set

ONE = Minutiae(x=[50], y=[50], angle=[1.0])


def turned(minutiae, degrees):
    return Minutiae(minutiae.x, minutiae.y, minutiae.angle + np.radians(degrees))


@pytest.mark.parametrize(
    ("degrees", "agreeing", "flipped"),
    [(0, 1, 0), (29, 1, 0), (-29, 1, 0), (31, 0, 0), (149, 0, 0), (151, 0, 1), (-170, 0, 1)],
)
@pytest.mark.parametrize("angle", [1.0, 0.05, 6.25])  # the last two on either side of zero
def test_one_pair_by_its_turn(degrees, agreeing, flipped, angle):
    one = Minutiae(x=[50], y=[50], angle=[angle])
    assert compare_directions(one, turned(one, degrees)) == Agreement(1, agreeing, flipped)


@pytest.mark.parametrize(("distance", "pairs"), [(0, 1), (8, 1), (8.5, 0)])
def test_only_near_minutiae_are_compared(distance, pairs):
    moved = Minutiae(ONE.x + np.float32(distance), ONE.y, ONE.angle)
    assert compare_directions(ONE, moved).pairs == pairs


def test_a_minutia_is_compared_once_and_with_the_nearest():
    theirs = Minutiae(x=[53, 51], y=[50, 50], angle=[1.0, 1.0 + np.pi])
    assert compare_directions(ONE, theirs) == Agreement(1, 0, 1)
    nothing = compare_directions(Minutiae.empty(), ONE)
    assert nothing == compare_directions(ONE, Minutiae.empty()) == Agreement()
    assert math.isnan(nothing.agreeing_share)
    assert math.isnan(nothing.flipped_share)
    total = Agreement(4, 3, 1) + Agreement(6, 3, 0)
    assert total == Agreement(10, 6, 1)
    assert (total.agreeing_share, total.flipped_share) == (0.6, 0.1)


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_a_wrong_convention_is_recognised(seed, count):
    ours = Minutiae(*np.random.default_rng(seed).uniform(0, (400, 400, 7), (count, 3)).T)
    for degrees, agreeing, flipped in ((0, count, 0), (180, 0, count), (90, 0, 0)):
        found = compare_directions(ours, turned(ours, degrees))
        assert found == Agreement(count, agreeing, flipped)


def extracted(*templates):
    return extracted_set({(101, k): one for k, one in enumerate(templates, start=1)})


def test_a_database_is_all_its_impressions_but_those_without_a_template(tmp_path):
    for k, degrees in enumerate((57.3, 237.3, 0), start=1):
        (tmp_path / f"101_{k}.csv").write_text(f"x,y,theta\n52,50,{degrees}\n")
    template = Template(ONE, 100, 100)
    assert measure_agreement(extracted(template, template, None), tmp_path) == Agreement(2, 1, 1)
    with pytest.raises(TemplateError, match=r"101_4\.csv: "):
        measure_agreement(extracted(template, template, None, template), tmp_path)
