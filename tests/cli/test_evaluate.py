from __future__ import annotations

import csv
import importlib
import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from fpmatch.cli.group import fpmatch as main
from fpmatch.evaluation import comparison, cropping, extraction, run
from fpmatch.evaluation.protocol import PROTOCOLS
from fpmatch.matching.calibration import Calibration
from fpmatch.matching.matchers import DEFAULT_MATCHER

from .conftest import assert_refused

KEYS = ["sets", "mean", "pooled", "intervals", "dpi_assumed", "notes"]
EVALUATION_TESTS = Path(__file__).parents[1] / "evaluation"


@pytest.fixture
def fpmatch():
    return lambda *arguments: CliRunner().invoke(main, ["evaluate", *map(str, arguments)])


@pytest.fixture
def known_answers(monkeypatch):
    """Let the command run with a matcher and an extractor whose answers are known."""
    monkeypatch.syspath_prepend(str(EVALUATION_TESTS))
    fake_bench = importlib.import_module("fake_bench")
    monkeypatch.setattr(run, "get_matcher", lambda name: fake_bench.MATCHER)
    monkeypatch.setattr(extraction, "extractor_of", lambda *_: fake_bench.extractor)


@pytest.fixture
def database(tmp_path):
    folder = tmp_path / "prints"
    folder.mkdir()
    for finger in range(1, 6):
        for number in range(1, 5):
            (folder / f"{finger}_{number}.tif").write_text("print")
    (folder / "3_3.tif").write_text("broken")
    (folder / "dataset.toml").write_text('name = "Five fingers"\ndpi = 500\n')
    return folder


@pytest.mark.usefixtures("known_answers")
def test_table_on_stdout_and_failures_on_stderr(fpmatch, database):
    result = fpmatch(database, "--workers", 1)
    assert result.exit_code == 1
    rates, intervals = result.stdout.split("\n\n")
    head, row, mean, pooled = rates.splitlines()
    assert head.startswith("database ")
    assert row.split()[:4] == ["Five", "fingers", "30", "160"]
    assert (mean.split()[0], pooled.split()[0]) == ("mean", "pooled")
    assert intervals.startswith("95 % intervals ")
    assert len(intervals.splitlines()) == 4
    assert result.stderr.splitlines() == [
        f"fpmatch: note: no template: {database / '3_3.tif'}: broken"
    ]


@pytest.mark.usefixtures("known_answers")
def test_json_is_one_object_with_fractions(fpmatch, database):
    result = fpmatch(database, "--json", "--workers", 1)
    document = json.loads(result.stdout)
    assert list(document) == KEYS
    assert (document["dpi_assumed"], document["notes"]) == (0, [])
    low, high = document["intervals"]["pooled"]["eer"]
    assert low <= document["pooled"]["eer"] <= high
    assert document["sets"][0]["name"] == "Five fingers"
    assert document["sets"][0]["failures"] == 1
    assert 0 < document["pooled"]["eer"] < 1


@pytest.mark.usefixtures("known_answers")
def test_squares_are_compared_with_whole_prints(fpmatch, database, monkeypatch):
    sides = []

    def squares(side_px, enhance, reader):
        sides.append((side_px, enhance))
        return extraction.extractor_of()

    monkeypatch.setattr(cropping, "crop_extractor_of", squares)
    (database / "3_3.tif").write_text("print")
    result = fpmatch(database, "--crop", 160, "--workers", 1)
    assert result.exit_code == 0
    assert result.stdout.startswith("Probes: squares of 160 by 160 px at 500 dpi.\n\ndatabase ")
    whole = fpmatch(database, "--workers", 1)
    assert result.stdout.split("\n\n", 1)[1].split("\n")[2:] == whole.stdout.split("\n")[2:]
    document = json.loads(fpmatch(database, "--crop", 128, "--workers", 1, "--json").stdout)
    assert document["crop"] == {"side_px": 128, "failures": []}
    assert "crop" not in json.loads(fpmatch(database, "--workers", 1, "--json").stdout)
    assert [side for side, _ in sides] == [160, 128]


