"""`fpmatch.matching.scale`: a wrong resolution is measured, and nothing else is taken for one."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch import Minutiae, Template, extract, verify
from fpmatch.matching.scale import MIN_PAIRS, measure_scale

PAIRS = np.column_stack([np.arange(30)] * 2)


@pytest.fixture(scope="module")
def scattered():
    rng = np.random.default_rng(11)
    places = rng.uniform(0, 380, (2, 30))
    return Template(Minutiae(*places, rng.uniform(0, 6, 30)), width=388, height=374)


def moved(template, scale, noise_px=0.0, seed=1):
    """Return a print turned by half a radian and larger by `scale`, its minutiae jittered."""
    rng = np.random.default_rng(seed)
    m = template.minutiae
    places = (m.x + 1j * m.y) * scale * np.exp(0.5j) + 40 + 25j
    places += rng.normal(0, noise_px, len(m)) + 1j * rng.normal(0, noise_px, len(m))
    return replace(template, minutiae=Minutiae(places.real, places.imag, m.angle), field=None)


@pytest.mark.parametrize("factor", [1.0, 0.88, 1.138, 0.5, 2.0])
def test_a_wrong_resolution_is_found_match_or_not(print_, factor):
    decision = verify(replace(print_, dpi=print_.dpi * factor), print_)
    found = decision.scale
    assert found.differs == (factor != 1.0)
    assert found.ratio == pytest.approx(factor, rel=0.02)
    if factor in (0.5, 2.0):
        assert not decision.match  # and stays so: the scale is a reason, not a yes


def test_different_fingers_have_no_scale(fingers):
    a, b = (extract(pixels, dpi=500) for pixels in fingers)
    assert verify(a, b).scale is None
    at_the_edge = replace(a, dpi=110.0)
    assert verify(at_the_edge, b).scale is None


@given(st.floats(0.5, 2), st.floats(150, 1200), st.floats(150, 1200), st.integers(0, 1000))
def test_lengths_are_compared_in_millimetres_and_both_ways_alike(scattered, scale, p, q, seed):
    probe = replace(scattered, dpi=p)
    for noise_px, within in ((0.0, 1e-5), (4.0, 0.1)):
        reference = replace(moved(scattered, scale, noise_px, seed), dpi=q)
        there = measure_scale(probe, reference, PAIRS)
        assert there.ratio == pytest.approx(scale * p / q, rel=within)
        assert there.error < within * there.ratio
        back = measure_scale(reference, probe, PAIRS)
        assert there.ratio * back.ratio == pytest.approx(1, abs=1e-9)
        assert there.differs == back.differs


def test_skin_is_let_be_and_a_wrong_resolution_is_not(scattered):
    for scale, differs in ((1.0, False), (1.05, False), (0.95, False), (1.138, True), (0.88, True)):
        measured = measure_scale(scattered, moved(scattered, scale, 2.0), PAIRS)
        assert measured.differs is differs, scale
    vague = moved(scattered, 1.0, 60.0, seed=1), moved(scattered, 1.1, 60.0, seed=2)
    assert not measure_scale(*vague, PAIRS).differs
    assert measure_scale(scattered, scattered, PAIRS[: MIN_PAIRS - 1]) is None
    heap = replace(scattered, minutiae=Minutiae(np.ones(30), np.ones(30), np.ones(30)))
    assert measure_scale(heap, heap, PAIRS) is None
    found = [measure_scale(scattered, moved(scattered, 1.0, 5.0, k), PAIRS) for k in range(200)]
    expected = np.mean([one.error for one in found])  # as large as the scatter
    assert np.std([one.ratio for one in found]) == pytest.approx(expected, rel=0.25)
