"""Numbers outside the bounds of templates are refused in one line, in every format."""

import numpy as np
import pytest
from hypothesis import given

from fpmatch.errors import TemplateError
from fpmatch.formats.files import decode_record
from fpmatch.matching.registry import get_matcher
from fpmatch.templates.bounds import check_bounds
from tests.matching.extreme_prints import extreme_templates


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


@given(extreme_templates())
def test_what_is_within_the_bounds_can_be_prepared_and_compared(template):
    """So nothing that passes at reading can make a later comparison fail."""
    check_bounds(template)
    matcher = get_matcher("unit-circle")
    prepared = matcher.prepare(template)
    assert np.isfinite(matcher.compare(prepared, prepared).similarity)
