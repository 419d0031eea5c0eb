"""The page on point sets says what was measured, and its pictures are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fpmatch.evaluation.points.results import read_results
from fpmatch.evaluation.points.table import format_bench_markdown
from fpmatch.evaluation.points.targets import missed_targets

DOCS = Path(__file__).resolve().parent.parent / "docs"
PAGE = (DOCS / "pointsets.md").read_text(encoding="utf-8")
RESULTS = DOCS / "pointsets_bench.json"


def test_the_tables_are_those_of_the_results() -> None:
    shown = PAGE.partition("<!-- measured:start -->")[2].partition("<!-- measured:end -->")[0]
    assert shown.strip() == format_bench_markdown(read_results(RESULTS)).strip()


def test_the_results_miss_no_target() -> None:
    assert missed_targets(read_results(RESULTS)) == []


@pytest.mark.parametrize("target", re.findall(r"\]\(([^)#]+)\)", PAGE))
def test_pictures_are_there(target: str) -> None:
    assert (DOCS / target).exists()