@pytest.mark.usefixtures("known_answers")
def test_several_impressions_are_enrolled_as_one_finger(fpmatch, database, monkeypatch, tmp_path):
    curve = Calibration(((0.0, 0.0), (1.0, 100.0)), tail_scale=1.0)
    monkeypatch.setattr(comparison, "load_calibration", lambda name: curve)
    others = tmp_path / "others"
    others.mkdir()
    for name in ("1_1.tif", "9_1.tif", "9_2.tif"):
        (others / name).write_text("print")
    words = (database, "--enrol", 3, "--impostors", others, "--workers", 1)
    document = json.loads(fpmatch(*words, "--json").stdout)
    assert (document["sets"][0]["genuine"], document["sets"][0]["impostor"]) == (5, 35)
    assert document["enrol"]["impressions"] == 3
    assert document["enrol"]["impostors"] == ["others"]
    assert [row["score"] for row in document["enrol"]["scores"]] == [20, 30, 40]
    text = fpmatch(*words, "--enrol-seed", 1).stdout
    assert text.startswith("Enrolled: 3 impressions of each finger, drawn at random. ")
    twice = fpmatch(database, "--enrol", 3, "--impostors", database, "--workers", 1)
    assert twice.exit_code == 2
    assert "database given twice" in twice.stderr


@pytest.mark.usefixtures("known_answers")
def test_squares_without_a_template_are_named(fpmatch, database, monkeypatch):
    bench = importlib.import_module("fake_bench")
    monkeypatch.setattr(cropping, "failed_crops", lambda sets: [database / "1_1.tif"])
    monkeypatch.setattr(cropping, "crop_extractor_of", lambda *_: bench.extractor)
    (database / "3_3.tif").write_text("print")
    result = fpmatch(database, "--crop", 64, "--workers", 1)
    assert result.exit_code == 1
    assert result.stderr.splitlines() == [
        f"fpmatch: note: no template of the square: {database / '1_1.tif'}"
    ]


@pytest.mark.usefixtures("known_answers")
def test_report_is_one_page(fpmatch, database, tmp_path):
    pytest.importorskip("matplotlib")
    folder = tmp_path / "made" / "report"
    result = fpmatch(database, "--report", folder, "--workers", 1, "--bootstrap", 50)
    assert result.exit_code == 1
    assert [path.name for path in folder.iterdir()] == ["index.html"]
    assert f"fpmatch: note: report: {folder / 'index.html'}" in result.stderr
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert "Five fingers" in page
    assert "3_3.tif: broken" in page


def test_a_report_without_matplotlib_is_refused_before_any_work(fpmatch, database, monkeypatch):
    style = importlib.import_module("fpmatch.drawing.plots.style")
    monkeypatch.setattr(style, "find_spec", lambda name: None)
    result = fpmatch(database, "--report", database / "report")
    assert_refused(result, "matplotlib")
    assert not (database / "report").exists()


@pytest.mark.usefixtures("known_answers")
def test_a_baseline_is_compared_pair_by_pair(fpmatch, database, tmp_path):
    path = tmp_path / "scores.csv"
    fpmatch(database, "--scores", path, "--workers", 1)
    result = fpmatch(database, "--baseline", path, "--workers", 1, "--bootstrap", 100)
    assert result.exit_code == 1
    _, _, paired = result.stdout.split("\n\n")
    assert paired.startswith(f"fake compared with {path}: 190 pairs in both, 190 with the same")
    assert "no change" in paired
    as_json = fpmatch(database, "--baseline", path, "--workers", 1, "--json")
    assert json.loads(as_json.stdout)["baseline"]["pooled"]["pairs"] == 190


