"""`research.experiments.direction_agreement`: counts of directions that agree or are flipped."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import DatasetError
from fpmatch.evaluation.dataset import Dataset, Impression
from fpmatch.evaluation.extraction import ExtractedSet, Extraction
from fpmatch.minutiae import Minutiae, Template
from research.experiments.direction_agreement import (
    Agreement,
    AgreementParameters,
    compare_directions,
    measure_agreement,
    read_minutiae,
)

ROOT = Path(__file__).resolve().parents[2]
ONE = Minutiae(x=[50], y=[50], angle=[1.0])


def turned(minutiae: Minutiae, degrees: float) -> Minutiae:
    return Minutiae(minutiae.x, minutiae.y, minutiae.angle + np.radians(degrees))


@pytest.mark.parametrize(
    ("degrees", "agreeing", "flipped"),
    [(0, 1, 0), (29, 1, 0), (-29, 1, 0), (31, 0, 0), (149, 0, 0), (151, 0, 1), (-170, 0, 1)],
)
def test_one_pair_by_its_turn(degrees: float, agreeing: int, flipped: int) -> None:
    assert compare_directions(ONE, turned(ONE, degrees)) == Agreement(1, agreeing, flipped)


@pytest.mark.parametrize(("ours", "theirs"), [(0.05, 6.25), (6.25, 0.05)])
def test_directions_on_either_side_of_zero_agree(ours: float, theirs: float) -> None:
    a, b = Minutiae(x=[5], y=[5], angle=[ours]), Minutiae(x=[5], y=[5], angle=[theirs])
    assert compare_directions(a, b) == Agreement(1, 1, 0)


@pytest.mark.parametrize(("distance", "pairs"), [(0, 1), (8, 1), (8.5, 0)])
def test_only_what_lies_near_is_compared(distance: float, pairs: int) -> None:
    moved = Minutiae(ONE.x + np.float32(distance), ONE.y, ONE.angle)
    assert compare_directions(ONE, moved).pairs == pairs


def test_limits_can_be_set() -> None:
    strict = AgreementParameters(max_distance_px=1.0, max_turn_deg=5.0, min_flip_deg=100.0)
    assert compare_directions(ONE, turned(ONE, 10), strict) == Agreement(1, 0, 0)
    assert compare_directions(ONE, turned(ONE, 110), strict) == Agreement(1, 0, 1)
    assert compare_directions(ONE, Minutiae(ONE.x + 2, ONE.y, ONE.angle), strict) == Agreement()


def test_a_minutia_is_compared_once_and_with_the_nearest() -> None:
    theirs = Minutiae(x=[53, 51], y=[50, 50], angle=[1.0, 1.0 + np.pi])
    assert compare_directions(ONE, theirs) == Agreement(1, 0, 1)


def test_nothing_to_compare_is_no_share() -> None:
    nothing = compare_directions(Minutiae.empty(), ONE)
    assert nothing == compare_directions(ONE, Minutiae.empty()) == Agreement()
    assert math.isnan(nothing.agreeing_share)
    assert math.isnan(nothing.flipped_share)


def test_counts_add_up() -> None:
    total = Agreement(4, 3, 1) + Agreement(6, 3, 0)
    assert total == Agreement(10, 6, 1)
    assert (total.agreeing_share, total.flipped_share) == (0.6, 0.1)


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_a_wrong_convention_is_noticed(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    x, y, angle = rng.uniform(0, 400, count), rng.uniform(0, 400, count), rng.uniform(0, 7, count)
    ours = Minutiae(x, y, angle)
    assert compare_directions(ours, ours) == Agreement(count, count, 0)
    assert compare_directions(ours, turned(ours, 180)) == Agreement(count, 0, count)
    assert compare_directions(ours, turned(ours, 90)) == Agreement(count, 0, 0)


def test_reading_turns_degrees_into_radians(tmp_path: Path) -> None:
    path = tmp_path / "101_1.csv"
    path.write_text("x,y,theta,type,quality\n148.00,196.00,90,E,0\n10,20,271.5,B,99\n")
    found = read_minutiae(path)
    assert found.xy.tolist() == [[148, 196], [10, 20]]
    assert np.degrees(found.angle) == pytest.approx([90, 271.5], abs=1e-4)


def test_columns_are_found_by_name_and_a_table_may_be_empty(tmp_path: Path) -> None:
    path = tmp_path / "101_1.csv"
    path.write_text("theta,y,x\n0,2,1\n")
    assert read_minutiae(path).xy.tolist() == [[1, 2]]
    path.write_text("x,y,theta\n")
    assert len(read_minutiae(path)) == 0


@pytest.mark.parametrize(
    "text",
    ["x,y,theta\n1,2\n", "x,y,theta\n1,2,east\n", "x,y,theta\nnan,2,3\n", "x,y\n1,2\n"],
    ids=["short row", "no number", "nan", "no column"],
)
def test_a_malformed_table_is_refused_by_name(tmp_path: Path, text: str) -> None:
    path = tmp_path / "101_1.csv"
    path.write_text(text)
    with pytest.raises(DatasetError, match=r"101_1\.csv: ") as caught:
        read_minutiae(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", ["missing", "folder", "binary"])
def test_a_file_that_is_no_table_is_refused_by_name(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "101_1.csv"
    if kind == "folder":
        path.mkdir()
    elif kind == "binary":
        path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(DatasetError, match=r"101_1\.csv: "):
        read_minutiae(path)


def extracted(*templates: Template | None) -> ExtractedSet:
    """Return a database of one finger with the given templates."""
    impressions = tuple(
        Impression(101, k, Path(f"101_{k}.tif")) for k in range(1, len(templates) + 1)
    )
    extractions = tuple(Extraction(t, "" if t else "no minutiae found", 1.0) for t in templates)
    return ExtractedSet(Dataset("set", 500, "", impressions), extractions)


def test_a_database_is_measured_as_a_whole(tmp_path: Path) -> None:
    for k, degrees in enumerate((57.3, 237.3, 0), start=1):
        (tmp_path / f"101_{k}.csv").write_text(f"x,y,theta\n52,50,{degrees}\n")
    template = Template(ONE, 100, 100)
    assert measure_agreement(extracted(template, template, None), tmp_path) == Agreement(2, 1, 1)


def test_a_print_without_their_minutiae_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"101_1\.csv: cannot be read"):
        measure_agreement(extracted(Template(ONE, 100, 100)), tmp_path)


def test_the_command_prints_a_line_for_each_database_and_extractor(
    tmp_path: Path, run_research
) -> None:
    prints, theirs = tmp_path / "year", tmp_path / "minutiae" / "theirs" / "year" / "DB1"
    (prints / "DB1").mkdir(parents=True)
    theirs.mkdir(parents=True)
    (prints / "DB1" / "101_1.tif").write_bytes((ROOT / "sample_data" / "101_1.tif").read_bytes())
    (theirs / "101_1.csv").write_text("x,y,theta\n")
    done = run_research("check", "conventions", prints, tmp_path / "minutiae", "--workers", 1)
    assert done.stderr == ""
    assert done.stdout.splitlines()[1].split() == [
        *("DB1", "theirs", "0", "nan%", "nan%"),
        *("outside", "the", "limits"),
    ]
    assert done.exit_code == 1


def test_folders_without_minutiae_are_refused(tmp_path: Path, run_research) -> None:
    done = run_research("check", "conventions", tmp_path, tmp_path)
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr.startswith("research check conventions: error: ")
    assert len(done.stderr.splitlines()) == 1
