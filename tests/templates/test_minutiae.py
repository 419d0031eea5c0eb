"""Minutiae, templates and ridge fields: what they contain, refuse, and when two are equal."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch import extract, read_image, verify
from fpmatch.errors import MinutiaeError, ResolutionError
from fpmatch.templates.minutiae import Minutiae, Template
from fpmatch.templates.ridge_field import RidgeField

SAMPLES = Path(__file__).parents[2] / "sample_data"
MASK = np.array([[True, False, True], [True, True, False]])
ORIENTATION = np.full(MASK.shape, 0.5, np.float32)
RIDGES = np.arange(1, 7, dtype=np.uint64).reshape(MASK.shape) << np.uint64(60)


@pytest.mark.parametrize("value", [10**400, float("inf"), float("nan"), 1e39, -1e308])
@pytest.mark.parametrize("name", ["x", "y", "angle", "kind", "quality"])
def test_numbers_beyond_float32_are_refused(name, value):
    columns = {"x": [1, 2], "y": [1, 2], "angle": [0, 1], "kind": [1, 1], "quality": [5, 5]}
    with pytest.raises(MinutiaeError):
        Minutiae(**(columns | {name: [value, 1]}))


def test_positions_that_overflow_at_500_dpi_are_refused():
    minutiae = Minutiae(x=[3e38], y=[1], angle=[0])
    assert len(Template(minutiae, 10, 10)) == 1
    with pytest.raises(MinutiaeError, match=r"3e\+38 px"):
        Template(minutiae, 10, 10, dpi=100)


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


def test_ridges_may_be_of_another_memory_order_or_type():
    assert some_field(np.asfortranarray(RIDGES)) == some_field()
    small = RIDGES >> np.uint64(60)
    assert some_field(small.astype(np.uint8)) == some_field(small) == some_field(small.tolist())


def test_fields_are_equal_whose_ridges_are():
    field = some_field()
    assert field == some_field(RIDGES * MASK)
    assert field != replace(field, ridges=None)
    assert replace(field, ridges=None) != field
    assert replace(field, ridges=None) == RidgeField(16.0, ORIENTATION, MASK)
    other = RIDGES.copy()
    other[0, 1] ^= np.uint64(1)  # outside the mask
    assert field == some_field(other)
    other[0, 0] ^= np.uint64(1)
    assert field != some_field(other)
    assert replace(field, ridges=np.zeros_like(RIDGES)) != replace(field, ridges=None)


@pytest.mark.parametrize("shape", [(1, 1), (1, 3), (2, 1), (3,), (), (3, 2), (2, 4), (2, 2, 3)])
def test_ridges_of_another_shape_are_refused(shape):
    with pytest.raises(MinutiaeError, match="shape"):
        some_field(np.ones(shape, np.uint64))


@pytest.mark.parametrize("orientation", [np.nan, np.inf, 1e30])
def test_orientations_that_are_no_angles_are_refused(orientation):
    with pytest.raises(MinutiaeError, match="orientation"):
        RidgeField(16.0, np.full(MASK.shape, orientation), MASK)


def test_ridges_of_any_numbers_are_kept_as_bits_without_a_warning():
    field = some_field(np.full(MASK.shape, np.nan))
    assert field.ridges.dtype == np.uint64


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


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("x", np.inf),
        ("y", np.nan),
        ("angle", np.nan),
        ("angle", -np.inf),
        ("kind", 3),
        ("quality", 101),
    ],
)
def test_impossible_values_of_these_types_are_refused(column, value):
    columns = {name: np.ones(3, np.float32) for name in ("x", "y", "angle")}
    columns |= {name: np.ones(3, np.uint8) for name in ("kind", "quality")}
    columns[column][1] = value
    with pytest.raises(MinutiaeError):
        Minutiae(**columns)


@pytest.mark.parametrize("name", ["101_1.tif", "102_3.tif"])
def test_a_mirrored_template_is_that_of_the_mirrored_image(name):
    pixels = read_image(SAMPLES / name).pixels
    one, mirrored = extract(pixels, 500), extract(np.ascontiguousarray(pixels[:, ::-1]), 500)
    ours = verify(one.mirrored(), mirrored)
    assert ours.score > 90
    assert len(ours.pairs) > 0.8 * len(one)
    assert (ours.transform.scale, ours.transform.rotation_deg) == pytest.approx((1, 0), abs=0.5)


def test_twice_mirrored_is_the_same_but_for_the_frame():
    one = extract(SAMPLES / "103_2.tif")
    twice = one.mirrored().mirrored()
    assert np.array_equal(twice.field.mask, one.field.mask)
    assert np.array_equal(twice.field.ridges, one.field.ridges)
    apart = np.sin(twice.field.orientation - one.field.orientation)[one.field.mask]
    assert np.abs(apart).max() < 1e-5
    assert twice.minutiae.xy == pytest.approx(one.minutiae.xy, abs=1e-3)
    assert np.abs(np.sin(twice.minutiae.angle - one.minutiae.angle)).max() < 1e-5
    bare = replace(one, field=None, dpi_known=False)
    assert not bare.mirrored().dpi_known
    assert one.mirrored().dpi_known
    assert (bare.mirrored().width, bare.mirrored().field) == (one.width, None)
