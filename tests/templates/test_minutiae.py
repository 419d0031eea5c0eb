"""`fpmatch.templates.minutiae`: numbers beyond the range of minutiae and templates are refused."""

import pytest

from fpmatch.errors import MinutiaeError, ResolutionError
from fpmatch.templates.minutiae import Minutiae, Template


@pytest.mark.parametrize("value", [10**400, float("inf"), float("nan"), 1e39, -1e308])
@pytest.mark.parametrize("name", ["x", "y", "angle", "kind", "quality"])
def test_numbers_beyond_float32_are_refused(name, value):
    columns = {"x": [1, 2], "y": [1, 2], "angle": [0, 1], "kind": [1, 1], "quality": [5, 5]}
    with pytest.raises(MinutiaeError):
        Minutiae(**(columns | {name: [value, 1]}))


def test_positions_that_overflow_at_500_dpi_are_refused():
    minutiae = Minutiae(x=[3e38], y=[1], angle=[0])
    assert len(Template(minutiae, 10, 10)) == 1
    with pytest.raises(MinutiaeError, match=r"3e\+38 px is too large at 100 dpi"):
        Template(minutiae, 10, 10, dpi=100)


@pytest.mark.parametrize("dpi", [10**400, -(10**400), float("inf"), float("nan"), 5e-324])
def test_resolutions_beyond_a_scanner_are_refused(dpi):
    with pytest.raises(ResolutionError, match="outside the usable range"):
        Template(Minutiae.empty(), 10, 10, dpi=dpi)