@pytest.mark.usefixtures("known_answers")
def test_a_baseline_of_other_prints_is_refused(fpmatch, database, tmp_path):
    path = tmp_path / "scores.csv"
    path.write_text("set,probe,reference,genuine,similarity\nother,1_1,2_1,0,0.5\n")
    result = fpmatch(database, "--baseline", path, "--workers", 1)
    assert result.exit_code == 2
    assert result.stderr.splitlines()[-1] == (
        "fpmatch: error: the two runs have no database in common: other; Five fingers"
    )


@pytest.fixture
def two_matchers(monkeypatch, known_answers):
    """Let `--matcher` name two, the second blind to all but the first finger."""
    bench = importlib.import_module("fake_bench")

    class Blind(bench.Fake):
        name = "blind"

        def prepare(self, template):
            return min(super().prepare(template), 150.0)

    named = {"fake": bench.MATCHER, "blind": Blind()}
    monkeypatch.setattr(run, "get_matcher", named.__getitem__)
    monkeypatch.setattr(
        importlib.import_module("fpmatch.cli.evaluate"), "matcher_names", lambda: list(named)
    )


@pytest.mark.usefixtures("two_matchers")
def test_matchers_stand_side_by_side(fpmatch, database, tmp_path):
    path = tmp_path / "scores.csv"
    result = fpmatch(database, "--matcher", "all", "--workers", 1, "--scores", path)
    assert result.exit_code == 1
    fake, _, blind, _, both, against = result.stdout.split("\n\n")
    assert fake.startswith("matcher fake\ndatabase ")
    assert blind.startswith("matcher blind\ndatabase ")
    assert [line.split()[0] for line in both.splitlines()] == ["side", "fake", "blind"]
    assert against.startswith("blind compared with fake: 190 pairs in both")
    assert "worse" in against
    with path.open(newline="") as stream:
        assert [row["matcher"] for row in csv.DictReader(stream)] == ["fake"] * 190 + [
            "blind"
        ] * 190
    words = ["--matcher", "fake", "--matcher", "blind", "--matcher", "fake", "--json"]
    document = json.loads(fpmatch(database, *words, "--workers", 1).stdout)
    assert [one["matcher"] for one in document["matchers"]] == ["fake", "blind"]
    assert document["against_first"][0]["pooled"]["eer"]["verdict"] == "worse"


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["{root}/nowhere"], "nowhere: no such folder"),
        (["{root}/notes.txt"], "notes.txt: not a folder of prints"),
        (["{root}"], "holds no prints named FFF_M.tif"),
        (["{db}", "{db}"], "prints: database given twice"),
        (["{db}", "--matcher", "nobody"], "unknown matcher 'nobody'"),
        (["{db}", "--scores", "{root}/nowhere/s.csv"], "s.csv: cannot be written"),
        (["{db}", "--scores", "{root}"], "is a folder"),
        (["{db}", "--report", "{root}/notes.txt"], "notes.txt: no folder can be made"),
        (["{db}", "--baseline", "{root}/nowhere.csv"], "nowhere.csv: cannot be read: no such file"),
        (["{db}", "--baseline", "{root}/notes.txt"], "notes.txt: not a file of scores"),
    ],
)
def test_bad_input_is_one_line_and_status_2(fpmatch, database, tmp_path, arguments, reason):
    if "--report" in arguments:
        pytest.importorskip("matplotlib")
    (tmp_path / "notes.txt").write_text("")
    assert_refused(fpmatch(*(a.format(root=tmp_path, db=database) for a in arguments)), reason)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["x", "--workers", "0"],
        ["x", "--protocol", "all"],
        ["x", "--crop", "31"],
        ["x", "--crop", "160", "--ground-truth"],
        ["x", "--crop", "160", "--report", "y"],
        ["x", "--enrol", "0"],
        ["x", "--enrol", "2", "--crop", "160"],
        ["x", "--enrol", "2", "--scores", "y"],
        ["x", "--impostors", "y"],
        ["x", "--enrol-seed", "1"],
    ],
)
def test_wrong_usage(fpmatch, arguments):
    result = fpmatch(*arguments)
    assert result.exit_code == 2
    assert "Usage:" in result.stderr


