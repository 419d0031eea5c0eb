"""True minutiae, wherever the print lies and whatever its resolution."""

import math
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch import verify
from fpmatch.errors import ImageError, ResolutionError
from fpmatch.image.extract import assess, extract, resample
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.image.preprocess.foreground import stretch_contrast
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.matching.result import MATCH
from fpmatch.templates.minutiae import MinutiaKind
from research.ground_truth import load_truth
from tests.image.made_images import (
    as_picture,
    dislocation,
    hostile_pictures,
    turn_between,
)

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
DATASET = load_dataset(SAMPLES)
TRUTH = {
    impression.path.stem: truth.minutiae.take(truth.visible)
    for impression, truth in zip(DATASET.impressions, load_truth(DATASET), strict=True)
}
SOME = ["101_1", "102_3", "103_1", "104_3"]  # on a white ground, as what is added around them
WAYS = ["learned", "filters"]
# Shares of true minutiae that are found, and of found ones that are true.
LEAST = {"learned": (0.89, 0.85), "filters": (0.91, 0.75)}
both_ways = pytest.mark.parametrize("way", WAYS)


@cache
def pixels_of(name):
    pixels = read_image(SAMPLES / f"{name}.tif").pixels
    pixels.setflags(write=False)
    return pixels


@cache
def template_of(name, way):
    return extract(pixels_of(name), dpi=500, enhance=way)


def pairs(a, b, max_px, max_deg=180):
    """Return minutiae of `a` and `b` in one place and direction, one to one, nearest first."""
    distance = np.hypot(a.x[:, None] - b.x, a.y[:, None] - b.y)
    turn = turn_between(np.degrees(a.angle)[:, None], np.degrees(b.angle))
    near = np.argwhere((distance <= max_px) & (turn <= max_deg)).tolist()
    chosen = {}
    for i, j in sorted(near, key=lambda pair: distance[*pair]):
        if i not in chosen and j not in chosen.values():
            chosen[i] = j
    return list(chosen.items())


# --- pictures without a print, and bad input


@given(
    st.sampled_from(WAYS),
    arrays(np.uint8, st.tuples(st.integers(48, 110), st.integers(48, 110))),
    st.sampled_from([100.0, 250.0, 500.0, 731.5]),
    st.integers(0, 9),
)
def test_any_image_gives_minutiae_inside_it(way, noise, dpi, grain):
    image = cv2.GaussianBlur(noise, (2 * grain + 1,) * 2, 0)
    template = extract(image, dpi=dpi, enhance=way)
    height, width = image.shape
    m = template.minutiae
    assert (template.width, template.height, template.dpi) == (width, height, dpi)
    assert ((m.x >= -0.5) & (m.x < width) & (m.y >= -0.5) & (m.y < height)).all()
    assert set(m.kind.tolist()) <= {MinutiaKind.ENDING, MinutiaKind.BIFURCATION}


@both_ways
def test_a_picture_without_a_print_gives_next_to_nothing(way):
    for name, picture in hostile_pictures((180, 240)).items():
        template = extract(picture, dpi=500, enhance=way)
        assert len(template.minutiae) <= 3, name
        if name in {"black", "white", "grey"}:
            assert (len(template.minutiae), template.field) == (0, None)


def test_what_is_no_image_of_a_print_is_refused():
    for dpi in (0, 99, 4001, -500, math.nan, math.inf):
        with pytest.raises(ResolutionError, match="dpi"):
            extract(np.zeros((100, 100), np.uint8), dpi=dpi)
    for side, dpi in ((48, 4000), (200, 4000), (2100, 100)):
        with pytest.raises(ImageError, match=f"{dpi} to 500 dpi"):
            extract(np.zeros((side, side), np.uint8), dpi=dpi)
    with pytest.raises(ImageError, match=r"'gabor': .*learned, filters"):
        extract(pixels_of("102_2"), enhance="gabor")


# --- one minutia, known


@both_ways
@pytest.mark.parametrize(
    ("angle", "period"),
    [*((angle, 9) for angle in range(0, 360, 45)), (90, 7), (210, 11)],
)
@pytest.mark.parametrize("kind", ["ending", "bifurcation"])
def test_a_wave_with_one_dislocation_has_one_minutia(way, kind, angle, period):
    at = (83.0, 75.0)
    picture = as_picture(dislocation(angle, period, kind, (160, 170), at))
    m = extract(GreyImage(picture), dpi=500, enhance=way).minutiae
    assert len(m) == 1
    assert np.hypot(m.x[0] - at[0], m.y[0] - at[1]) <= 0.8 * period
    assert turn_between(np.degrees(m.angle[0]), angle) < 15
    if way == "filters" or period > 7:  # the finest ridges the network may take one for the other
        assert m.kind[0] == MinutiaKind[kind.upper()]
    assert m.quality[0] > 50


