"""How many prints lie apart in a template, and their loops and deltas."""

from dataclasses import replace

import numpy as np
import pytest

from fpmatch.gallery.listing.separate_prints import count_loops, count_prints
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template


@pytest.mark.parametrize(("index", "found"), [(0.5, (1, 0)), (-0.5, (0, 1)), (1.0, (2, 0))])
def test_loops_and_deltas_are_counted(index, found):
    y, x = np.indices((21, 21)) - 10.3
    turn = np.arctan2(-y, x) if index < 1 else np.arctan2(-y, x - 4) / 2 + np.arctan2(-y, x + 4) / 2
    field = RidgeField(16.0, np.mod(turn * index, np.pi), np.ones((21, 21), bool))
    assert count_loops(field) == found


def card(rows, columns, turn=0.0, gap=3):
    """Return a template of a card with prints of 10 by 12 cells in rows and columns."""
    mask = np.zeros((rows * (12 + gap), columns * (10 + gap)), bool)
    i, j = np.indices(mask.shape)
    mask[(i % (12 + gap) < 12) & (j % (10 + gap) < 10)] = True
    orientation = np.mod(turn + 0.1 * (j % (10 + gap)), np.pi)
    field = RidgeField(16.0, orientation, mask)
    return Template(Minutiae.empty(), 16 * mask.shape[1], 16 * mask.shape[0], 500.0, field)


@pytest.mark.parametrize(("rows", "columns"), [(1, 2), (2, 1), (1, 3), (1, 4), (2, 5)])
def test_the_prints_of_a_card_are_counted_at_any_resolution(rows, columns):
    one = card(rows, columns, turn=np.pi / 2 if rows == 2 else 0.0)
    number = rows * columns
    assert count_prints(one) == count_prints(one.mirrored()) == number
    fine = replace(one, dpi=1000.0, field=replace(one.field, step=32.0))
    assert count_prints(fine) == number


def test_a_lower_phalanx_is_no_second_print():
    column, row = np.indices((30, 12))[::-1]
    tip = row < 16
    mask = tip | (row > 18)
    orientation = np.where(tip, np.mod(0.25 * column, np.pi), 0.05 * (column % 2))
    one = Template(Minutiae.empty(), 192, 480, 500.0, RidgeField(16.0, orientation, mask))
    assert count_prints(one) == 1
    upright = np.where(tip, orientation, np.pi / 2)
    assert count_prints(replace(one, field=replace(one.field, orientation=upright))) == 2


def test_spots_beside_a_print_and_no_ridges_are_no_prints():
    one = card(1, 2)
    spots = one.field.mask & (np.indices(one.field.mask.shape)[1] < 16)  # three columns of two
    assert count_prints(replace(one, field=replace(one.field, mask=spots))) == 1
    assert count_prints(replace(one, field=replace(one.field, mask=~one.field.mask & False))) == 1
    assert count_prints(replace(one, field=None)) == 1
