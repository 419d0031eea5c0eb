"""The compiled matcher against the method in plain numpy and scipy: the same pairs and evidence.

Minutiae have whole coordinates, as extracted ones have, so that co-circular ones abound: the two
triangulate them alike. Prints that coincide with themselves under other transforms are left out:
there the last bit of a sum decides between equals.
"""

import subprocess
import sys
from dataclasses import fields, replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    EMPTY,
    along,
    distorted,
    fragment,
    jittered,
    moved,
    on_pixels,
    seeds,
    striped_field,
    template_of,
)

from fpmatch.image.extract import extract
from fpmatch.matching import reference as method
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers.unit_circle import MATCHER as COMPILED_MATCHER
from fpmatch.matching.matchers.unit_circle import REFERENCE, ReferenceMatcher
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline._kernels._pair_mesh_kernel import PairMesh
from fpmatch.matching.pipeline.evidence import Evidence
from fpmatch.matching.prints.prepared import BitDescriptors
from fpmatch.matching.reference import pair_mesh
from fpmatch.matching.reference.alignment import Pairing
from fpmatch.matching.reference.relaxation import relax
from fpmatch.matching.registry import get_matcher
from fpmatch.matching.verify import verify

SAMPLES = sorted((Path(__file__).parents[2] / "sample_data").glob("10[12]_*.tif"))
AREAS = {"area"}  # in px²: large numbers


def prepared(template):
    """Return a template as the reference prepares it; hold that of the compiled matcher equal."""
    compiled, plain = (matcher.prepare(template) for matcher in (COMPILED_MATCHER, REFERENCE))
    ours, theirs = plain.neighbourhoods, compiled.neighbourhoods
    assert ours.count.tolist() == theirs.count.tolist()
    np.testing.assert_allclose(ours.frame, theirs.frame, rtol=1e-6, atol=1e-9)
    assert compiled.key == plain.key
    for entry in fields(BitDescriptors):
        ours, theirs = (getattr(of.bit_descriptors, entry.name) for of in (plain, compiled))
        assert np.array_equal(ours, theirs), entry.name
    return plain


def hold_equal(probe, reference):
    """Hold the comparisons of two prepared prints equal; return that of the compiled matcher."""
    compiled = COMPILED_MATCHER.compare(probe, reference)
    plain = REFERENCE.compare(probe, reference)
    assert plain.pairs.tolist() == compiled.pairs.tolist()
    assert plain.pairs.dtype == compiled.pairs.dtype
    assert plain.reason == compiled.reason
    for name in ("similarity", "rms_px", "agreement", "overlap"):
        assert getattr(plain, name) == pytest.approx(getattr(compiled, name), rel=1e-9, abs=1e-9)
    assert (plain.detail is None) == (compiled.detail is None)
    if compiled.detail is not None:
        for name in Evidence._fields:
            ours, theirs = (getattr(one.detail, name) for one in (plain, compiled))
            relative = 1e-9 if name in AREAS else 0.0
            assert ours == pytest.approx(theirs, rel=relative, abs=1e-9), name
        matrices = plain.transform.matrix, compiled.transform.matrix
        np.testing.assert_allclose(*matrices, rtol=1e-9, atol=1e-6)
    return compiled


@pytest.fixture(scope="module")
def samples():
    """Return the eight prints of two sample fingers."""
    return [extract(path) for path in SAMPLES]


def without_ridges(template):
    return replace(template, field=None)


def middle(template):
    """Return the middle of a print, with its ridges."""
    return fragment(template, 12)


KINDS = {
    "whole": (lambda print_: print_,) * 2,
    "minutiae alone": (without_ridges,) * 2,
    "one without ridges": (without_ridges, lambda print_: print_),
    "fragments": (middle,) * 2,
    "fragments of minutiae": (lambda print_: without_ridges(middle(print_)),) * 2,
    "a fragment and a whole print": (middle, lambda print_: print_),
}


@pytest.mark.parametrize("kind", KINDS)
def test_sample_prints_have_the_same_pairs_and_evidence(kind, samples):
    first, second = ([prepared(change(print_)) for print_ in samples] for change in KINDS[kind])
    which = list(combinations(range(len(samples)), 2))
    compared = [hold_equal(first[i], second[j]) for i, j in which[:: 1 if kind == "whole" else 3]]
    assert any(found.detail for found in compared)


def test_a_print_and_itself(samples):
    side = prepared(samples[0])
    assert len(hold_equal(side, side).pairs) == len(side)


def any_print(seed):
    """Return minutiae at whole pixels, no two at one place, and of any directions."""
    rng = np.random.default_rng(seed)
    x, y = np.divmod(rng.choice(260 * 260, int(rng.integers(0, 45)), replace=False), 260)
    angle = rng.uniform(0, 2 * np.pi, len(x))
    return np.ascontiguousarray([1.0 * x, -1.0 * y, np.cos(angle), np.sin(angle)])


FIELDS = (None, striped_field(side=8), striped_field(side=16, orientation=1.9))