# --- prints whose minutiae are known


@both_ways
def test_true_minutiae_are_found_with_their_direction_and_mostly_kind_and_have_more_quality(way):
    of_true, of_others, turns, right = [], [], [], []
    for name, true in TRUTH.items():
        found = template_of(name, way).minutiae
        matched = {j for _, j in pairs(true, found, 12, 22.5)}
        for j, quality in enumerate(found.quality.tolist()):
            (of_true if j in matched else of_others).append(quality)
        for i, j in pairs(true, found, 8):
            turns.append(turn_between(np.degrees(true.angle[i]), np.degrees(found.angle[j])))
            right.append(found.kind[j] == true.kind[i])
    assert len(of_true) / sum(map(len, TRUTH.values())) > LEAST[way][0]
    assert len(of_true) / (len(of_true) + len(of_others)) > LEAST[way][1]
    assert np.mean(of_true) > np.mean(of_others) + 5
    assert len(turns) > 400
    assert np.mean(np.array(turns) <= 30) > 0.97
    assert np.mean(np.array(turns) > 150) < 0.01
    assert np.median(turns) < 8
    assert np.mean(right) > 0.7


@both_ways
@pytest.mark.parametrize("name", SOME)
def test_on_a_larger_page_minutiae_and_quality_are_the_same(name, way):
    pixels = pixels_of(name)
    height, width = pixels.shape
    found, scores = [], []
    for top, left in ((48, 48), (160, 96)):
        page = np.full((height + 240, width + 180), pixels[0, 0], np.uint8)
        page[top : top + height, left : left + width] = pixels
        assessed = assess(page, 500, enhance=way)
        minutiae = assessed.template.minutiae
        found.append((minutiae.x - left, minutiae.y - top, minutiae.angle, minutiae.quality))
        scores.append(assessed.quality.score)
    assert len(found[0][0]) > 10
    for one, other in zip(*found, strict=True):
        assert (one == other).all()
    assert scores[0] == scores[1] > 30


# --- what is handed in, and what comes out


@both_ways
@pytest.mark.parametrize("dpi", [500, 640])
def test_the_stages_are_whole_images_in_order_and_fit_together(way, dpi):
    pixels = np.full((500, 620), 255, np.uint8)  # a part of a print on a larger page
    pixels[96:296, 208:408] = pixels_of("101_1")[60:260, 60:260]
    assessed = assess(pixels, dpi, enhance=way)
    template, stages = assessed.template, assessed.stages()
    assert template == extract(pixels, dpi=dpi, enhance=way)
    names = ["input", "normalised", "enhanced", "mask", "orientation", "coherence"]
    names += ["period"] * (way == "filters") + ["binary", "skeleton", "minutiae"]
    assert list(stages) == names
    grey, zoom = resample(pixels, dpi)
    assert np.array_equal(stages["input"], grey)
    assert {stages[name].shape for name in names[:-1]} == {grey.shape}
    columns, minutiae = stages["minutiae"], template.minutiae
    assert columns.shape == (len(minutiae), 5)
    assert (columns[:, 0] + 0.5) / zoom - 0.5 == pytest.approx(minutiae.x, abs=1e-3)
    mask = stages["mask"]
    assert 0.05 < mask.mean() < 1
    for name in {"orientation", "period"} & set(stages):
        assert np.array_equal(np.isfinite(stages[name]), mask)
    assert not stages["enhanced"][~mask].any()
    assert not (stages["binary"] & ~mask).any()
    assert not (stages["skeleton"] & ~stages["binary"]).any()
    x, y = columns[:, :2].round().astype(int).T
    assert stages["skeleton"][y, x].all()
    check_field(template, stages, 500 / dpi)


