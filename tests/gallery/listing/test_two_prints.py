"""Each sign of two prints in one template, on fields and minutiae of known shape."""

import time
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.gallery.listing.two_prints import (
    count_areas,
    why_two_prints,
)
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template


def arch(shape=(24, 24), turn=0.0):
    """Return the field of even ridges, which turn a little from left to right."""
    column = np.indices(shape)[1]
    orientation = np.mod(turn + 0.02 * column, np.pi)
    return RidgeField(16.0, orientation, np.ones(shape, bool))


def minutiae_along(ridges, seed=0, count=60):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(20, 360, (2, count))
    angle = ridges.orientation[(y / 16).astype(int), (x / 16).astype(int)]
    return Minutiae(x, y, angle + np.pi * rng.integers(0, 2, count))


def signs(minutiae, field=None):
    why = why_two_prints(Template(minutiae, 400, 400, 500.0, field))
    return why.removeprefix("probably two prints in one: ")


def test_even_ridges_with_minutiae_along_them_have_no_sign():
    m = minutiae_along(arch())
    assert signs(m, arch()) == signs(m) == ""


def test_each_sign_is_named():
    one = arch()
    m = minutiae_along(one)
    column = np.indices((24, 24))[1]
    apart = replace(one, mask=one.mask & (column != 11))
    assert signs(m, apart) == "the ridges have two areas; cut them into one image each"
    thrice = replace(apart, mask=apart.mask & (column != 5) & (column != 17) & (column < 18))
    assert signs(m, thrice).startswith("probably 3 prints in one: the ridges have 3 areas; cut")
    turned = np.where(column < 12, one.orientation, np.mod(one.orientation + 1, np.pi))
    assert "the ridges break off along a line" in signs(m, replace(one, orientation=turned))
    across = Minutiae(m.x, m.y, np.mod(m.angle + np.pi / 2, 2 * np.pi))
    assert signs(across, one) == "minutiae lie across the ridges"


def test_the_prints_of_a_card_are_counted_at_any_resolution():
    """A card of two rows of three prints, of 10 by 12 cells each; small spots are none."""
    row, column = np.indices((30, 39))
    mask = (row % 15 < 12) & (column % 13 < 10)
    card = RidgeField(16.0, np.mod(0.1 * (column % 13), np.pi), mask)
    assert count_areas(card, 500.0) == count_areas(replace(card, step=32.0), 1000.0) == 6
    assert count_areas(replace(card, mask=mask & (column < 16)), 500.0) == 2


def test_a_field_of_very_many_cells_takes_bounded_work():
    shape = (1024, 1024)
    column = np.indices(shape)[1]
    turned = np.where(column < 512, 0.5, 1.5)
    fine = RidgeField(0.4, turned, np.ones(shape, bool), np.zeros(shape, np.uint64))
    begin = time.process_time()
    assert "the ridges break off along a line" in signs(Minutiae([], [], []), fine)
    assert time.process_time() - begin < 3


@given(
    rows=st.integers(1, 9),
    columns=st.integers(1, 9),
    seed=st.integers(0, 99),
    count=st.integers(0, 40),
    step=st.sampled_from([1e-300, 16.0, 1e300]),
    far=st.sampled_from([1.0, 1e30]),
    ridges=st.booleans(),
)
def test_any_template_has_an_answer_that_its_hidden_cells_do_not_change(
    rows, columns, seed, count, step, far, ridges
):
    rng = np.random.default_rng(seed)
    mask = rng.random((rows, columns)) < 0.7
    orientation = np.where(mask, rng.uniform(0, np.pi, mask.shape), np.nan).astype(np.float32)
    bits = rng.integers(0, 2**63, mask.shape, dtype=np.uint64) if ridges else None
    minutiae = Minutiae(*rng.uniform(-50, 300, (2, count)) * far, rng.uniform(0, 6, count))
    one = Template(minutiae, 300, 300, 500.0, RidgeField(step, orientation, mask, bits))
    shown = RidgeField(step, np.where(mask, orientation, 0), mask, bits)
    assert why_two_prints(one) == why_two_prints(replace(one, field=shown))
