"""Ridge fields: what a field holds of the ridges of a print; when two are equal."""

from dataclasses import replace

import numpy as np
import pytest

from fpmatch.errors import MinutiaeError
from fpmatch.templates import minutiae
from fpmatch.templates.ridge_field import RidgeField

MASK = np.array([[True, False, True], [True, True, False]])
ORIENTATION = np.full(MASK.shape, 0.5, np.float32)
RIDGES = np.arange(1, 7, dtype=np.uint64).reshape(MASK.shape) << np.uint64(60)


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
    with pytest.raises(MinutiaeError, match="ridges and mask must be of one shape"):
        some_field(np.ones(shape, np.uint64))


@pytest.mark.parametrize("orientation", [np.nan, np.inf, 1e30])
def test_orientations_that_are_no_angles_are_refused(orientation):
    with pytest.raises(MinutiaeError, match="orientation must be finite radians"):
        RidgeField(16.0, np.full(MASK.shape, orientation), MASK)


def test_ridges_of_any_numbers_are_kept_as_bits_without_a_warning():
    field = some_field(np.full(MASK.shape, np.nan))
    assert field.ridges.dtype == np.uint64


def test_a_field_is_imported_with_the_template_that_has_one():
    assert minutiae.RidgeField is RidgeField
