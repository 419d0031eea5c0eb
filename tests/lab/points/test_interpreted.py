"""Kernels compiled against the same kernels as ordinary Python: all results to the last bit."""

import importlib
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointset_strategies import crowded_pixels, seeds, worn

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.similarity import Similarity

ROOMS = ("fpmatch.pointset", "fpmatch.lab.points")
RESULTS = {
    "lab.points.triangles.matcher": lambda m, *sets: m.match_by_triangles(*sets, max_proposals=100),
    "pointset.paper.matcher": lambda m, *sets: m.match_by_unit_circle(*sets),
    "pointset.paper.one_rings": lambda m, p, _: m.prepare_points(p).rings,
    "lab.points.van_wamelen.matcher": lambda m, *sets: m.match_van_wamelen(
        *sets, rho=0.7, lambda_=0.6, max_steps=20_000
    ),
}


class KernelSources:
    """Finds the sources of kernels, where Python would find the compiled modules first."""

    @staticmethod
    def find_spec(name, path, _=None):
        if not (name.startswith(ROOMS) and name.endswith("_kernel")):
            return None
        source = Path(path[0], name.rpartition(".")[2] + ".py")
        return importlib.util.spec_from_file_location(name, source)


def take_out():
    return {name: sys.modules.pop(name) for name in [*sys.modules] if name.startswith(ROOMS)}


@pytest.fixture(scope="module")
def both():
    """Return the modules of `RESULTS`, and all kernels for points as ordinary Python in others."""
    ours = {name: importlib.import_module(f"fpmatch.{name}") for name in RESULTS}
    compiled = take_out()
    sys.meta_path.insert(0, KernelSources)
    try:
        plain = {name: importlib.import_module(f"fpmatch.{name}") for name in RESULTS}
    finally:
        sys.meta_path.remove(KernelSources)
        assert all(module.__file__.endswith(".py") for module in take_out().values())
        sys.modules.update(compiled)
        for package, _, name in (room.rpartition(".") for room in ROOMS):
            setattr(sys.modules[package], name, compiled[f"{package}.{name}"])
    return ours, plain


def worn_copy(seed):
    p = np.random.default_rng(seed).uniform(0, 1, (16, 2))
    return p, worn(p, Similarity(2.0, 0.5, 1.0, -3.0), seed)[0]


@pytest.mark.parametrize("name", RESULTS)
@given(sets=st.tuples(crowded_pixels, crowded_pixels) | seeds.map(worn_copy))
@settings(max_examples=12)
def test_compiled_and_interpreted_agree(both, name, sets):
    found = []
    for modules in both:
        try:
            with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
                found.append(repr(RESULTS[name](modules[name], *sets)))
        except PointSetError as error:
            found.append(repr(error))
    assert found[0] == found[1]
