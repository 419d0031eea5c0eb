"""Numbers outside the bounds of templates are refused in one line, in every format."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import TemplateError
from fpmatch.formats.files import decode_record
from fpmatch.matching.prints.prepared_prints import PreparedPrints
from fpmatch.matching.registry import get_matcher
from fpmatch.templates.bounds import (
    LEAST_STEP_PX,
    MOST_CELLS,
    MOST_PX,
    MOST_SIDE_PX,
    MOST_STEP_PX,
    check_bounds,
)
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from fpmatch.templates.stored_template import pack_template, unpack_template


@pytest.mark.parametrize(
    "data",
    [
        b"# fpmatch-template 1 width=9 height=9 dpi=500\nx,y,angle_deg,kind,quality\n"
        b"3e38,2,3,ending,50\n",
        b"x,y,angle_deg\n40000,1,2\n",
        b"99999 1 20\n",
        b"0 -40000 20 5\n",
    ],
    ids=["csv", "plain csv", "xyt", "xyt negative"],
)
def test_coordinates_of_other_formats_have_the_same_bounds(data):
    with pytest.raises(TemplateError, match=r"beyond|pixels") as caught:
        decode_record(data, "a")
    assert "\n" not in str(caught.value)


def near(least, most):
    """Draw numbers from a range, its ends often."""
    return st.floats(least, most) | st.sampled_from([least, most])


@st.composite
def extreme_templates(draw):
    """Draw templates anywhere within the bounds."""
    dpi = draw(near(100, 4000))
    zoom = 500 / dpi
    n = draw(st.integers(0, 8))
    column = st.lists(
        near(-MOST_PX + 2, MOST_PX - 2).map(lambda v: v / zoom), min_size=n, max_size=n
    )
    angle = draw(st.lists(st.floats(-1e30, 1e30), min_size=n, max_size=n))
    minutiae = Minutiae(draw(column), draw(column), angle)
    shape = draw(
        st.sampled_from([(0, 0), (1, 1), (3, 4), (1, MOST_SIDE_PX), (MOST_CELLS // 1024, 1024)])
    )
    mask = np.zeros(shape, bool)
    mask.flat[:: draw(st.integers(1, 9999))] = draw(st.booleans())
    step = draw(near(LEAST_STEP_PX * 1.01, MOST_STEP_PX * 0.99)) / zoom
    ridges = draw(st.sampled_from([None, np.full(shape, 3, np.uint64)]))
    field = RidgeField(step, np.full(shape, draw(st.floats(0, 3.14))), mask, ridges)
    sides = st.integers(1, MOST_SIDE_PX)
    return Template(minutiae, draw(sides), draw(sides), dpi, draw(st.sampled_from([None, field])))


@given(extreme_templates())
def test_what_is_within_the_bounds_can_be_kept_prepared_and_compared(template):
    """So nothing that passes at reading or enrolment can make a later search fail."""
    check_bounds(template)
    matcher = get_matcher("unit-circle")
    prepared = matcher.prepare(unpack_template(pack_template(template)))
    packed = PreparedPrints.pack([prepared])
    assert packed[0].key == prepared.key
    assert np.isfinite(matcher.compare(prepared, prepared).similarity)
