"""What tests of packed prints share: they come back from a file, and damage is refused."""

import numpy as np
import pytest
from matching_prints import template_of

from fpmatch.base.array_file import read_arrays, write_arrays
from fpmatch.errors import MatcherError
from fpmatch.matching.prints.prepare import PreparationParameters, prepare


def from_file(packed, path, columns):
    """Return packed prints that were written to a file and are mapped from it."""
    write_arrays(path, packed.arrays(), columns, {})
    mapped = type(packed).of_arrays(read_arrays(path, columns, {}))
    return mapped


def assert_damaged(packed, name, at, value):
    """Check that packed prints are refused where one number of an array is another one."""
    array = getattr(packed, name).copy()
    array.ravel()[at] = value
    with pytest.raises(MatcherError) as caught:
        type(packed).of_arrays(packed.arrays() | {name: array})
    assert caught.value.code == "damaged"


def crowd(most=300):
    """Return a prepared print of many minutiae on a line, of which at most so many are kept."""
    points = np.zeros((4, 300))
    points[0], points[2] = np.arange(300) * 7.0, 1
    return prepare(template_of(points), PreparationParameters(max_minutiae=most))
