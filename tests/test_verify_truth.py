"""From images to decisions where the truth is known: the sample prints, and two of the FVC."""

import itertools
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.matching.constants import COMPILED
from fpmatch.matching.verify import verify
from fpmatch.pointset.geometry.similarity import Similarity
from research.ground_truth import common_minutiae, load_truth

SAMPLES = Path(__file__).resolve().parents[1] / "sample_data"
DATASET = load_dataset(SAMPLES)
IMPRESSIONS = [impression.path.stem for impression in DATASET.impressions]
TRUTH = dict(zip(IMPRESSIONS, load_truth(DATASET), strict=True))
FINGERS = sorted({name.partition("_")[0] for name in IMPRESSIONS})
WHITE = 255


# Interpreted kernels take a hundred times as long: one case in so many is tried there.
STRIDE = 1 if COMPILED else 8


def same_finger(pair):
    return pair[0].partition("_")[0] == pair[1].partition("_")[0]


PAIRS = list(itertools.combinations(IMPRESSIONS, 2))


@cache
def pixels_of(name):
    return read_image(SAMPLES / f"{name}.tif").pixels


@cache
def template_of(name):
    return extract(SAMPLES / f"{name}.tif")


@cache
def result_of(probe, reference):
    return verify(template_of(probe), template_of(reference))


def centre_of(print_):
    """Return the middle of where the ridges are, shape (1, 2), in pixels."""
    rows, columns = np.nonzero(print_.field.mask)
    return (np.array([[columns.mean(), rows.mean()]]) + 0.5) * print_.field.step


def assert_near(transform, expected, at, deg, px):
    """Hold a transform to an expected rotation, and to where it takes the point `at`."""
    assert abs(Similarity(rotation=transform.rotation - expected.rotation).rotation_deg) <= deg
    assert np.hypot(*(transform.apply(at) - expected.apply(at))[0]) <= px


def placed(image, place, size):
    """Return `image` moved by `place` onto white paper of that size (width, height)."""
    return cv2.warpAffine(image, place.matrix, size, flags=cv2.INTER_CUBIC, borderValue=WHITE)


def turned_about_the_middle(image, degrees):
    """Return `image` turned on paper that holds it all, and the transform that did it."""
    height, width = image.shape
    side = round(np.hypot(width, height)) + 20
    turn = Similarity(rotation=np.radians(degrees))
    middle = turn.apply([[width / 2, height / 2]])[0]
    place = Similarity(1.0, turn.rotation, side / 2 - middle[0], side / 2 - middle[1])
    return placed(image, place, (side, side)), place


def assert_change_is_recovered(name, changed, change):
    """Hold the transforms from a changed print to those from the print, after undoing the change.

    Against the finger's impressions by the same sensor, and one by the other.
    """
    finger = name.partition("_")[0]
    for number in (1, 3, 4) if COMPILED else (3,):
        reference = f"{finger}_{number}"
        expected = result_of(name, reference).transform.after(change.inverse())
        after = verify(changed, template_of(reference))
        assert after.match
        assert_near(after.transform, expected, change.apply(centre_of(template_of(name))), 1, 2)


@pytest.mark.parametrize(("probe", "reference"), PAIRS[::STRIDE])
def test_a_pair_matches_where_it_truly_lies_if_it_is_genuine(probe, reference):
    """The same minutia of the finger, by the truth of both impressions, meets to within 12 px."""
    result = result_of(probe, reference)
    assert result.match == same_finger((probe, reference)) == (result.reason == "")
    if not result.match:
        return
    p, q = common_minutiae(TRUTH[probe], TRUTH[reference])
    assert len(p) >= 7
    true = TRUTH[reference].transform.after(TRUTH[probe].transform.inverse())
    assert_near(result.transform, true, p.mean(axis=0, keepdims=True), deg=3, px=4)
    assert result.transform.scale == pytest.approx(true.scale, abs=0.05)
    off = result.transform.apply(p) - q
    assert np.hypot(*off.T).max() < 12
    assert np.sqrt((off**2).sum(axis=1).mean()) < 6


@pytest.mark.parametrize("change", [-135, 4, 33, 180, 2.0, 569 / 500])
@pytest.mark.parametrize("finger", FINGERS[:: 1 if COMPILED else 4])
def test_a_change_of_an_image_changes_the_transform_by_as_much(finger, change):
    """By some degrees, or by the factor of a finer scan."""
    name = f"{finger}_1"
    if isinstance(change, int):
        image, moved = turned_about_the_middle(pixels_of(name), change)
        assert_change_is_recovered(name, extract(image, dpi=500), moved)
        return
    height, width = pixels_of(name).shape
    size = (round(width * change), round(height * change))
    image = np.asarray(cv2.resize(pixels_of(name), size, interpolation=cv2.INTER_CUBIC), np.uint8)
    # The centre of the first pixel stands half a pixel in, at either resolution.
    moved = Similarity(change, 0.0, (change - 1) / 2, (change - 1) / 2)
    fine = extract(image, dpi=500 * change)
    assert_change_is_recovered(name, fine, moved)
    assert verify(template_of(name), fine).transform.scale == pytest.approx(change, rel=0.01)
