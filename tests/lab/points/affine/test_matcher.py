import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import (
    affine_transforms,
    check_sound,
    even_points,
    seeds,
)

from fpmatch.lab.points.affine import _affine_kernel as kernel
from fpmatch.lab.points.affine.matcher import AffineParameters, match_affine
from fpmatch.pointset.geometry.affine_transform import AffineTransform

# Interpreted, a proposal costs some hundred times as much: the search is cut where it is in vain.
BOUNDED = AffineParameters(max_proposals=50_000 if kernel.COMPILED else 500)


@given(seeds, st.integers(8, 40), affine_transforms(20.0))
def test_an_exact_copy_under_any_affine_map_is_found(seed, n, move):
    p = even_points(seed, n)
    order = np.random.default_rng(seed).permutation(n)
    q = move.apply(p)[order]
    match = match_affine(p, q)
    check_sound(match, p, q)
    assert isinstance(match.transform, AffineTransform)
    assert match.transform.apply(p) == pytest.approx(move.apply(p), abs=1e-6 * np.ptp(q))
    assert match.transform.inverse().apply(q) == pytest.approx(p[order], abs=1e-6)
    assert (order[match.pairs[:, 1]] == match.pairs[:, 0]).all()
    assert len(match.pairs) == n


@given(seeds, st.integers(5, 30), st.integers(5, 30))
def test_independent_sets_do_not_match(seed, of_p, of_q):
    p, q = even_points(seed, of_p), even_points(seed + 1, of_q)
    match = match_affine(p, q, parameters=BOUNDED)
    check_sound(match, p, q)
    assert match.transform is None or match.chance < 1e-3 / 2  # one in a thousand may
