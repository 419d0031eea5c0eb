"""Minutiae, templates and ridge fields: what they contain, refuse, and when two are equal."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch import extract, read_image, verify
from fpmatch.errors import MinutiaeError, ResolutionError
from fpmatch.matching.registry import get_matcher
from fpmatch.templates.bounds import check_bounds
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from tests.matching.extreme_prints import extreme_templates

SAMPLES = Path(__file__).parents[2] / "sample_data"
MASK = np.array([[True, False, True], [True, True, False]])
ORIENTATION = np.full(MASK.shape, 0.5, np.float32)
RIDGES = np.arange(1, 7, dtype=np.uint64).reshape(MASK.shape) << np.uint64(60)


@pytest.mark.parametrize(
    ("names", "values"),
    [
        (("x", "y", "angle", "kind", "quality"), [10**400, np.inf, np.nan, 1e38, -1e308, "a"]),
        (("kind",), [3, -1]),
        (("quality",), [101, -1]),
    ],
)
@pytest.mark.parametrize("kept", [False, True])
def test_values_that_no_minutia_has_are_refused(names, values, kept):
    """Also in arrays of the types that are kept."""
    columns = {"x": [1, 2], "y": [1, 2], "angle": [0, 1], "kind": [1, 1], "quality": [5, 5]}
    if kept:
        columns = {name: np.array(column, np.float32) for name, column in columns.items()}
    for name in names:
        for value in values:
            with pytest.raises(MinutiaeError):
                Minutiae(**(columns | {name: [value, columns[name][1]]}))
        with pytest.raises(MinutiaeError, match="one-dimensional"):
            Minutiae(**(columns | {name: [[1, 2]]}))
    with pytest.raises(MinutiaeError, match="y has 1 values where x has 2"):
        Minutiae([1, 2], [1], [0, 1])


@pytest.mark.parametrize("dpi", [10**400, -(10**400), float("inf"), float("nan"), 5e-324])
def test_resolutions_beyond_a_scanner_are_refused(dpi):
    with pytest.raises(ResolutionError, match="range"):
        Template(Minutiae.empty(), 10, 10, dpi=dpi)


def some_field(ridges=RIDGES):
    return RidgeField(16.0, ORIENTATION, MASK, ridges)


def test_ridges_are_a_copy_cleared_outside_the_mask_that_cannot_be_written():
    mine = RIDGES.copy()
    field = some_field(mine)
    mine[:] = 0
    assert field.ridges.dtype == np.uint64
    assert field.ridges.tolist() == (RIDGES * MASK).tolist()
    with pytest.raises(ValueError, match="read-only"):
        field.ridges[0, 0] = 1
    nothing = np.zeros((0, 4))
    assert RidgeField(16.0, nothing, nothing, nothing).ridges is not None


def test_fields_are_equal_whose_ridges_are():
    field = some_field()
    assert field == some_field(np.asfortranarray(RIDGES * MASK)) == some_field(RIDGES.tolist())
    assert field != replace(field, ridges=None)
    assert replace(field, ridges=None) != field
    assert replace(field, ridges=None) == RidgeField(16.0, ORIENTATION, MASK)
    other = RIDGES.copy()
    other[0, 1] ^= np.uint64(1)  # outside the mask
    assert field == some_field(other)
    other[0, 0] ^= np.uint64(1)
    assert field != some_field(other)
    assert replace(field, ridges=np.zeros_like(RIDGES)) != replace(field, ridges=None)


@pytest.mark.parametrize("shape", [(1, 3), (2, 1), (), (3, 2), (2, 2, 3)])
def test_ridges_of_another_shape_are_refused(shape):
    with pytest.raises(MinutiaeError, match="shape"):
        some_field(np.ones(shape, np.uint64))


@pytest.mark.parametrize("orientation", [np.nan, np.inf, 1e30])
def test_orientations_that_are_no_angles_are_refused_and_ridges_are_kept_as_bits(orientation):
    with pytest.raises(MinutiaeError, match="orientation"):
        RidgeField(16.0, np.full(MASK.shape, orientation), MASK)
    assert some_field(np.full(MASK.shape, orientation)).ridges.dtype == np.uint64


ANGLES = st.floats(-7, 7, width=32) | st.sampled_from([-0.0, 0.0, 2 * np.pi, 6.2831850051879883])


@given(st.lists(ANGLES, max_size=5))
def test_columns_of_the_types_that_are_kept_give_the_same_minutiae(angles):
    angle = np.array(angles, np.float32)
    x, kind = np.arange(len(angle), dtype=np.float32) - 1, np.full(len(angle), 2, np.uint8)
    kept = Minutiae(x, x, angle, kind, kind)
    converted = Minutiae(*(column.astype(np.float64) for column in (x, x, angle, kind, kind)))
    for name in ("x", "y", "angle", "kind", "quality"):
        one, other = getattr(kept, name), getattr(converted, name)
        assert (one.dtype, one.tobytes()) == (other.dtype, other.tobytes())
        assert not one.flags.writeable
        assert not np.shares_memory(one, x)
    assert x.flags.writeable


@pytest.mark.parametrize("name", ["101_1.tif", "102_3.tif"])
def test_a_mirrored_template_is_that_of_the_mirrored_image(name):
    pixels = read_image(SAMPLES / name).pixels
    one, mirrored = extract(pixels, 500), extract(np.ascontiguousarray(pixels[:, ::-1]), 500)
    assert not replace(one, dpi_known=False).mirrored().dpi_known
    ours = verify(one.mirrored(), mirrored)
    assert ours.score > 90
    assert len(ours.pairs) > 0.8 * len(one)
    assert (ours.transform.scale, ours.transform.rotation_deg) == pytest.approx((1, 0), abs=0.5)


@given(extreme_templates())
def test_what_is_within_the_bounds_can_be_prepared_and_compared(template):
    """So nothing that passes at reading can make a later comparison fail."""
    check_bounds(template)
    matcher = get_matcher("unit-circle")
    prepared = matcher.prepare(template)
    assert np.isfinite(matcher.compare(prepared, prepared).similarity)
