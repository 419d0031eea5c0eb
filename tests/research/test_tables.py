"""`research.tables`: the pages show the kept results, and results become tables."""

import json
import re

import pytest

from fpmatch.errors import FpmatchError
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.matching.pipeline.score_model import FEATURES
from research.experiments.image_statistics import TITLES
from research.markdown import marked_block, replace_marked_block
from research.tables import pages
from research.tables.accuracy import error_rates_kept, format_ablation
from research.tables.identification import format_identification
from research.tables.pages import PAGES, Page, Part, keep_results, load_results, outdated_blocks
from research.tables.performance import format_ratios, format_stages
from research.tables.synthesis import format_synthesis, preset_rows


@pytest.mark.docs
def test_the_pages_show_the_kept_results(run_research):
    checked = run_research("tables", "--check")
    assert (checked.exit_code, checked.output) == (0, "")


@pytest.mark.docs
@pytest.mark.parametrize("name", PAGES)
def test_every_row_of_a_table_has_as_many_cells_as_its_head(name):
    results = load_results(PAGES[name])
    for format_block in PAGES[name].blocks.values():
        for block in format_block(results).split("\n\n"):
            if block.startswith("|"):
                assert len({line.count("|") for line in block.splitlines()}) == 1


@pytest.mark.docs
def test_the_kept_results_are_of_the_present_features_presets_and_sensors():
    ablation = load_results(PAGES["accuracy"])["ablation"]
    assert list(ablation) == ["all", *(f"without {name}" for name in FEATURES)]
    synthesis = load_results(PAGES["synthesis"])
    assert [row["name"].split(", ")[1] for row in synthesis["presets"]] == list(PRESETS)
    names = " ".join(one["name"] for one in synthesis["prints"]["sets"])
    assert all(sensor in names for sensor in SENSORS if not sensor.startswith("rolled"))


