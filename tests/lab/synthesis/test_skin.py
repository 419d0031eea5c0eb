import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.lab.synthesis.noise import smooth_noise
from fpmatch.lab.synthesis.skin import (
    CREST,
    PORE_DEPTH,
    detailed_skin,
    draw_lines,
    skin_of,
)


@given(st.integers(1, 90), st.integers(1, 90), st.floats(1.5, 200), st.integers(0, 2**32))
def test_noise_of_any_shape_and_extent_is_finite_and_smooth(rows, columns, extent, seed):
    field = smooth_noise((rows, columns), extent, np.random.default_rng(seed))
    assert field.shape == (rows, columns)
    assert np.isfinite(field).all()
    steps = [np.abs(np.diff(field, axis=axis)) for axis in (0, 1)]
    assert all(step.max(initial=0) < 12 / extent for step in steps)


@pytest.mark.parametrize("extent", [2.0, 5.0, 7.3])
def test_noise_has_mean_0_deviation_1_and_a_length(extent, rng):
    field = smooth_noise((400, 400), extent, rng)
    assert abs(field.mean()) < 0.1
    assert abs(field.std() - 1) < 0.1
    far = round(4 * extent)
    assert np.corrcoef(field[:, :-1].ravel(), field[:, 1:].ravel())[0, 1] > 0.8
    assert abs(np.corrcoef(field[:, :-far].ravel(), field[:, far:].ravel())[0, 1]) < 0.1


def test_pores_are_pits_on_crests(master, monkeypatch):
    monkeypatch.setattr("fpmatch.lab.synthesis.skin.TEXTURE", 0.0)
    depth = master.relief - skin_of(master).relief
    assert depth.min() >= 0
    pits = np.argwhere(depth > 0.7 * PORE_DEPTH)
    assert len(pits) > 20
    assert (master.relief[tuple(pits.T)] > 0).mean() > 0.95


@pytest.fixture
def details(monkeypatch, master):
    """Return a function that gives the skin with only some kinds of details, by their names."""
    none = dict.fromkeys(("UNDULATION", "PORE_DEPTHS", "NOTCH_DEPTHS"), (0.0, 0.0))
    none |= {"INCIPIENT_CHANCE": 0.0, "HAIRLINES": (0.0,), "MEAN_CREASES": 0.0}

    def skin(**values):
        for name, value in (none | values).items():
            monkeypatch.setattr(f"fpmatch.lab.synthesis.skin.{name}", value)
        return detailed_skin(master)

    return skin


def test_skin_without_details_is_the_relief(details, master):
    skin = details()
    np.testing.assert_allclose(skin.relief, master.relief, atol=1e-6)
    assert not skin.creases.any()


def test_pores_lie_in_rows_on_the_crests(details, master):
    depth = master.relief - details(PORE_DEPTHS=(1.5, 1.5)).relief
    assert depth.min() > -1e-6
    pits = np.argwhere(depth == depth.max())
    assert (master.relief[tuple(pits.T)] >= CREST).all()
    on_crests, in_valleys = (depth[m].mean() for m in (master.relief > CREST, master.relief < -0.9))
    assert on_crests > 10 * in_valleys


def test_incipient_ridges_rise_in_the_middle_of_valleys(details, master):
    risen = details(INCIPIENT_CHANCE=1.0).relief - master.relief
    assert risen.min() > -1e-6
    assert (risen > 0.2).any()
    assert master.relief[risen > 1e-6].max() < -0.7


@settings(max_examples=10)
@given(st.integers(1, 5), st.integers(0, 2**32))
def test_lines_are_thin_and_lie_between_0_and_1(count, seed):
    lines, again = (draw_lines((150, 130), count, np.random.default_rng(seed)) for _ in range(2))
    assert lines.dtype == np.float32
    assert lines.min() == 0
    assert 0.2 < lines.max() <= 1
    assert (lines > 0.2).mean() < 0.05 * count
    np.testing.assert_array_equal(lines, again)
    assert not draw_lines((30, 20), 0, np.random.default_rng(seed)).any()
