import json
import math

import cv2
import numpy as np
import pytest

from fpmatch.lab.evaluation.databases.dataset import load_dataset
from research.experiments.image_statistics import (
    DatabaseStatistics,
    ImageStatistics,
    format_statistics,
    measure_image,
    measure_sets,
    share_outside,
    span,
    statistics_as_json,
)

PERIOD = 10.0
SIDE = 160


def stripes():
    """Return ridges upright in a square, with a margin of white around them."""
    grey = np.full((SIDE + 80, SIDE + 80), 255.0)
    grey[40:-40, 40:-40] = 128 + 90 * np.cos(2 * np.pi * np.arange(SIDE) / PERIOD)
    return np.rint(grey).astype(np.uint8)


def database(name, quantity, values, failures=()):
    """Return a database whose prints are the usual one, but for one quantity."""
    usual = {"period_px": 9.0, "area_mm2": 150.0, "minutiae_per_mm2": 0.2, "mean": 200.0}
    usual |= {"contrast": 60.0, "ridge_contrast": 70.0, "foreground": 0.5}
    prints = tuple(ImageStatistics(**usual | {quantity: value}) for value in values)
    return DatabaseStatistics(name, prints, failures, tuple(range(len(prints))))


def test_a_print_of_known_ridges(tmp_path):
    """The same skin at twice the resolution has the same period and the same area."""
    picture = stripes()
    cv2.imwrite(str(tmp_path / "1_1.png"), picture)
    cv2.imwrite(str(tmp_path / "1_2.png"), cv2.resize(picture, None, fx=2, fy=2))
    found, twice = (measure_image(tmp_path / f"1_{n}.png", dpi) for n, dpi in ((1, 500), (2, 1000)))
    assert found.period_px == pytest.approx(PERIOD, rel=0.05)
    assert found.area_mm2 == pytest.approx((SIDE * 25.4 / 500) ** 2, rel=0.2)
    assert found.mean == pytest.approx(picture.mean())
    assert found.contrast == pytest.approx(picture.std())
    assert found.ridge_contrast == pytest.approx(90 / math.sqrt(2), rel=0.15)
    assert found.foreground == pytest.approx((SIDE / (SIDE + 80)) ** 2, rel=0.2)
    assert twice.period_px == pytest.approx(found.period_px, abs=0.2)
    assert len(found.patches) > 0
    assert twice.area_mm2 == pytest.approx(found.area_mm2, rel=0.1)


def test_a_blank_picture_has_no_ridges_to_measure(tmp_path):
    cv2.imwrite(str(tmp_path / "1_1.png"), np.full((100, 100), 200, np.uint8))
    found = measure_image(tmp_path / "1_1.png", 500)
    assert (found.area_mm2, found.foreground, found.mean) == (0.0, 0.0, 200.0)
    assert math.isnan(found.minutiae_per_mm2)
    assert np.isnan(DatabaseStatistics("one", (found,)).quantiles("period_px")).all()


def test_databases_are_measured_in_order_and_failures_kept(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        cv2.imwrite(str(tmp_path / name / "1_1.png"), np.full((64, 64), 90, np.uint8))
    (tmp_path / "a" / "1_2.png").write_text("no picture")
    sets = measure_sets([load_dataset(tmp_path / name) for name in ("a", "b")], workers=1)
    assert [(s.name, len(s.prints), len(s.failures)) for s in sets] == [("a", 1, 1), ("b", 1, 0)]
    assert "1_2.png" in sets[0].failures[0]


def test_what_databases_span_and_what_lies_outside():
    thin, wide = (database("real", "period_px", [px] * 3) for px in (8.0, 10.0))
    mixed = database("mixed", "period_px", (7.0, 8.5, 9.5, math.nan))
    assert span([thin, wide], "period_px") == (8.0, 10.0)
    assert share_outside(mixed, [thin, wide], "period_px") == pytest.approx(1 / 3)
    assert share_outside(mixed, [thin, wide], "mean") == 0.0


def test_tables_have_a_row_a_database_and_json_says_the_same():
    one = database("one", "mean", (180.0, 190.0, 200.0), ("bad",))
    real = database("real", "mean", (188.0, 191.0))
    document = json.loads(json.dumps(statistics_as_json([one], [real]), allow_nan=False))
    head, _, *rows = format_statistics(document).splitlines()
    at = [cell.strip() for cell in head.split("|")].index("mean grey")
    cells = [row.split("|")[at].strip() for row in rows]
    assert cells == ["190 (181–199)", "190 (188–191)", "67 %"]
    assert document["sets"][0]["quantiles"]["mean"] == [181.0, 185.0, 190.0, 195.0, 199.0]
    assert document["sets"][0]["outside"]["mean"] == pytest.approx(2 / 3, abs=1e-4)
    assert document["sets"][0]["failures"] == ["bad"]
    assert document["sets"][0]["two_sample"]["all"] is None  # there are no patches
    assert document["against"][0]["prints"] == 2
    assert "outside" not in statistics_as_json([one])["sets"][0]