def check_field(template, stages, zoom):
    """Check that the ridge field has the mask, the orientation and the ridges of the stages."""
    field = template.field
    height, width = stages["mask"].shape
    rows, columns = field.mask.shape
    assert field.step * zoom == pytest.approx(16)
    assert (rows, columns) == (-(-height // 16), -(-width // 16))
    centre_y = np.minimum(16 * np.arange(rows) + 8, height - 1)
    centre_x = np.minimum(16 * np.arange(columns) + 8, width - 1)
    at_centre = np.ix_(centre_y, centre_x)
    mask = stages["mask"][at_centre]
    assert np.mean(mask == field.mask) > 0.95
    both = mask & field.mask
    found, expected = field.orientation[both], stages["orientation"][at_centre][both]
    turn = turn_between(np.degrees(found), np.degrees(expected), period_deg=180)
    assert np.percentile(turn, 95) < 10
    whole = np.zeros((16 * rows, 16 * columns), bool)
    whole[:height, :width] = stages["binary"]
    dark = whole.reshape(8 * rows, 2, 8 * columns, 2).sum(axis=(1, 3)) >= 2
    for i, j in np.argwhere(field.mask):
        drawn = [bool(int(field.ridges[i, j]) >> k & 1) for k in range(64)]
        assert drawn == dark[8 * i : 8 * i + 8, 8 * j : 8 * j + 8].ravel().tolist()


def faint(name, share, kind):
    """Return a sample print with a share of its contrast, and something else besides."""
    shown = 235 - (255.0 - pixels_of(name)) * share
    rows, columns = shown.shape
    rng = np.random.default_rng(5)
    match kind:
        case "dark":
            shown = 17 + pixels_of(name) * share
        case "uneven light":
            shown -= 100 * np.arange(columns) / columns
        case "noise":
            shown += rng.normal(0, 1.0, shown.shape)
    shown = np.clip(np.rint(shown), 0, 255).astype(np.uint8)
    match kind:
        case "text":
            cv2.putText(shown, "Right index", (10, 60), cv2.FONT_HERSHEY_SIMPLEX, 1.2, 0, 3)
        case "blot":
            cv2.circle(shown, (60, rows - 60), 30, 0, -1)
        case "JPEG":
            shown = cv2.imdecode(cv2.imencode(".jpg", shown, [cv2.IMWRITE_JPEG_QUALITY, 75])[1], 0)
    return shown


@pytest.mark.parametrize(
    ("kind", "share"),
    [
        *((kind, 0.06) for kind in ("light", "dark", "text", "uneven light", "JPEG")),
        *(("light", 0.04), ("light", 0.2), ("noise", 0.1), ("blot", 0.1)),
    ],
)
def test_a_faint_print_matches_as_any_other(kind, share):
    for first, second in (("101_1", "101_3"), ("102_3", "102_1"), ("104_3", "104_1")):
        one, other = (extract(faint(name, share, kind), 500) for name in (first, second))
        assert verify(one, template_of(second, "learned")).decision == MATCH
        assert verify(one, other).decision == MATCH
    impostor = extract(faint("103_1", share, kind), 500)
    assert verify(impostor, other).score < 40


@pytest.mark.parametrize(("dpi", "quality"), [(363, 20), (500, 30), (1000, 50)])
def test_a_gradient_saved_as_jpeg_is_no_print(dpi, quality):
    y, x = np.mgrid[:400, :320]
    for span in (30, 60, 120, 200):
        away = np.hypot(x - 160, y - 200) / 257
        for shown in (250 - span * away**2, 130 + span / 2 * np.sin(x / 60) * np.cos(y / 80)):
            grey = np.rint(shown).astype(np.uint8)
            data = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
            assert not len(extract(cv2.imdecode(data, 0), dpi).minutiae)


def test_only_a_faint_print_is_stretched(rng):
    for name in SOME:
        assert stretch_contrast(pixels_of(name)) is pixels_of(name)
        assert stretch_contrast(faint(name, 0.3, "light")).std() > 10
    sheet, (y, x) = np.full((300, 400), 200.0), np.mgrid[:300, :400]
    for without_print in (
        sheet,
        sheet + rng.normal(0, 1, sheet.shape),
        sheet + rng.normal(0, 4, sheet.shape),
        sheet + rng.integers(-2, 3, sheet.shape),
        255 * x / 400,
        40 + 0.3 * x + 0.2 * y,
        200 - 100 * (((x - 200) / 300) ** 2 + ((y - 150) / 300) ** 2),
        sheet + 3 * np.cos(x * np.pi / 2) + 3 * np.cos(y * np.pi / 2),
    ):
        shown = np.clip(np.rint(without_print), 0, 255).astype(np.uint8)
        found = assess(shown, 500)
        assert not len(found.template.minutiae)
        assert "no ridges" in {reason.code for reason in found.quality.reasons}
