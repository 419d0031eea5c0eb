"""The page on point sets says what was measured, and its pictures are there."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from fpmatch.evaluation.points.results import read_results
from fpmatch.evaluation.points.table import format_bench_markdown
from research.point_sets_page import PARTS, format_paper_tables
from research.point_targets import missed_targets

DOCS = Path(__file__).resolve().parent.parent / "docs"
PAGE = (DOCS / "explanation" / "point_sets.md").read_text(encoding="utf-8")
RESULTS = DOCS / "data" / "pointsets_bench.json"
CHOICES = DOCS / "data" / "paper_choices.json"
WORDS_OF_THE_PAPER = {
    "much faster",
    "pre-defined threshold value",
    "higher than the matching factor ρ",
}
TITLES = {
    "Point pattern matching algorithm using unit-circle parametrization",
    "A fast expected time algorithm for the 2-D point pattern matching problem",
}


def test_the_tables_are_those_of_the_results() -> None:
    shown = PAGE.partition("<!-- measured:start -->")[2].partition("<!-- measured:end -->")[0]
    assert shown.strip() == format_bench_markdown(read_results(RESULTS)).strip()


@pytest.mark.parametrize("part", PARTS)
def test_what_the_paper_leaves_open_is_as_measured(part: str) -> None:
    shown = PAGE.partition(f"<!-- {part}:start -->")[2].partition(f"<!-- {part}:end -->")[0]
    tables = format_paper_tables(json.loads(CHOICES.read_text(encoding="utf-8")))
    assert shown.strip() == tables[part].strip()


def test_the_page_quotes_nothing_but_words_of_the_paper() -> None:
    prose = " ".join(re.sub(r"```.*?```", "", PAGE, flags=re.DOTALL).split())
    quoted = set(re.findall(r'"([^"]+)"', prose))
    assert quoted == WORDS_OF_THE_PAPER | TITLES
    assert not set("“”„«»") & set(prose)


def test_the_results_miss_no_target() -> None:
    assert missed_targets(read_results(RESULTS)) == []


@pytest.mark.parametrize("target", re.findall(r"\]\(([^)#]+)\)", PAGE))
def test_pictures_are_there(target: str) -> None:
    assert (DOCS / "explanation" / target).exists()
