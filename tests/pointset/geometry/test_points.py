import numpy as np

from fpmatch.pointset.geometry.points import as_points


def test_points_are_copied_into_two_columns():
    mine = np.ones((2, 2))
    as_points(mine)[0, 0] = 5
    assert mine[0, 0] == 1
    assert as_points([]).shape == (0, 2)
