import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pointset_strategies import check_sound, seeds, similarities, worn

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.point_match import fewest_above
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper.matcher import UnitCircleParameters, match_by_unit_circle, similar_rings
from fpmatch.pointset.paper.one_rings import prepare_points


def random_points(seed, n=30):
    return np.random.default_rng(seed).uniform(0, 400, (n, 2))


def worn_copy(p, move, seed):
    """Return `p`, of extent 400, jittered, a tenth of it replaced, shuffled and moved."""
    return move.apply(400 * worn(p / 400, Similarity(), seed, 0.03, 0.1)[0])


@given(seeds, similarities(20, 1e4))
def test_finds_any_similarity_transform(seed, move):
    p = random_points(seed)
    q, place = worn(p, move, seed, jitter=0.0, share=0.0)
    match = match_by_unit_circle(p, q)
    assert match.matched_share == 1
    assert match.pairs.tolist() == [[i, j] for i, j in enumerate(place.tolist())]
    assert match.transform.apply(p) == pytest.approx(move.apply(p), abs=1e-6)


def test_finds_a_patch_of_a_larger_set():
    q = random_points(3, 200)
    inside = ((q > 100) & (q < 300)).all(axis=1)
    match = match_by_unit_circle(Similarity(2.0, -1.0, 5, 5).apply(q[inside]), q)
    assert match.matched_share == 1
    assert match.pairs[:, 1].tolist() == inside.nonzero()[0].tolist()


@given(seeds, st.sampled_from([0.3, 1.0]))
def test_exchanging_the_sets_inverts_the_transform(seed, factor):
    p = random_points(seed)
    q = worn_copy(p, Similarity(1.3, 1.0, 7, 9), seed)
    parameters = UnitCircleParameters(matching_factor=factor)
    forth, back = match_by_unit_circle(p, q, parameters), match_by_unit_circle(q, p, parameters)
    assert forth.matched_share == back.matched_share
    assert forth.local_matches == back.local_matches
    assert {*map(tuple, forth.pairs.tolist())} == {(i, j) for j, i in back.pairs.tolist()}
    one, other = forth.transform, back.transform
    assert one == other.inverse() or other == one.inverse()


@pytest.mark.parametrize(("p_size", "q_size"), [(1e85, 1e-85), (1e-85, 1e85), (1e85, 1e85)])
def test_sizes_may_differ_by_a_hundred_and_seventy_powers_of_ten(p_size, q_size):
    points = random_points(2) / 400
    match = match_by_unit_circle(points * p_size, points * q_size)
    assert match.matched_share == 1
    assert match.transform.scale == pytest.approx(q_size / p_size)


@pytest.mark.parametrize(
    "points",
    [[], [[1, 1]], [[0, 0], [4, 0], [0, 4]], [[i, 2 * i] for i in range(12)], [[3, 3]] * 9],
)
def test_sets_without_closed_rings_match_nothing(points):
    other = random_points(1)
    for match in (match_by_unit_circle(points, other), match_by_unit_circle(other, points)):
        assert match.transform is None
        assert match.matched_share == 0
        assert match.pairs.shape == (0, 2)


def test_tolerance_is_in_the_units_of_the_points():
    p = random_points(4, 40)
    q = p + np.random.default_rng(0).uniform(-4, 4, p.shape)
    wide = match_by_unit_circle(p, q, UnitCircleParameters(tolerance=12.0))
    narrow = match_by_unit_circle(p, q, UnitCircleParameters(tolerance=1.0))
    assert wide.matched_share > 0.9 > narrow.matched_share
    assert narrow.rms <= 1.0


def test_scale_can_be_bounded():
    p = random_points(4)
    q = Similarity(scale=1.5).apply(p)
    assert match_by_unit_circle(p, q, UnitCircleParameters(max_scale=1.6)).matched_share == 1
    for sides in ((p, q), (q, p)):
        assert match_by_unit_circle(*sides, UnitCircleParameters(max_scale=1.4)).matched_share < 0.6


@given(seeds, st.sampled_from([0.0, 0.3, 0.5, 0.6]))
def test_a_search_that_ends_early_decides_as_one_that_does_not(seed, rho):
    p = random_points(seed)
    q = worn_copy(p, Similarity(1.3, 1.0, 7, 9), seed) if seed % 2 else random_points(seed + 1)
    early = match_by_unit_circle(p, q, UnitCircleParameters(matching_factor=rho))
    whole = match_by_unit_circle(p, q)
    check_sound(early, p, q)
    if whole.matched_share > rho:
        assert early.matched_share > rho


@pytest.mark.parametrize("count", [1, 7, 20, 50, 100])
def test_the_fewest_above_a_share_are_more_than_it_by_no_rounding(count):
    for k in range(count + 1):
        assert fewest_above(k / count, count) == k + 1
        assert fewest_above(round(k / count, 2), count) / count > round(k / count, 2)


@given(seeds, st.floats(0, 1))
def test_rings_alike_by_their_definition(seed, tolerance):
    p, q = (
        prepare_points(random_points(seed)).rings,
        prepare_points(random_points(~seed % 99)).rings,
    )
    differences = np.abs(p.area[:, None] - q.area)
    assume((np.abs(differences - tolerance) > 1e-9).all())
    expected = (p.degree[:, None] == q.degree) & (differences <= tolerance)
    assert similar_rings(p, q, tolerance).tolist() == np.argwhere(expected).tolist()


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("area_tolerance", [-0.1, 0.0, np.nan]),
        ("precision", [-1.0]),
        ("tolerance", [-1.0, np.inf]),
        ("matching_factor", [-0.1, np.nan, 1.5]),
        ("max_scale", [0.5]),
    ],
)
def test_impossible_parameters_are_refused(name, values):
    for value in values:
        with pytest.raises(PointSetError):
            UnitCircleParameters(**{name: value})
