"""Kernels compiled against the same kernels as ordinary Python: all results to the last bit."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointset_strategies import crowded_pixels, seeds, worn

from fpmatch import pointset
from fpmatch.pointset.geometry.similarity import Similarity

PACKAGE = Path(pointset.__file__).parents[1]
KERNELS = sorted(
    ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
    for room in ("pointset", "lab/points")
    for path in (PACKAGE / room).rglob("_*_kernel.py")
)


def compiled(name):
    return importlib.import_module(f"fpmatch.{name}")


def worn_copy(seed):
    p = np.random.default_rng(seed).uniform(0, 1, (16, 2))
    return p, worn(p, Similarity(2.0, 0.5, 1.0, -3.0), seed)[0]


def triangles(room, p, q):
    matcher = room("lab.points.triangles.matcher")
    return matcher.match_by_triangles(p, q, max_proposals=100)


ROOMS = {
    "triangles": triangles,
    "paper": lambda room, p, q: room("pointset.paper.matcher").match_by_unit_circle(p, q),
    "rings": lambda room, p, _: room("pointset.paper.one_rings").prepare_points(p).rings,
    "van-wamelen": lambda room, p, q: room("lab.points.van_wamelen.matcher").match_van_wamelen(
        p, q, rho=0.7, lambda_=0.6, max_steps=20_000
    ),
}


@pytest.mark.parametrize("results", ROOMS.values(), ids=ROOMS)
@given(sets=st.tuples(crowded_pixels, crowded_pixels) | seeds.map(worn_copy))
@settings(max_examples=12)
def test_compiled_and_interpreted_agree(plain, results, sets):
    found = []
    for room in (compiled, plain):
        try:
            with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
                found.append(repr(results(room, *sets)))
        except compiled("pointset.geometry.points").PointSetError as error:
            found.append(repr(error))
    assert found[0] == found[1]


@pytest.mark.parametrize("name", KERNELS)
def test_the_kernels_are_ordinary_python(plain, name):
    assert Path(plain(name).__file__).suffix == ".py"
    assert plain(name) is not compiled(name)
