"""What tests of packed prints share: they come back from a file, and damage is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from matching_prints import template_of

from fpmatch.array_file import Column, read_arrays, write_arrays
from fpmatch.errors import MatcherError
from fpmatch.matching.prints.prepare import PreparationParameters, PreparedTemplate, prepare

Packed = TypeVar("Packed", bound=Any)


def from_file(packed: Packed, path: Path, columns: dict[str, Column]) -> Packed:
    """Return packed prints that were written to a file and are mapped from it."""
    write_arrays(path, packed.arrays(), columns, {})
    mapped: Packed = type(packed).of_arrays(read_arrays(path, columns, {}))
    return mapped


def assert_damaged(packed: Any, name: str, at: int, value: float) -> None:
    """Check that packed prints are refused where one number of an array is another one."""
    array = getattr(packed, name).copy()
    array.ravel()[at] = value
    with pytest.raises(MatcherError) as caught:
        type(packed).of_arrays(packed.arrays() | {name: array})
    assert caught.value.code == "damaged"


def crowd(most: int = 300) -> PreparedTemplate:
    """Return a prepared print of many minutiae on a line, of which at most so many are kept."""
    points = np.zeros((4, 300))
    points[0], points[2] = np.arange(300) * 7.0, 1
    return prepare(template_of(points), PreparationParameters(max_minutiae=most))