@pytest.fixture
def docs(tmp_path, monkeypatch):
    """Return a folder of documentation with one page."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "kept.json").write_text('{"one": 1, "two": 2}')
    page = tmp_path / "page.md"
    page.write_text("<!-- sum:start -->\n\n3\n\n<!-- sum:end -->\n")
    parts = {name: Part(name, "kept.json", keep=abs) for name in ("one", "two")}
    one = Page(parts, {(page, "sum"): lambda results: str(results["one"] + results["two"])})
    monkeypatch.setattr(pages, "DOCS", tmp_path)
    monkeypatch.setattr(pages, "ROOT", tmp_path)
    monkeypatch.setattr(pages, "PAGES", {"page": one})
    return tmp_path


def test_a_given_part_replaces_the_kept_one(docs):
    page = pages.PAGES["page"]
    assert outdated_blocks() == []
    (docs / "new.json").write_text("-7")
    keep_results(page, {"one": docs / "new.json"})
    assert json.loads((docs / "data" / "kept.json").read_text()) == {"one": 7, "two": 2}
    assert outdated_blocks() == ["page.md: the block 'sum'"]
    pages.write_blocks(page)
    assert outdated_blocks() == []
    assert marked_block((docs / "page.md").read_text(), "sum") == "9"


@pytest.mark.parametrize("content", ["{", '{"one": 1}', None])
def test_broken_results_are_refused(docs, content):
    path = docs / "data" / "kept.json"
    path.unlink()
    if content is not None:
        path.write_text(content)
    with pytest.raises(FpmatchError, match=re.escape(str(path))):
        outdated_blocks()


def test_a_page_without_its_marks_is_refused():
    with pytest.raises(FpmatchError, match="no marks a:start"):
        replace_marked_block("<!-- a:start -->", "a", "new")


def test_only_the_rates_that_the_page_shows_are_kept():
    row = {"name": "one", "eer": 0.01, "fmr1000": 0.02, "zero_fnmr": 0.9}
    kept = error_rates_kept({"sets": [row], "mean": row, "pooled": row, "intervals": {}})
    assert kept["sets"] == [{"name": "one", "eer": 0.01, "fmr1000": 0.02}]
    assert set(kept) == {"sets", "mean", "pooled"}


def test_an_ablation_shows_rates_changes_and_identical_scores():
    rates = {"eer": 0.0123, "fmr1000": 0.03}
    change = {"eer": [-0.001, 0.004], "fmr1000": None}
    row = {"mean": rates, "pooled": rates, "change": change, "identical": 0.25}
    table = format_ablation([{"name": "base", "with ridges": row, "minutiae alone": row}])
    assert table.count("| base | 1.23 / 3.00 | 1.23 / 3.00 | -0.10 to +0.40 | – | 25.0 % |") == 2
    assert table.index("with ridges") < table.index("minutiae alone")


def test_a_ratio_that_misses_its_target_is_marked():
    row = {"name": "one", "value": 0.512, "unit": "times the time", "target": "<= 0.5"}
    row |= {"ok": False, "ours": "30.7 µs", "yardstick": "another: 60 µs"}
    line = format_ratios({"figures": [row]}).splitlines()[-1]
    assert line == "| one | 0.512 times the time | ≤ 0.5 | **no** | 30.7 µs | another: 60 µs |"


def test_a_stage_of_one_version_alone_is_shown():
    before = {"extraction": {"old": 20.0, "both": 1.0}, "matching": {}, "process": {}}
    now = {"extraction": {"both": 0.5, "new": 2.0}, "matching": {}, "process": {}}
    table = format_stages({"before": before, "now": now})
    for row in ("| old | 20 ms | - |", "| both | 1.00 ms | 0.50 ms |", "| new | - | 2.00 ms |"):
        assert row in table
    assert "| together | 21 ms | 2.50 ms |" in table


def test_presets_are_shown_at_the_main_tolerance():
    agreement = [
        {"distance_px": px, "precision": precision, "recall": recall, "f1": f1}
        for px, precision, recall, f1 in ((16.0, 1.0, 1.0, 1.0), (12.0, 0.9, 0.8, 0.847))
    ]
    transforms = {"genuine": 12, "judged": 10, "match": 0.99, "in_place": 0.975}
    measured = {"name": "easy", "prints": 8, "agreement": agreement, "transforms": transforms}
    evaluation = {"sets": [{"name": "easy", "eer": 0.0125}], "ground_truth": {"sets": [measured]}}
    quantiles = {name: [1.0, 2.0, 3.0, 4.0, 5.0] for name in TITLES}
    outside = dict.fromkeys(TITLES, 0.25)
    one = {"name": "ours", "prints": 8, "quantiles": quantiles, "outside": outside}
    prints = {"sets": [one], "against": [{**one, "name": "theirs"}]}
    page = format_synthesis({"prints": prints, "presets": preset_rows(evaluation)})
    assert "| ours | 8 | 3.00 (1.00–5.00) |" in page
    assert "| 25 % | 25 % |" in page
    assert "| easy | 8 | 0.900 | 0.800 | 0.847 | 10 | 99.0 % | 97.5 % | 1.25 % |" in page
    assert "Two-sample test" not in page
    one["two_sample"] = {"each": {"theirs": 0.61}, "all": 0.58, "most_different": ["pores"]}
    page = format_synthesis({"prints": prints, "presets": preset_rows(evaluation)})
    assert "| ours | 61 % | 58 % | pores |" in page


def test_identification_without_a_miss_shows_its_limit_and_names_the_method():
    point = {"fpir": 0.01, "fnir": 0.0, "interval": [0.0, 0.2589], "by_chance": 0.02}
    point |= {"bound": {"unit": "subject", "units": 10, "method": "clopper-pearson"}}
    point |= {"false_positives": 0, "stated_fnir": 0.0}
    row = {"name": "one", "mated": 80, "rank": {"1": 0.0}}
    row |= {"fnir_at_fpir": [point]}
    test = {"fingers": 1, "enrolled": [4, 4], "background": 0, "sets": [row], "pooled": row}
    text = format_identification({"alone": [test], "rolled_million": [test | {"background": 9}]})
    assert "| 1 finger, 4 subjects | 0.00 % | 0.00 % | at most 25.89 % (0 of 10) |" in text
    assert "| rolled, 1 finger, 4 subjects | 0.00 % |" in text
    assert "| one | 0.00 % |" in text
    assert "by Clopper-Pearson, one-sided; n counts subjects" in text