@given(seeds, st.sampled_from(FIELDS), st.sampled_from(FIELDS), st.sampled_from([500.0, 569.0]))
def test_random_prints_and_their_impressions(seed, field, other_field, dpi):
    rng = np.random.default_rng(seed)
    a = along(any_print(seed)) if seed % 2 else any_print(seed)
    bent = distorted(a, rng.uniform(-3, 3)) if a.shape[1] else a
    worn = jittered(rng, moved(bent, rng.uniform(-3, 3), complex(150, -150)), 1.5, 0.1)
    b = np.hstack([worn[:, int(rng.integers(0, 6)) :], any_print(seed + 1)[:, :6]])
    b[:2] = np.rint(b[:2])
    quality = rng.integers(0, 101, b.shape[1])
    sides = [template_of(a, field=field), template_of(b, dpi, quality, other_field)]
    sides += [template_of(any_print(seed + 2)[:, : seed % 5], field=field), EMPTY]
    for probe, reference in combinations(map(prepared, sides), 2):
        hold_equal(probe, reference)
        hold_equal(reference, probe)


def hold_meshes_equal(a, b, partner):
    """Hold the meshes of given pairs, and what they predict, equal."""
    n = a.shape[1]
    kernel = PairMesh(USUAL, n)
    kernel.build(a, n, b, partner.astype(np.int32), 1.0, 0.0, 0.0, 0.0)
    kernel.predict(a, n, b, partner.astype(np.int32), 1.0, 0.0, 0.0, 0.0, False)
    mesh, place, direction, nearest = Pairing(a, b, partner, np.ones(n)).mesh
    assert mesh.owner.tolist() == np.array(kernel.owner)[: kernel.vertices].tolist()
    ours, theirs = (
        {tuple(sorted(corners)) for corners in triangles.tolist()}
        for triangles in (mesh.triangles, np.array(kernel.corner)[: kernel.triangles])
    )
    assert ours == theirs
    rows = place.real, place.imag, direction.real, direction.imag, nearest
    expected = *np.array(kernel.predicted)[:, :n], np.array(kernel.nearest)
    np.testing.assert_allclose(rows, expected, rtol=0, atol=1e-9)


@given(seeds)
def test_crowded_pairs_have_the_same_mesh_and_rings(seed):
    rng = np.random.default_rng(seed)
    a = on_pixels(rng, int(rng.integers(1, 20)))
    a[:2] *= rng.choice([1.0, 500 / 569])  # exactly on one circle, or but for rounding
    partner = np.where(rng.random(a.shape[1]) < 0.7, np.arange(a.shape[1]), -1)
    hold_meshes_equal(a, jittered(rng, a, 1.0, 0.1), partner)


def test_a_ring_of_one_place_turns_nothing():
    a = along(on_pixels(np.random.default_rng(1), 20))
    hold_meshes_equal(a, a * [[0], [0], [1], [1]], np.arange(a.shape[1]))


def test_a_pair_on_the_border_of_a_wide_mesh_has_no_ring():
    """The octagon of the frame points does not hold the corners of a very wide print."""
    z = np.array([0, 293 + 32765j])
    mesh = pair_mesh.mesh_of_pairs(z, z, np.arange(2), (1 + 0j, 0j))
    assert not mesh.once(np.arange(2)).any()
    assert set(pair_mesh.measure(mesh, z, np.arange(2), z).values()) == {0.0}


@pytest.mark.parametrize("first", range(4))
def test_of_co_circular_points_the_last_is_not_on_the_diagonal(first):
    square = np.roll(np.array([0, 1, 1 + 1j, 1j]), first)
    across = pair_mesh.triangulate(square)
    assert np.count_nonzero(across[-1] >= 0) == 1


def test_verification_by_the_reference(samples):
    assert get_matcher("reference") is REFERENCE
    assert (COMPILED_MATCHER.by_reference, REFERENCE.by_reference) == (False, True)
    assert load_calibration("reference") == load_calibration("unit-circle")
    plain, compiled = (verify(*samples[:2], matcher=name) for name in ("reference", "unit-circle"))
    assert plain.match == compiled.match
    assert plain.score == pytest.approx(compiled.score, abs=1e-6)
    assert plain.reason == compiled.reason


def test_eq_3_enters_by_the_places_on_the_circle():
    prints = [method.prepare(extract(path)) for path in SAMPLES[:3:2]]
    _, before = method.match(*prints)
    _, after = method.match(*prints, ReferenceMatcher(place_tolerance=0.15).parameters)
    assert after.places < before.places
    assert after.total != before.total


def test_the_reference_imports_no_kernel_of_the_matcher():
    program = f"import sys, {method.__name__}; print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    kernels = [name for name in run.stdout.split() if name.endswith("_kernel")]
    assert not [name for name in kernels if name.startswith("fpmatch.matching.")]


def test_a_candidate_that_nothing_supports_starts_no_hypothesis_without_inertia():
    a = np.array([[0.0], [0.0], [1.0], [0.0]])
    parameters = MatchParameters(inertia=0.0)
    assert relax(a, a, np.ones((1, 1), np.float32), parameters).seeds == []
