"""The warp through the pairs: exact at the pairs, continuous, and nothing but a look."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch import extract, read_image, verify
from fpmatch.drawing.overlay.page import Print, ink_of
from fpmatch.drawing.overlay.superposed import probe_outline
from fpmatch.drawing.overlay.warp import pair_warp
from fpmatch.drawing.scene.items import Box, of_transform
from fpmatch.drawing.scene.palette import PROBE_INK, REFERENCE_INK
from fpmatch.matching.result import Comparison
from fpmatch.matching.verification import Verification
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template

SAMPLES = Path(__file__).parents[2] / "sample_data"
SIZE = 400
seeds = st.integers(0, 2**32 - 1)


def stretched(seed, count, most_px):
    """Return a verification whose pairs lie apart by up to so much under its transform."""
    rng = np.random.default_rng(seed)
    transform = Similarity(rng.uniform(0.8, 1.25), rng.uniform(-3, 3), *rng.uniform(-90, 90, 2))
    ours = rng.uniform(60, 340, (count + 3, 2))
    theirs = transform.apply(ours) + rng.uniform(-most_px, most_px, ours.shape)
    sides = [
        Template(Minutiae(xy[:, 0], xy[:, 1], np.full(len(xy), 0.4)), SIZE, SIZE)
        for xy in (ours, theirs)
    ]
    pairs = np.repeat(np.arange(count, dtype=np.int32)[:, None], 2, axis=1)
    found = Comparison(3.0, transform, pairs, 1.0, 0.5, 0.5)
    return Verification(True, 50.0, 1e-5, 40.0, "unit-circle", found, *sides)


def areas(triangles):
    u, v = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


@given(seeds, st.integers(3, 40), st.floats(0, 12))
def test_it_is_exact_at_the_pairs_and_its_inverse_undoes_it(seed, count, most_px):
    verification = stretched(seed, count, most_px)
    warp, words = pair_warp(verification)
    if warp is None:
        assert words == "similarity transform, not warped: the mesh of the pairs folds over"
        return
    assert str(warp.pairs) in words
    assert (areas(warp.before[warp.mesh.simplices]) > 0).all()
    back = warp.transform.inverse().apply(warp.before)
    used = np.unique(warp.mesh.simplices)
    np.testing.assert_allclose(warp.to_reference(back[used]), warp.after[used], atol=1e-3)
    points = np.random.default_rng(seed).uniform(-50, SIZE + 50, (60, 2))
    there = warp.to_reference(points)
    expected = warp.transform.apply(points)
    np.testing.assert_allclose(there + warp.displacement(there), expected, atol=1e-3)


def test_pairs_that_lie_together_are_not_folded():
    """All but one of the pairs are kept: one leaps over the others."""
    verification = stretched(1, 30, 0.5)
    theirs = verification.reference.minutiae
    x, y = theirs.x.copy(), theirs.y.copy()
    x[4], y[4] = x[11] + 2, y[11] + 2
    moved = replace(theirs, x=x, y=y)
    leaping = replace(verification, reference=replace(verification.reference, minutiae=moved))
    warp, words = pair_warp(leaping)
    assert 27 <= warp.pairs < 30
    assert words == f"warped through {warp.pairs} of 30 pairs: for looking, not for measuring"


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_pairs_warp_nothing(count):
    assert pair_warp(stretched(3, count, 4.0)) == (
        None,
        "similarity transform, not warped: fewer than three pairs",
    )


def test_mirrored_pairs_fold_over():
    verification = stretched(5, 3, 0.0)
    mirrored = verification.comparison.pairs[:, ::-1].copy()
    mirrored[:2, 1] = mirrored[1::-1, 1]
    swapped = replace(verification.comparison, pairs=mirrored)
    warp, words = pair_warp(replace(verification, comparison=swapped))
    assert warp is None
    assert words.endswith("folds over")


def test_without_a_transform_there_is_no_warp():
    verification = stretched(3, 9, 4.0)
    nothing = replace(verification.comparison, transform=None)
    assert pair_warp(replace(verification, comparison=nothing))[0] is None


def test_far_away_the_transform_holds():
    verification = stretched(7, 12, 9.0)
    warp, _ = pair_warp(verification)
    far = np.array([[-900.0, 40.0], [2000.0, 2000.0]])
    np.testing.assert_allclose(warp.to_reference(far), warp.transform.apply(far))
    minutia = Minutiae([-900.0], [40.0], [0.7])
    turned = warp.minutiae(minutia).angle[0]
    assert turned == pytest.approx((0.7 - warp.transform.rotation) % (2 * np.pi), abs=1e-4)


def test_the_outline_of_the_probe_is_whole():
    verification = stretched(7, 12, 9.0)
    warp, _ = pair_warp(verification)
    side = Print(np.full((SIZE, SIZE), 255, np.uint8), verification.probe)
    matrix = of_transform(verification.transform)
    corners = np.array(probe_outline(side, matrix))
    outline = np.array(probe_outline(side, matrix, warp))
    apart = np.hypot(*(corners[:, None] - outline[None]).transpose(2, 0, 1)).min(axis=1)
    assert (apart < 10).all()


def test_ridges_of_a_stretched_finger_coincide_better():
    images = [read_image(SAMPLES / f"101_{k}.tif") for k in (1, 3)]
    found = verify(*map(extract, images))
    warp, words = pair_warp(found)
    assert words.startswith(f"warped through {len(found.pairs)} pairs")
    probe, reference = (
        Print(image.pixels, side)
        for image, side in zip(images, (found.probe, found.reference), strict=True)
    )
    upright = np.eye(3)
    panel = Box(-0.5, -0.5, found.reference.width, found.reference.height)
    theirs = ink_of(reference, upright, REFERENCE_INK, "").coverage > 128
    ours = ink_of(probe, of_transform(found.transform), PROBE_INK, "")
    still = replace(warp, before=warp.after)
    shares = []
    for one in (still, warp):
        coverage = one.ink(ours, upright, panel).coverage > 128
        assert coverage.shape == theirs.shape
        shares.append((coverage & theirs).sum() / coverage.sum())
    assert shares[1] > shares[0] + 0.05
