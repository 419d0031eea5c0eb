"""The page on point sets quotes nothing but words of the paper, and its results are good enough."""

import re
from pathlib import Path

from fpmatch.evaluation.points.results import read_results
from research.experiments.point_targets import missed_targets

DOCS = Path(__file__).resolve().parent.parent / "docs"
QUOTED = {
    "much faster",
    "pre-defined threshold value",
    "higher than the matching factor ρ",
    "Point pattern matching algorithm using unit-circle parametrization",
    "A fast expected time algorithm for the 2-D point pattern matching problem",
}


def test_the_page_quotes_nothing_but_words_of_the_paper():
    page = (DOCS / "explanation" / "point_sets.md").read_text(encoding="utf-8")
    prose = " ".join(re.sub(r"```.*?```", "", page, flags=re.DOTALL).split())
    assert set(re.findall(r'"([^"]+)"', prose)) == QUOTED
    assert not set("“”„«»") & set(prose)


def test_the_kept_results_miss_no_target():
    assert missed_targets(read_results(DOCS / "data" / "pointsets_bench.json")) == []
