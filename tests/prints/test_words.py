import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.prints.words import odds


@pytest.mark.parametrize(
    ("fmr", "expected"),
    [
        (1.0, "nearly all"), (0.94, "1 in 1.1"),
        (0.5, "1 in 2"), (0.01, "1 in 100"), (0.0123, "1 in 81"),
        (1e-3, "1 in 1,000"), (1 / 999_999, "1 in 1 million"), (2.5e-7, "1 in 4 million"),
        (1e-8, "1 in 100 million"), (1e-10, "1 in 10 billion"),
        (0.0, "unknown"), (-1.0, "unknown"), (math.nan, "unknown"),
    ],
)  # fmt: skip
def test_odds_in_words(fmr, expected):
    assert odds(fmr) == expected


@given(st.floats(1e-10, 0.95))
def test_odds_are_right_to_two_digits(fmr):
    count, *unit = odds(fmr).removeprefix("1 in ").split()
    size = {"million": 1e6, "billion": 1e9}[unit[0]] if unit else 1
    assert float(count.replace(",", "")) * size == pytest.approx(1 / fmr, rel=0.051)
