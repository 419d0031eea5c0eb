from dataclasses import replace

import numpy as np
import pytest

from fpmatch.drawing.scene.ink import ink_coverage, ink_of, ridge_picture, shrunk
from fpmatch.image.extract import extract
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template


def stripes(contrast, level=128.0, period=9.0, shape=(120, 140)):
    x = np.arange(shape[1])
    wave = level + contrast * np.cos(2 * np.pi * x / period)
    return np.broadcast_to(wave, shape).astype(np.uint8)


def test_ridges_are_covered_and_valleys_bare():
    image = stripes(60)
    coverage = ink_coverage(image, 500)
    assert coverage.dtype == np.uint8
    assert coverage.shape == image.shape
    inner = coverage[30:-30, 30:-30]
    assert inner[image[30:-30, 30:-30] < 80].min() > 200
    assert inner[image[30:-30, 30:-30] > 170].max() == 0


def test_neither_contrast_nor_light_matters():
    slope = np.linspace(0, 90, 120)[:, None]
    uneven = (stripes(50, level=60) + slope).astype(np.uint8)
    for one, other in ((stripes(90), stripes(12, level=200)), (stripes(50), uneven)):
        difference = np.abs(ink_coverage(one, 500).astype(int) - ink_coverage(other, 500))
        assert difference[20:-20, 20:-20].mean() < 15


def test_uniform_images_and_noise_are_bare(rng):
    for value in (0, 128, 255):
        assert not ink_coverage(np.full((60, 50), value, np.uint8), 500).any()
    noise = (128 + rng.normal(0, 1.5, (100, 100))).astype(np.uint8)
    assert ink_coverage(noise, 500).mean() < 10


def test_resolution_sets_the_neighbourhood():
    fine = ink_coverage(stripes(60, period=18, shape=(240, 280)), 1000)
    coarse = ink_coverage(stripes(60), 500)
    assert fine.mean() == pytest.approx(coarse.mean(), rel=0.05)


def test_ink_off_the_print_is_thinned_in_place():
    image, mask = stripes(60, shape=(80, 80)), np.zeros((10, 10), bool)
    mask[:, :4] = True
    template = Template(Minutiae.empty(), 80, 80, field=RidgeField(8.0, np.zeros((10, 10)), mask))
    for zoom in (1.0, 0.5):
        matrix = np.diag([zoom, zoom, 1.0])
        bare = replace(template, field=None)
        (ink,), (full,) = (ink_of(image, t, matrix, (0, 0, 0), "") for t in (template, bare))
        edge = round(32 * zoom)
        assert (ink.coverage[:, :edge] == full.coverage[:, :edge]).all()
        right = np.s_[:, edge + round(16 * zoom) :]
        assert ink.coverage[right].max() == pytest.approx(0.2 * full.coverage[right].max(), abs=1)


def test_a_print_that_is_a_dot_or_one_flat_pixel_has_no_ink():
    template = Template(Minutiae.empty(), 140, 120)
    for zoom in (1e-4, 1e4):
        matrix = np.diag([zoom, zoom, 1.0])
        assert ink_of(stripes(60), template, matrix, (0, 0, 0), "") == ()


def test_shrinking_averages():
    checkers = np.indices((40, 60)).sum(axis=0).astype(np.uint8) % 2 * 200
    small = shrunk(checkers, 0.5)
    assert small.shape == (20, 30)
    assert (small == 100).all()
    assert shrunk(checkers, 1.0) is checkers
    assert shrunk(checkers, 1e-9).shape == (1, 1)


@pytest.mark.parametrize("dpi", [500, 700])
def test_ridges_of_a_template_lie_where_the_picture_has_them(fingers, dpi):
    picture = ridge_picture(extract(fingers[0], dpi))
    assert picture.shape == fingers[0].shape
    assert (picture < 255).mean() > 0.2
    inside = np.s_[60:240, 60:220]
    assert np.corrcoef(picture[inside].ravel(), fingers[0][inside].ravel())[0, 1] > 0.6


def test_without_ridges_the_paper_is_white():
    assert (ridge_picture(Template(Minutiae.empty(), width=30, height=20)) == 255).all()
