from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from research.partial_templates import MARGIN_PX, fragment, window


def whole(seed, *, minutiae=30, field=True):
    rng = np.random.default_rng(seed)
    orientation = rng.uniform(0, np.pi, (15, 15)).astype(np.float32)
    ridges = rng.integers(0, 2**63, (15, 15)).astype(np.uint64)
    shown = RidgeField(16.0, orientation, np.ones((15, 15), bool), ridges)
    x, y, angle = rng.uniform(0, (240, 240, 6), (minutiae, 3)).T
    return Template(Minutiae(x, y, angle), 240, 240, field=shown if field else None)


def rows(template):
    m = template.minutiae
    return set(zip(m.x.tolist(), m.y.tolist(), m.angle.tolist(), strict=True))


@given(st.integers(0, 1000), st.integers(1, 40), st.booleans())
def test_a_fragment_is_a_minutia_and_its_nearest(seed, size, field):
    print_ = whole(seed, field=field)
    part = fragment(print_, size, np.random.default_rng(seed))
    assert len(part.minutiae) == min(size, 30)
    assert rows(part) <= rows(print_)
    centre = int(np.random.default_rng(seed).integers(30))
    m = print_.minutiae
    distance = np.sort(np.hypot(m.x - m.x[centre], m.y - m.y[centre]))
    found = np.hypot(part.minutiae.x - m.x[centre], part.minutiae.y - m.y[centre])
    assert found.max() == distance[min(size, 30) - 1]
    if field and size < 30:
        assert 0 <= part.field.mask.sum() <= np.pi * (found.max() / 16 + 2) ** 2
    assert field or part.field is None


@given(st.integers(0, 1000), st.sampled_from([20.0, 64.0, 128.0, 600.0]), st.booleans())
def test_a_window_keeps_what_lies_in_a_square(seed, side, field):
    print_ = whole(seed, field=field)
    part = window(print_, side, np.random.default_rng(seed))
    assert rows(part) <= rows(print_)
    if len(part.minutiae):
        for axis in (part.minutiae.x, part.minutiae.y):
            assert np.ptp(axis) < side - 2 * MARGIN_PX
    if field:
        assert part.field.mask.any()
        for axis in np.nonzero(part.field.mask):
            assert np.ptp(axis) * 16 < side
    if side == 600.0:
        assert len(part.minutiae) == 30


def test_windows_are_measured_at_500_dpi():
    print_ = replace(whole(3), dpi=1000.0)
    part = window(print_, 60, np.random.default_rng(1))
    assert np.ptp(np.nonzero(part.field.mask)[1]) * 16 > 60


def test_nothing_is_cut_out_of_an_empty_print():
    empty = Template(Minutiae.empty(), 100, 100)
    assert len(window(empty, 50, np.random.default_rng(1)).minutiae) == 0
    assert len(fragment(empty, 5, np.random.default_rng(1)).minutiae) == 0
