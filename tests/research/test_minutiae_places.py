import json
import shutil
from pathlib import Path

import minutiae_places
import numpy as np
import pytest
from click.testing import CliRunner

from fpmatch.cli.group import fpmatch
from fpmatch.templates.minutiae import Minutiae
from research.experiments.minutiae_places import (
    CORE_PX,
    PLACES,
    PlaceCounts,
    count_by_place,
    format_places,
    places_of,
)

ROOT = Path(__file__).parents[2]


def stripes(height=300, width=300):
    """Return a print of upright ridges from 50 to 250 in both axes, on white."""
    grey = np.full((height, width), 240.0)
    wave = 130 + 100 * np.cos(2 * np.pi * np.arange(50, 250) / 9)
    grey[50:250, 50:250] = wave
    return grey.astype(np.uint8)


def names_at(grey, x, y, cores=None):
    found = places_of(grey, 500.0, np.array([[x, y]]), cores)
    assert list(found) == list(PLACES)
    return {name for name, inside in found.items() if inside[0]}


@pytest.mark.parametrize(
    ("level", "contrast", "places"),
    [(0, 1.0, {"elsewhere", "all"}), (128, 0.35, {"faint", "all"}), (30, 0.3, {"smeared"})],
)
def test_the_middle_of_a_print_is_elsewhere_faint_or_smeared(level, contrast, places):
    """Where the contrast is low the print is faint, where valleys are filled it is smeared."""
    grey = stripes().astype(float)
    grey[120:180, 120:180] = level + contrast * (grey[120:180, 120:180] - level)
    found = names_at(grey.astype(np.uint8), 150, 150)
    assert found >= places
    assert "smeared" in places or found == places


def test_a_place_near_a_core_or_the_edge_is_there():
    assert "core" in names_at(stripes(), 150, 150, np.array([[150.0, 151.0 - CORE_PX]]))
    assert "core" not in names_at(stripes(), 150, 150, np.array([[150.0, 149.0 - CORE_PX]]))
    assert "border" in names_at(stripes(), 60, 150)
    assert "border" not in names_at(stripes(), 100, 150)


def test_places_do_not_depend_on_the_resolution():
    twice = np.repeat(np.repeat(stripes(), 2, axis=0), 2, axis=1)
    xy = np.random.default_rng(2).uniform(50, 250, (60, 2))
    small, large = places_of(stripes(), 500.0, xy), places_of(twice, 1000.0, 2 * xy)
    for name in PLACES:
        assert np.count_nonzero(small[name] != large[name]) <= 3, name


@pytest.mark.parametrize("value", [0, 128, 255])
def test_a_blank_image_has_places_too(value):
    found = places_of(np.full((60, 60), value, np.uint8), 500.0, np.array([[30.0, 30.0]]))
    assert found["all"].all()


def test_counts_are_of_the_place_where_each_minutia_lies():
    known = Minutiae(x=[10, 50, 90], y=[10, 50, 90], angle=[0.0, 1.0, 2.0])
    extracted = Minutiae(x=[12, 50, 88, 30], y=[10, 50, 90, 70], angle=[0.1, 4.0, 2.0, 0.0])

    def at(minutiae):
        left = np.asarray(minutiae.x) < 40
        return {name: left if name == "border" else np.ones(len(left), bool) for name in PLACES}

    visible = np.array([True, True, False])
    found = count_by_place(extracted, known, visible, (at(extracted), at(known)))
    assert found["all"] == PlaceCounts(known=2, found=1, extracted=3, right=1)
    assert found["border"] == PlaceCounts(known=1, found=1, extracted=2, right=1)
    assert (found["border"].recall, found["border"].precision) == (1.0, 0.5)
    doubled = found["border"] + found["border"]
    assert (doubled.known, doubled.right) == (2, 2)
    assert np.isnan([PlaceCounts().recall, PlaceCounts().precision]).all()


def test_a_place_of_one_source_alone_is_empty_for_the_other():
    one = {"known": 4, "found": 3, "extracted": 5, "right": 3}
    table = format_places({"truth": {"core": one, "all": one}, "other": {"all": one}})
    assert [line.split("|")[1].strip() for line in table.splitlines()[2:]] == ["core", "all"]
    assert table.splitlines()[2].count("75.0 %") == 1


def run(*words):
    return CliRunner().invoke(minutiae_places.main, [*map(str, words), "--workers", "1"])


def test_own_minutiae_are_all_found_and_a_missing_file_is_an_error(tmp_path):
    images, minutiae = tmp_path / "images", tmp_path / "minutiae"
    images.mkdir()
    for name in ("101_1", "101_2"):
        shutil.copy(ROOT / "sample_data" / f"{name}.tif", images)
    extract = ("extract", *images.iterdir(), "-o", minutiae, "--format", "minutiae-csv")
    assert CliRunner().invoke(fpmatch, [*map(str, extract)]).exit_code == 0
    figures = tmp_path / "places.json"
    completed = run("--against", images, minutiae, "itself", "--json", figures)
    assert completed.exit_code == 0, completed.stderr
    (row,) = json.loads(figures.read_text())["rows"].values()
    assert list(row) == list(PLACES)
    for counts in row.values():
        assert counts["known"] == counts["found"] == counts["extracted"] == counts["right"]
    (minutiae / "101_2.csv").unlink()
    refused = run("--against", images, minutiae, "itself")
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "101_2.csv" in refused.stderr
    assert refused.stderr.count("\n") == 1
