"""`fpmatch.scale`: a wrong resolution is measured, and nothing else is taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from fpmatch import Minutiae, Template, extract, find_scale, verify
from fpmatch.scale import MIN_PAIRS, measure_scale


@pytest.fixture(scope="module")
def scattered() -> Template:
    rng = np.random.default_rng(11)
    places = rng.uniform(0, 380, (2, 30))
    return Template(Minutiae(*places, rng.uniform(0, 6, 30)), width=388, height=374)


def moved(template: Template, scale: float, noise_px: float = 0.0, seed: int = 1) -> Template:
    """Return a print turned by half a radian and larger by `scale`, its minutiae jittered."""
    rng = np.random.default_rng(seed)
    m = template.minutiae
    places = (m.x + 1j * m.y) * scale * np.exp(0.5j) + 40 + 25j
    places += rng.normal(0, noise_px, len(m)) + 1j * rng.normal(0, noise_px, len(m))
    return replace(template, minutiae=Minutiae(places.real, places.imag, m.angle), field=None)


def all_pairs(template: Template) -> NDArray[np.intp]:
    return np.column_stack([np.arange(len(template.minutiae))] * 2)


@given(st.floats(0.5, 2), st.floats(150, 1200), st.floats(150, 1200))
def test_lengths_are_compared_in_millimetres(
    scattered: Template, scale: float, probe_dpi: float, reference_dpi: float
) -> None:
    probe = replace(scattered, dpi=probe_dpi)
    reference = replace(moved(scattered, scale), dpi=reference_dpi)
    measured = measure_scale(probe, reference, all_pairs(probe))
    assert measured is not None
    assert measured.ratio == pytest.approx(scale * probe_dpi / reference_dpi, rel=1e-5)
    assert measured.error < 1e-3 * measured.ratio


@given(st.floats(0.8, 1.25), st.integers(0, 1000))
def test_both_ways_say_the_same(scattered: Template, scale: float, seed: int) -> None:
    other = moved(scattered, scale, noise_px=4.0, seed=seed)
    there = measure_scale(scattered, other, all_pairs(scattered))
    back = measure_scale(other, scattered, all_pairs(scattered))
    assert there is not None
    assert back is not None
    assert there.ratio * back.ratio == pytest.approx(1, abs=1e-9)
    assert there.differs == back.differs


def test_the_error_is_as_large_as_the_scatter(scattered: Template) -> None:
    found = [
        measure_scale(scattered, moved(scattered, 1.0, 5.0, seed), all_pairs(scattered))
        for seed in range(200)
    ]
    errors = [m.error for m in found if m is not None]
    assert np.std([m.ratio for m in found if m is not None]) == pytest.approx(
        np.mean(errors), rel=0.25
    )


def test_skin_is_let_be_and_a_wrong_resolution_is_not(scattered: Template) -> None:
    for scale, differs in ((1.0, False), (1.05, False), (0.95, False), (1.138, True), (0.88, True)):
        measured = measure_scale(scattered, moved(scattered, scale, 2.0), all_pairs(scattered))
        assert measured is not None
        assert measured.differs is differs, scale
    vague = moved(scattered, 1.0, 60.0, seed=1), moved(scattered, 1.1, 60.0, seed=2)
    measured = measure_scale(*vague, all_pairs(scattered))
    assert measured is not None
    assert not measured.differs


def test_where_nothing_can_be_measured(scattered: Template) -> None:
    few = all_pairs(scattered)[: MIN_PAIRS - 1]
    assert measure_scale(scattered, scattered, few) is None
    heap = replace(scattered, minutiae=Minutiae(np.ones(30), np.ones(30), np.ones(30)))
    assert measure_scale(heap, heap, all_pairs(heap)) is None


@pytest.fixture(scope="module")
def print_(fingers: list[NDArray[np.uint8]]) -> Template:
    return extract(fingers[0], dpi=500)


def test_a_match_of_right_resolutions(print_: Template) -> None:
    found = find_scale(verify(print_, print_))
    assert found is not None
    assert (found.ratio, found.differs) == (pytest.approx(1), False)


@pytest.mark.parametrize("factor", [0.88, 1.138, 0.5, 2.0])
def test_a_wrong_resolution_is_found_match_or_not(print_: Template, factor: float) -> None:
    wrong = replace(print_, dpi=print_.dpi * factor)
    decision = verify(wrong, print_)
    found = find_scale(decision)
    assert found is not None
    assert found.differs
    assert found.ratio == pytest.approx(factor, rel=0.02)
    if factor in (0.5, 2.0):
        assert not decision.match  # and stays so: the scale is a reason, not a yes


def test_different_fingers_have_no_scale(fingers: list[NDArray[np.uint8]]) -> None:
    a, b = (extract(pixels, dpi=500) for pixels in fingers)
    assert find_scale(verify(a, b)) is None
    at_the_edge = replace(a, dpi=110.0)
    assert find_scale(verify(at_the_edge, b)) is None
