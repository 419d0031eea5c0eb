import json

import pytest
from PIL import Image

from fpmatch.image.io.grey import RawSize
from fpmatch.lab.evaluation import run as work
from fpmatch.lab.evaluation.databases import extraction
from tests.conftest import copied

KEYS = ["matcher", "sets", "mean", "pooled", "intervals", "dpi_assumed", "notes"]


@pytest.fixture
def evaluate(run):
    """Return a function that runs the command, on one process."""
    return lambda *words: run("evaluate", "--workers", 1, *words)


@pytest.fixture
def known_answers(monkeypatch, bench):
    """Let the command run with a matcher and an extractor whose answers are known."""
    monkeypatch.setattr(work, "get_matcher", lambda name: bench.MATCHER)
    monkeypatch.setattr(
        extraction, "extract_print", lambda file, **_: bench.extractor(file.path, file.dpi)
    )


@pytest.fixture
def database(make_database):
    """Return a database of five fingers, four prints of each, one of which cannot be extracted."""
    toml = 'name = "Five fingers"\ndpi = 500\n'
    return make_database("prints", contents={"3_3": "broken"}, toml=toml)


@pytest.mark.usefixtures("known_answers")
def test_rates_in_a_table_and_as_json_and_failures_on_stderr(evaluate, database):
    result = evaluate(database)
    assert result.exit_code == 1
    rates, intervals = result.stdout.split("\n\n")
    assert rates.splitlines()[1].split()[:4] == ["Five", "fingers", "30", "160"]
    assert len(intervals.splitlines()) == 2
    assert result.stderr == "fpmatch: note: no template: 3_3.tif: broken\n"
    document = json.loads(evaluate(database, "--json").stdout)
    assert list(document) == KEYS
    assert (document["dpi_assumed"], document["notes"]) == (0, [])
    low, high = document["intervals"]["pooled"]["eer"]
    assert low <= document["pooled"]["eer"] <= high
    assert 0 < document["pooled"]["eer"] < 1
    row = document["sets"][0]
    assert (row["name"], row["failures"]) == ("Five fingers", 1)


@pytest.mark.usefixtures("known_answers")
def test_a_baseline_is_compared_pair_by_pair(evaluate, database, tmp_path):
    path = tmp_path / "scores.csv"
    evaluate(database, "--scores", path)
    words = (database, "--baseline", path)
    result = evaluate(*words, "--bootstrap", 100)
    assert result.exit_code == 1
    assert result.stdout.split("\n\n")[2].startswith(f"fake compared with {path}: 190 pairs")
    document = json.loads(evaluate(*words, "--json").stdout)
    assert document["baseline"]["pooled"]["pairs"] == 190
    path.write_text("set,probe,reference,genuine,similarity\nother,1_1,2_1,0,0.5\n")
    other = evaluate(*words)
    assert (other.exit_code, "other; Five fingers\n" in other.stderr) == (2, True)


def test_the_options_of_reading_come_before_dataset_toml(
    evaluate, make_database, bench, monkeypatch
):
    asked = set()

    def extract(file, reader, **_):
        asked.add((file.dpi, reader.folders[file.path.parent].polarity, reader.reader.raw_sizes))
        return bench.extractor(file.path, file.dpi)

    monkeypatch.setattr(extraction, "extract_print", extract)
    place = make_database("prints", toml='dpi = 569\npolarity = "dark"\n')
    for given in ((), ("--dpi", 1000, "--polarity", "white", "--raw", "9x8")):
        evaluate(place, "--bootstrap", 0, *given)
    assert asked == {(569.0, "dark", ()), (1000.0, "white", (RawSize(9, 8),))}


@pytest.mark.usefixtures("known_answers")
def test_written_scores_give_the_same_rates_without_images(evaluate, run, database, tmp_path):
    scores = tmp_path / "Five fingers.csv"  # named as the database
    options = ("--fmr", 0.05, "--bootstrap", 100, "--json")
    first = json.loads(evaluate(database, "--scores", scores, *options).stdout)
    result = json.loads(run("rates", scores, *options).stdout)
    for document in (first, result):
        for row in document["sets"]:
            row.pop("identical", None)  # not known of scores in a file
    for key in ("sets", "mean", "pooled", "intervals", "fnmr_at_fmr"):
        assert result[key] == first[key]
    (note,) = result["notes"]
    assert (note["matcher"], note["note"].partition(" of")[0]) == ("fake", "19")


def test_pairs_of_identical_prints_are_counted_and_named(run, prints, tmp_path):
    folder = copied(prints, tmp_path / "db", "1_1.png", "2_1.png")
    picture = Image.open(prints / "1_1.png")
    for name in ("1_2.bmp", "3_1.bmp"):
        picture.save(folder / name, dpi=(500, 500))
    page = tmp_path / "report"
    words = ("evaluate", folder, "--bootstrap", 0, "--workers", 1)
    note = run(*words).stdout.splitlines()[-1]
    assert note.startswith("3 pairs of identical prints, which distort rates: 1_1.png with 1_2.bmp")
    (row,) = json.loads(run(*words, "--json", "--report", page).stdout)["sets"]
    pairs = [["1_1.png", "1_2.bmp"], ["1_1.png", "3_1.bmp"], ["1_2.bmp", "3_1.bmp"]]
    assert row["identical"] == {"count": 3, "pairs": pairs}
    assert "3 pairs of identical" in (page / "index.html").read_text(encoding="utf-8")
