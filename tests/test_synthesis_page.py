"""The page on synthetic prints says what was measured, its pictures are there, its targets met."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fpmatch.synthesis.presets import PRESETS
from fpmatch.synthesis.sensor import SENSORS
from research.synthesis_page import format_synthesis_markdown, read_synthesis_results

DOCS = Path(__file__).resolve().parent.parent / "docs"
PAGE = (DOCS / "explanation" / "synthesis.md").read_text(encoding="utf-8")
RESULTS = read_synthesis_results(DOCS / "data" / "synthesis.json")
LARGEST_FIGURE = 1_500_000  # bytes


def test_the_tables_are_those_of_the_results() -> None:
    shown = PAGE.partition("<!-- measured:start -->")[2].partition("<!-- measured:end -->")[0]
    assert shown.strip() == format_synthesis_markdown(RESULTS).strip()


@pytest.mark.parametrize("target", re.findall(r"\]\(([^)#]+)\)", PAGE))
def test_pictures_are_there_and_small(target: str) -> None:
    assert 0 < (DOCS / "explanation" / target).stat().st_size < LARGEST_FIGURE


def test_every_preset_is_named_and_measured_and_every_sensor_has_prints() -> None:
    assert [row["name"] for row in RESULTS["presets"]] == [
        f"synthetic, {name}, seed 7" for name in PRESETS
    ]
    assert len(RESULTS["prints"]["sets"]) == len(SENSORS)
    for name in PRESETS:
        assert f"`{name}`" in PAGE


def test_extraction_and_alignment_reach_their_targets() -> None:
    of = {row["name"].split(", ")[1]: row for row in RESULTS["presets"]}
    assert of["clean"]["f1"] >= 0.92
    assert of["hard"]["f1"] >= 0.85
    assert of["normal"]["f1"] >= 0.80
    assert of["normal"]["match"] >= 0.98
    assert of["normal"]["in_place"] >= 0.9
