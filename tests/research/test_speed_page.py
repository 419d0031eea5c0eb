"""`research.speed_page`: results become tables, and the pages show the shipped."""

from __future__ import annotations

import json
from pathlib import Path

from research.headline import format_headline
from research.speed_page import PARTS, format_figures_markdown, format_stages_markdown

ROOT = Path(__file__).resolve().parents[2]
RESULTS = json.loads((ROOT / "docs" / "data" / "performance.json").read_text(encoding="utf-8"))
KEYS = {"name", "value", "unit", "yardstick", "target", "ok", "ours"}


def test_the_page_shows_the_figures_that_were_measured():
    assert set(RESULTS) == set(PARTS)
    page = (ROOT / "docs" / "explanation" / "performance.md").read_text(encoding="utf-8")
    assert format_figures_markdown(RESULTS["figures"]) in page


def test_the_readme_shows_the_headline_figures():
    accuracy = json.loads((ROOT / "docs" / "data" / "accuracy.json").read_text(encoding="utf-8"))
    headline = format_headline(accuracy, RESULTS)
    assert len(headline.splitlines()) == 2 + 3
    assert headline in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_page_shows_where_the_time_goes():
    tables = format_stages_markdown(RESULTS["before"], RESULTS["now"])
    assert tables in (ROOT / "docs" / "explanation" / "performance.md").read_text(encoding="utf-8")


def test_every_figure_says_whether_it_meets_its_target():
    for figure in RESULTS["figures"]:
        assert set(figure) == KEYS
        relation, target = figure["target"].split()
        met = {">=": figure["value"] >= float(target), "<=": figure["value"] <= float(target)}
        assert figure["ok"] is met[relation]


def test_a_figure_that_misses_is_seen_to():
    figure = {
        "name": "one",
        "value": 0.512,
        "unit": "times the time",
        "yardstick": "another: 60 µs",
        "target": "<= 0.5",
        "ok": False,
        "ours": "30.7 µs",
    }
    row = format_figures_markdown([figure]).splitlines()[-1]
    assert row == "| one | 0.512 times the time | ≤ 0.5 | **no** | 30.7 µs | another: 60 µs |"


def test_a_stage_of_one_version_alone_is_shown():
    before = {"extraction": {"old": 20.0, "both": 1.0}, "matching": {}, "process": {}}
    now = {"extraction": {"both": 0.5, "new": 2.0}, "matching": {}, "process": {}}
    table = format_stages_markdown(before, now)
    for row in ("| old | 20 ms | - |", "| both | 1.00 ms | 0.50 ms |", "| new | - | 2.00 ms |"):
        assert row in table
    assert "| together | 21 ms | 2.50 ms |" in table
