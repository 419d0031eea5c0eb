from functools import partial

import numpy as np

from fpmatch.gallery.batch.comparer import NO_TEMPLATE
from fpmatch.image.io.read import GreyImage
from fpmatch.lab.evaluation.cropping import crop_about_centroid, failed_crops
from fpmatch.lab.evaluation.run import evaluate_matchers
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template


def numbered(height, width, dpi=500.0):
    """Return an image whose grey values tell a pixel's place, up to 256 px."""
    y, x = np.mgrid[:height, :width]
    return GreyImage(((x + y) % 256).astype(np.uint8), dpi=dpi)


def with_mask(mask, width, height, dpi=500.0, step=10.0):
    field = RidgeField(step, np.zeros(mask.shape, np.float32), mask, None)
    return Template(Minutiae.empty(), width, height, dpi, field)


def test_the_square_lies_about_the_centroid_of_the_mask_else_of_the_minutiae():
    mask = np.zeros((30, 20), bool)
    mask[10:14, 4:8] = True  # from (40, 100) to (80, 140): centroid (60, 120)
    image = numbered(300, 200)
    square = crop_about_centroid(image, with_mask(mask, 200, 300), 50)
    assert np.array_equal(square.pixels, image.pixels[95:145, 35:85])
    assert (square.dpi, square.source) == (image.dpi, image.source)
    template = Template(Minutiae([90.0, 110.0], [100.0, 200.0], [0.0, 0.0]), 200, 300)
    square = crop_about_centroid(image, template, 40)
    assert np.array_equal(square.pixels, image.pixels[130:170, 80:120])


def shifted(extractor, apart, path, dpi):
    """Move the minutia of `fake_bench`'s prints; those of finger 2 have no template."""
    if path.stem.startswith("2_"):
        return Template(Minutiae.empty(), 10, 10)
    whole = extractor(path, dpi)
    return Template(Minutiae(whole.minutiae.x + apart, [0.0], [0.0]), 10, 10, whole.dpi)


def test_the_first_print_of_a_pair_is_the_square(bench, make_database):
    folder = make_database(fingers=3, impressions=2, contents={"3_2": "broken"})
    squares, stages = partial(shifted, bench.extractor, 7.0), []
    (report,) = evaluate_matchers(
        [folder],
        [bench.MATCHER],
        workers=1,
        progress=lambda stage, *_: stages.append(stage),
        extractor=bench.extractor,
        probe_extractor=squares,
    )
    assert list(dict.fromkeys(stages)) == ["extract", "extract probes", "compare"]
    (row,) = report.sets
    paths = [impression.path for impression in row.extracted.dataset.impressions]
    for i, j, outcome in zip(row.pairs.probe, row.pairs.reference, row.outcomes, strict=True):
        if paths[i].stem.startswith("2_") or paths[j].stem == "3_2":
            assert (outcome["similarity"], outcome["reason"]) == (0.0, NO_TEMPLATE)
            continue
        made = squares(paths[i], None), bench.extractor(paths[j], None)
        found = bench.MATCHER.compare(*map(bench.MATCHER.prepare, made))
        assert outcome["similarity"] == found.similarity
    assert [path.name for path in failed_crops(report.sets)] == ["2_1.tif", "2_2.tif"]
