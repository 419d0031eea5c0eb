"""Numbers outside the bounds of templates are refused in one line, in every format."""

import json

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


def json_file(**changes):
    """Return a JSON template with some members, or those of its parts, changed."""
    field = {"step": 16.0, "rows": 1, "columns": 2, "orientation": "AAAAAAAAAAA=", "mask": "wA=="}
    columns = {"x": [10.0], "y": [20.0], "angle": [1.0], "kind": [1], "quality": [50]}
    document = {"format": "fpmatch-template", "version": 2}
    document |= {"width": 300, "height": 400, "dpi": 500.0}
    document |= {"minutiae": columns, "ridge_field": field}
    for name, value in changes.items():
        part = next((p for p in (columns, field) if name in p), document)
        part[name] = value
    return json.dumps(document).encode()


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"step": 1e-50}, "step of 1e-50"),
        ({"step": 5e-324}, "step of 4.94066e-324"),
        ({"step": 1e30}, "step of 1e"),
        ({"step": 0.4, "dpi": 4000.0}, "step of 0.4"),
        ({"step": 10**400}, "finite"),
        ({"x": [3e38]}, "an x of 3e"),
        ({"x": [-4e4]}, "an x of -40000"),
        ({"y": [7e3], "dpi": 100.0}, "a y of 7000"),
        ({"angle": [3e300]}, "angle must be a list of finite numbers"),
        ({"quality": [-1]}, "quality"),
        ({"width": 70_000}, "65535"),
        ({"width": 10**30}, "65535"),
        ({"dpi": 1e-50}, "dpi"),
        ({"dpi": 3e38}, "dpi"),
        ({"rows": 10**9, "columns": 10**9}, "more than 1048576 cells"),
        ({"rows": 1 << 21, "columns": 1}, "more than 1048576 cells"),
    ],
)
def test_a_json_template_outside_the_bounds_is_refused(changes, why):
    decode_record(json_file(), "a.json")
    with pytest.raises(TemplateError, match=why) as caught:
        decode_record(json_file(**changes), "a.json")
    assert str(caught.value).startswith("a.json: ")
    assert "\n" not in str(caught.value)


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
