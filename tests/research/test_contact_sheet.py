import numpy as np
import pytest

from research.figures.contact_sheet import PrintTile, print_sheet


def tile(height, width, dpi=500, grey=0, caption=""):
    return PrintTile(np.full((height, width), grey, np.uint8), dpi, caption)


def extent(sheet, grey):
    """Rows and columns that hold `grey`."""
    return tuple(int((sheet == grey).any(axis=axis).sum()) for axis in (1, 0))


def test_prints_stand_at_one_scale_whatever_their_resolution():
    sheet = print_sheet([[tile(100, 80, 500, 10), tile(200, 160, 1000, 60)]], dpi=500)
    assert extent(sheet, 10) == pytest.approx((100, 80), abs=2)  # the frame takes a rim
    assert extent(sheet, 60) == pytest.approx((100, 80), abs=2)


def test_rows_and_columns_are_as_high_and_wide_as_their_largest_print():
    rows = [[tile(50, 90, grey=10), tile(80, 40, grey=60)], [tile(70, 60, grey=120)]]
    sheet = print_sheet(rows, dpi=500)
    assert sheet.shape == (14 + 80 + 14 + 70 + 14, 14 + 90 + 14 + 40 + 14)
    assert np.argwhere(sheet == 120).min(axis=0) == pytest.approx((14 + 80 + 14, 14), abs=1)


def test_captions_stand_below_their_prints_broken_where_they_are_too_wide():
    plain = print_sheet([[tile(50, 90)]], dpi=500)
    short = print_sheet([[tile(50, 90, caption="101_1")]], dpi=500)
    long = print_sheet([[tile(50, 90, caption="a name of many words")]], dpi=500)
    assert plain.shape[0] < short.shape[0] < long.shape[0]
    assert (plain[64 + 2 :] == 255).all()
    assert (short[64 + 2 :] < 200).any()
