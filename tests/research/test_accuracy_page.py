"""`research.accuracy_page`: results become tables, and the page shows the shipped."""

from __future__ import annotations

import json
from pathlib import Path

from fpmatch.matching.score import FEATURES
from research.accuracy_page import (
    PARTS,
    error_rates_kept,
    format_accuracy_markdown,
    format_databases_markdown,
)

DOCS = Path(__file__).resolve().parents[2] / "docs"
RESULTS = json.loads((DOCS / "data" / "accuracy.json").read_text(encoding="utf-8"))
BEFORE = json.loads((DOCS / "data" / "distortion_before.json").read_text(encoding="utf-8"))


def test_the_page_shows_what_was_measured():
    assert set(RESULTS) == set(PARTS)
    page = (DOCS / "explanation" / "accuracy.md").read_text(encoding="utf-8")
    assert format_accuracy_markdown(RESULTS, BEFORE) in page
    assert format_databases_markdown(RESULTS) in page


def test_the_ablation_is_of_todays_features():
    assert list(RESULTS["ablation"]) == ["all", *(f"without {name}" for name in FEATURES)]


def test_errors_are_as_few_as_was_aimed_at():
    learned = RESULTS["learned"]
    assert learned["mean"]["eer"] <= 0.014
    assert learned["mean"]["fmr1000"] <= 0.034
    assert learned["pooled"]["eer"] <= 0.017
    assert learned["pooled"]["fmr1000"] <= 0.051
    assert max(row["eer"] for row in learned["sets"]) <= 0.04


def test_only_what_the_page_shows_is_kept():
    row = {"name": "one", "eer": 0.01, "fmr1000": 0.02, "zero_fnmr": 0.9}
    kept = error_rates_kept({"sets": [row], "mean": row, "pooled": row, "intervals": {}})
    assert kept["sets"] == [{"name": "one", "eer": 0.01, "fmr1000": 0.02}]
    assert set(kept) == {"sets", "mean", "pooled"}


def test_the_calibration_keeps_its_word_on_a_million_comparisons():
    many = RESULTS["calibration"]["sets"][-1]
    assert many["impostors"] >= 1_000_000
    for at in many["scores"]:
        assert 0.5 <= at["factor"] <= 2.0


def test_distortion_is_shown_before_and_now():
    tables = format_accuracy_markdown(RESULTS, BEFORE)
    section = tables.partition("### Distortion")[2]
    for before, now in zip(BEFORE["conditions"], RESULTS["distortion"]["conditions"], strict=True):
        for old, new in zip(before["classes"], now["classes"], strict=True):
            assert f"| {old['pairs']} | " in section
            for kind in ("ridges", "minutiae"):
                assert f"| {old[kind]['score']:.1f} | {new[kind]['score']:.1f} |" in section


def test_distortion_alone_refuses_no_genuine_pair_of_whole_prints():
    whole = RESULTS["distortion"]["conditions"][0]
    assert whole["classes"][-1]["from"] >= 0.4
    for row in whole["classes"]:
        assert row["ridges"]["below_threshold"] == 0.0
        assert row["minutiae"]["fnmr"] <= 0.01
