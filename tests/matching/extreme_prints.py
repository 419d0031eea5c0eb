"""Prints that hardly are any, and templates at the bounds of their numbers."""

import numpy as np
from hypothesis import strategies as st

from fpmatch.templates.bounds import (
    LEAST_STEP_PX,
    MOST_CELLS,
    MOST_PX,
    MOST_SIDE_PX,
    MOST_STEP_PX,
    most_megapixels,
)
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from tests.matching.matching_prints import (
    COMPILED,
    even_field,
    spread_points,
    striped_field,
    template_of,
)

FIELDS = (None, even_field(side=20), striped_field(side=20 if COMPILED else 8))
"""No field, one that does not show its ridges, and one that does."""
USUAL = template_of(spread_points(np.random.default_rng(4), 15, 20.0))


def degenerate_prints():
    """Return prints that hardly are any, each with a name."""
    rng = np.random.default_rng(8)
    many = 2000 if COMPILED else 30
    usual = spread_points(rng, 12)

    def flat(points):
        """Return the same minutiae, of which all directions are 0."""
        return np.vstack([points[:2], [[1.0], [0.0]] * np.ones(points.shape[1])])

    made = {f"{n} minutiae": usual[:, :n] for n in range(5)}
    made["directions 0"] = flat(usual)
    made["4 of directions 0"] = flat(usual[:, :4])
    for n in (3, 4, 12):
        along, across, directions = 20.0 * np.arange(1, n + 1), np.full(n, -100.0), usual[2:, :n]
        made[f"{n} on a row"] = np.vstack([along, across, directions])
        made[f"{n} on a slanted line"] = np.vstack([along, -along, directions])
        made[f"{n} on a row, directions 0"] = flat(made[f"{n} on a row"])
        made[f"{n} on a column"] = np.vstack([-across, -along, directions])
        made[f"{n} on one spot"] = np.vstack([np.full(n, 90.0), np.full(n, -70.0), directions])
        made[f"{n} times the same"] = np.repeat(usual[:, :1], n, axis=1)
    made["pairs that coincide"] = np.repeat(usual[:, :6], 2, axis=1)
    angle = np.arange(12) * np.pi / 6
    circle = 150 + 90 * np.cos(angle), -150 + 90 * np.sin(angle)
    made["on a circle"] = np.vstack([*circle, np.cos(angle), np.sin(angle)])
    row, column = np.divmod(np.arange(25), 5)
    made["on a grid, directions 0"] = flat(np.array([60.0 + 40 * column, -60.0 - 40 * row]))
    made[f"{many} minutiae"] = spread_points(rng, many, 0.0, 1500.0)
    made[f"{many} minutiae, directions 0"] = flat(made[f"{many} minutiae"])
    made[f"{many} on one spot"] = np.repeat(usual[:, :1], many, axis=1)
    made["far outside the image"] = usual + np.array([[1e6], [1e6], [0], [0]])
    return {name: template_of(np.ascontiguousarray(points)) for name, points in made.items()}


DEGENERATE = degenerate_prints()


def near(least, most):
    """Draw numbers from a range, its ends often."""
    return st.floats(least, most) | st.sampled_from([least, most])


@st.composite
def extreme_templates(draw):
    """Draw templates anywhere within the bounds."""
    dpi = draw(near(100, 4000))
    zoom = 500 / dpi
    n = draw(st.integers(0, 8))
    column = st.lists(
        near(-MOST_PX + 2, MOST_PX - 2).map(lambda v: v / zoom), min_size=n, max_size=n
    )
    angle = draw(st.lists(st.floats(-1e30, 1e30), min_size=n, max_size=n))
    minutiae = Minutiae(draw(column), draw(column), angle)
    shape = draw(
        st.sampled_from([(0, 0), (1, 1), (3, 4), (1, MOST_SIDE_PX), (MOST_CELLS // 1024, 1024)])
    )
    mask = np.zeros(shape, bool)
    mask.flat[:: draw(st.integers(1, 9999))] = draw(st.booleans())
    step = draw(near(LEAST_STEP_PX * 1.01, MOST_STEP_PX * 0.99)) / zoom
    ridges = draw(st.sampled_from([None, np.full(shape, 3, np.uint64)]))
    field = RidgeField(step, np.full(shape, draw(st.floats(0, 3.14))), mask, ridges)
    width = draw(st.integers(1, MOST_SIDE_PX))
    height = draw(st.integers(1, min(MOST_SIDE_PX, int(most_megapixels(dpi) * 1e6) // width)))
    return Template(minutiae, width, height, dpi, draw(st.sampled_from([None, field])))
