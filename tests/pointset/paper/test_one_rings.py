import numpy as np
import pytest
from hypothesis import given
from pointset_strategies import any_finite_points, crowded_pixels, seeds

from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.geometry.frames import UnitFrame
from fpmatch.pointset.paper.one_rings import map_to_unit_circle
from fpmatch.pointset.paper.parametrize import parametrize

even_points = seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 400, (30, 2)))


@given(even_points | crowded_pixels)
def test_all_rings_at_once_are_the_rings_one_by_one(points):
    mesh = triangulate(points)
    rings = map_to_unit_circle(mesh)
    assert sorted(rings.centre.tolist()) == mesh.interior.nonzero()[0].tolist()
    for i, centre in enumerate(rings.centre):
        entry = slice(rings.start[i], rings.start[i + 1])
        assert rings.vertex[entry].tolist() == mesh.one_ring(centre).tolist()
        expected = parametrize(mesh.points[mesh.one_ring(centre)], mesh.points[centre])
        boundary = rings.circle[:, entry].T
        assert boundary == pytest.approx(expected.boundary, abs=1e-12)
        assert rings.weight[entry] == pytest.approx(expected.weights, abs=1e-9)
        assert rings.image[:, i] == pytest.approx(expected.image, abs=1e-9)
        assert rings.area[i] == pytest.approx(expected.area, abs=1e-12)


@given(any_finite_points)
def test_every_finite_set_has_finite_rings(points):
    rings = map_to_unit_circle(triangulate(UnitFrame.of(points).apply(points)))
    assert np.isfinite(rings.circle).all()
    assert (np.hypot(*rings.image) <= 1).all()
    assert ((rings.area > 0) & (rings.area < np.pi)).all()


def test_rings_are_ordered_by_degree_then_area(rng):
    rings = map_to_unit_circle(triangulate(rng.uniform(0, 1, (80, 2))))
    keys = list(zip(rings.degree.tolist(), rings.area.tolist(), strict=True))
    assert keys == sorted(keys)
    assert len(set(rings.degree.tolist())) > 2
