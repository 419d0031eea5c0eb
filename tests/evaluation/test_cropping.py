"""`fpmatch.evaluation.cropping`: squares of prints as probes, whole prints as references."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from fpmatch.errors import ImageError
from fpmatch.evaluation.comparison import NO_TEMPLATE
from fpmatch.evaluation.cropping import crop_about_centroid, extract_crop, failed_crops
from fpmatch.evaluation.run import evaluate_matchers
from fpmatch.image.io.read import GreyImage
from fpmatch.minutiae import Minutiae, RidgeField, Template


def numbered(height, width, dpi=500.0):
    """Return an image whose grey values tell a pixel's place, up to 256 px."""
    y, x = np.mgrid[:height, :width]
    return GreyImage(((x + y) % 256).astype(np.uint8), dpi=dpi)


def with_mask(mask, width, height, dpi=500.0, step=10.0):
    field = RidgeField(step, np.zeros(mask.shape, np.float32), mask, None)
    return Template(Minutiae.empty(), width, height, dpi, field)


def test_the_square_lies_about_the_centroid_of_the_mask():
    mask = np.zeros((30, 20), bool)
    mask[10:14, 4:8] = True  # from (40, 100) to (80, 140): centroid (60, 120)
    image = numbered(300, 200)
    square = crop_about_centroid(image, with_mask(mask, 200, 300), 50)
    assert np.array_equal(square.pixels, image.pixels[95:145, 35:85])
    assert (square.dpi, square.source) == (image.dpi, image.source)


def test_without_a_ridge_field_the_minutiae_say_where_the_print_is():
    image = numbered(300, 200)
    template = Template(Minutiae([90.0, 110.0], [100.0, 200.0], [0.0, 0.0]), 200, 300)
    square = crop_about_centroid(image, template, 40)
    assert np.array_equal(square.pixels, image.pixels[130:170, 80:120])


@pytest.mark.parametrize(("dpi", "side"), [(250.0, 32), (500.0, 64), (1000.0, 128)])
def test_the_side_is_in_pixels_at_500_dpi(dpi, side):
    template = with_mask(np.ones((30, 20), bool), 200, 300, dpi)
    assert crop_about_centroid(numbered(300, 200, dpi), template, 64).pixels.shape == (side, side)


@pytest.mark.parametrize("corner", [(0, 0), (0, 19), (29, 0), (29, 19)])
def test_a_square_beyond_the_image_is_moved_inwards(corner):
    mask = np.zeros((30, 20), bool)
    mask[corner] = True
    image = numbered(300, 200)
    square = crop_about_centroid(image, with_mask(mask, 200, 300), 100).pixels
    top, left = (
        0 if place == 0 else size - 100 for place, size in zip(corner, (300, 200), strict=True)
    )
    assert np.array_equal(square, image.pixels[top : top + 100, left : left + 100])


def test_a_square_is_no_larger_than_its_image():
    square = crop_about_centroid(numbered(90, 70), with_mask(np.ones((9, 7), bool), 70, 90), 500)
    assert square.pixels.shape == (90, 70)


def test_an_image_without_a_print_is_refused():
    with pytest.raises(ImageError, match="no print found"):
        crop_about_centroid(numbered(90, 70), Template(Minutiae.empty(), 70, 90), 50)


def test_a_blank_image_has_no_square(tmp_path):
    blank = GreyImage(np.full((120, 120), 255, np.uint8), dpi=500, source="blank.png")
    with pytest.raises(ImageError, match=r"blank\.png: no print found"):
        extract_crop(tmp_path / "blank.png", None, 64, reader=lambda _: blank)


def shifted(extractor, apart, path, dpi):
    """Move the minutia of `fake_bench`'s prints; those of finger 2 have no template."""
    if path.stem.startswith("2_"):
        return Template(Minutiae.empty(), 10, 10)
    whole = extractor(path, dpi)
    return Template(Minutiae(whole.minutiae.x + apart, [0.0], [0.0]), 10, 10, whole.dpi)


def test_the_first_print_of_a_pair_is_the_square(bench, make_database):
    folder = make_database(fingers=3, impressions=2, contents={"3_2": "broken"})
    squares = partial(shifted, bench.extractor, 7.0)
    (report,) = evaluate_matchers(
        [folder],
        [bench.MATCHER],
        workers=1,
        extractor=bench.extractor,
        probe_extractor=squares,
    )
    (row,) = report.sets
    impressions = row.extracted.dataset.impressions
    for i, j, outcome in zip(row.pairs.probe, row.pairs.reference, row.outcomes, strict=True):
        probe, reference = impressions[i].path, impressions[j].path
        if probe.stem.startswith("2_") or reference.stem == "3_2":
            assert (outcome["similarity"], outcome["reason"]) == (0.0, NO_TEMPLATE)
            continue
        a, b = (
            bench.MATCHER.prepare(squares(probe, None)),
            bench.MATCHER.prepare(bench.extractor(reference, None)),
        )
        assert outcome["similarity"] == bench.MATCHER.compare(a, b).similarity
    assert [path.name for path in failed_crops(report.sets)] == ["2_1.tif", "2_2.tif"]


def test_probes_are_told_of_as_a_stage_of_their_own(bench, make_database):
    stages = []
    evaluate_matchers(
        [make_database(fingers=2, impressions=2)],
        [bench.MATCHER],
        workers=1,
        progress=lambda stage, *_: stages.append(stage),
        extractor=bench.extractor,
        probe_extractor=bench.extractor,
    )
    assert list(dict.fromkeys(stages)) == ["extract", "extract probes", "compare"]