def test_help_names_what_there_is(fpmatch):
    text = fpmatch("--help").stdout
    assert f"[{'|'.join(PROTOCOLS)}]" in text
    assert f"[default:{DEFAULT_MATCHER}]" in "".join(text.split())
    assert "  fpmatch evaluate fvc2002/DB1_B\n" in text


@pytest.mark.usefixtures("known_answers")
@pytest.mark.parametrize("workers", [1, 2])
def test_what_was_noticed_on_reading_is_said_once(fpmatch, database, monkeypatch, workers):
    fake_bench = importlib.import_module("fake_bench")
    monkeypatch.setattr(extraction, "extractor_of", lambda *_: fake_bench.noting_extractor)
    (database / "dataset.toml").unlink()
    notes = fpmatch(database, "--workers", workers).stderr.splitlines()
    assert notes == [
        f"fpmatch: note: {database}/1_1.tif and 18 others: 500 dpi assumed; the resolution is "
        "unknown (dpi in dataset.toml sets it)",
        f"fpmatch: note: {database}/2_1.tif and 3 others: its ridges are green",
        f"fpmatch: note: no template: {database}/3_3.tif: broken",
    ]
    document = json.loads(fpmatch(database, "--workers", workers, "--json").stdout)
    assert document["dpi_assumed"] == 19
    ((note, prints),) = [(one["note"], one["prints"]) for one in document["notes"]]
    assert note == "its ridges are green"
    assert prints == [str(database / f"2_{number}.tif") for number in range(1, 5)]


@pytest.fixture
def truth(database):
    """Write a truth beside the prints that tells of one minutia in each."""
    folder = database / "truth"
    folder.mkdir()
    for finger in range(1, 6):
        impressions = {
            path.stem: {
                "transform": {"scale": 1, "rotation": 0, "tx": 0, "ty": 0},
                "minutiae": {"x": [50], "y": [0], "angle_deg": [0], "kind": [1], "master": [0]},
            }
            for path in database.glob(f"{finger}_*.tif")
        }
        document = {"minutiae": {"x": [100 * finger], "y": [0]}, "impressions": impressions}
        (folder / f"{finger}.json").write_text(json.dumps(document))
    return folder / "3.json"


@pytest.mark.usefixtures("known_answers", "truth")
def test_minutiae_adds_tables_and_json(fpmatch, database):
    rates, minutiae, false, transforms = fpmatch(
        database, "--ground-truth", "--workers", 1, "--bootstrap", 0
    ).stdout.split("\n\n")
    assert rates.startswith("database ")
    assert minutiae.startswith("minutiae ")
    assert len(minutiae.splitlines()) == 4
    assert false.startswith("false positives within 12 px, 22.5° ")
    assert transforms.startswith("transforms ")
    document = json.loads(fpmatch(database, "--ground-truth", "--json", "--workers", 1).stdout)
    assert list(document) == [*KEYS, "ground_truth"]
    assert document["ground_truth"]["pooled"]["extracted"] == 19
    assert document["ground_truth"]["pooled"]["true"] == 20


@pytest.mark.usefixtures("known_answers", "truth")
def test_the_option_names_of_0_1_0_still_work(fpmatch, database):
    old = fpmatch(database, "--minutiae", "--resamples", 9, "--json", "--workers", 1)
    document = json.loads(old.stdout)
    assert document["intervals"]["bootstrap"] == 9
    assert "ground_truth" in document


def test_minutiae_need_a_truth_and_say_so_before_any_work(fpmatch, database):
    path = database / "truth" / "1.json"
    assert_refused(fpmatch(database, "--ground-truth"), f"{path}: no such file")


@pytest.mark.usefixtures("known_answers")
def test_a_malformed_truth_is_one_line_and_status_2(fpmatch, database, truth):
    truth.write_text("{")
    assert_refused(fpmatch(database, "--ground-truth"), f"{truth}: not a readable JSON file")
