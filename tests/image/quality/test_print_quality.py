import json
import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.image.extract import assess
from fpmatch.image.io.read import read_image
from fpmatch.image.quality.measures import QualityMeasures, measure_quality
from fpmatch.image.quality.print_quality import WEIGHTS_FILE, grade
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS

SAMPLES = Path(__file__).parents[3] / "sample_data"
OPTICAL = SENSORS["optical-388x374"]


finger = cache(lambda: make_master(11, 2))


@cache
def pressed(dryness=0.0, sensor=OPTICAL):
    """Return a careful impression, dry or wet."""
    clean = PRESETS["clean"]
    pressure = replace(clean.pressure, dryness=(dryness, dryness))
    return make_impression(finger(), 1, replace(clean, pressure=pressure), sensor).image


def spoilt(fault):
    """Return a picture at 500 dpi with one fault."""
    image = pressed()
    rows, columns = image.shape
    match fault:
        case "too dry":
            return pressed(1.05)
        case "too wet":
            return pressed(-1.05)
        case "faint":
            return np.rint(210 + image / 10.0).astype(np.uint8)
        case "blurred":
            return np.asarray(cv2.GaussianBlur(image, (0, 0), 2.0), np.uint8)
        case "partial":
            beyond = np.arange(rows) < 0.68 * rows
            return np.where(beyond[:, None], np.uint8(254), image)
        case "too small":
            top, left = rows // 2 - 80, columns // 2 - 80
            return np.ascontiguousarray(image[top : top + 160, left : left + 160])
    return np.full((300, 300), 255, np.uint8)


FAULTS = ("faint", "too dry", "too wet", "blurred", "partial", "too small", "no ridges")


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_is_named_and_no_other(fault):
    found = assess(spoilt(fault), 500)
    assert {reason.code for reason in found.quality.reasons} == {fault}
    if fault in {"partial", "too small", "no ridges"}:
        assert found.quality.score < assess(pressed(), 500).quality.score - 10
    assert fault in str(found.quality)
    if fault == "faint":
        assert re.search(r"contrast of (\d+) grey levels", str(found.quality))
        assert abs(found.quality.score - assess(pressed(), 500).quality.score) < 10
    assert "\n" not in str(found.quality)


@pytest.mark.parametrize("name", sorted(SENSORS))
def test_a_clean_print_has_no_fault_and_a_high_score(name):
    sensor = SENSORS[name]
    found = assess(pressed(sensor=sensor), sensor.dpi)
    assert found.quality.reasons == ()
    assert found.quality.score > 60


@pytest.mark.parametrize("sigma_px", [0.0, 1.5])
@pytest.mark.parametrize("shape", [(200, 300), (48, 48)])
def test_neither_noise_nor_blots_have_a_resolution(sigma_px, shape, rng):
    noise = rng.normal(0, 1, shape)
    if sigma_px:
        noise = cv2.GaussianBlur(noise, (0, 0), sigma_px)
    grey = np.clip(128 + 60 * noise / noise.std(), 0, 255).astype(np.uint8)
    assert "wrong resolution" not in str(assess(grey, 500).quality)


@given(
    st.builds(
        QualityMeasures,
        image_mm2=st.floats(1, 5000),
        ridges_mm2=st.floats(0, 1000),
        minutiae=st.floats(0, 1e4),
        dark_share=st.floats(0, 1) | st.just(math.nan),
        ridge_spread=st.floats(0, 3) | st.just(math.nan),
        valley_spread=st.floats(0, 3) | st.just(math.nan),
        period_px=st.floats(3, 30) | st.just(math.nan),
        detail=st.floats(0, 1e3) | st.just(math.nan),
    )
)
def test_any_figures_give_a_score_of_0_to_100(figures):
    quality = grade(figures, 500)
    assert 0 <= quality.score <= 100
    assert quality.as_dict()["score"] == quality.score


@pytest.mark.parametrize("name", ["101_1", "103_2", "104_3"])
def test_the_score_is_that_of_its_formula_and_its_file(name):
    image = read_image(SAMPLES / f"{name}.tif")
    assessed = assess(image)
    m = measure_quality(assessed.stages(with_maps=False))
    assert m.minutiae == pytest.approx(assessed.template.minutiae.quality.sum() / 100)
    off = max(math.log2(6 / m.period_px), math.log2(m.period_px / 12.3), 0)
    blur = max(math.log2(0.003 / max(m.detail, 0.003 / 64)), 0)
    features = [math.log(m.ridges_mm2), math.log(1 + m.minutiae)]
    features += [m.ridge_spread, m.valley_spread, off, blur]
    weights = json.loads(WEIGHTS_FILE.read_text())
    total = weights["bias"]
    for value, row in zip(features, weights["features"], strict=True):
        total += row["weight"] * (value - row["middle"]) / row["spread"]
    expected = round(100 / (1 + math.exp(-total)))
    assert assessed.quality.score == expected
