import re
import sys
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from fpmatch.errors import OutputError
from fpmatch.lab.evaluation.rates.scores_set import unnamed_set
from fpmatch.lab.evaluation.report.analysis import Report
from fpmatch.lab.evaluation.report.page import page as page_of
from fpmatch.lab.evaluation.report.page import prepare_page, write_page
from fpmatch.lab.evaluation.report.results import scores_of
from fpmatch.lab.evaluation.report.score_reports import summarise_scores
from fpmatch.lab.evaluation.run import evaluate, evaluate_matchers

pytest.importorskip("matplotlib")
VOID = {"meta", "img", "input"}


class Reader(HTMLParser):
    """Check that elements close in order; gather words and what is loaded from elsewhere."""

    def __init__(self, page):
        super().__init__()
        self.open, self.words, self.loaded = [], [], []
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        self.loaded += [v for k, v in attrs if k in {"src", "href", "xlink:href"} and v]

    def handle_startendtag(self, tag, attrs):
        """Ignore what closes itself."""

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1:] != ["style"]:
            self.words.append(data)


@pytest.fixture
def database(make_database):
    return make_database("db", 6, 3, contents={"2_2": "broken"}, toml='name = "A & <b>"')


def test_a_page_closes_what_it_opens_and_loads_nothing(options, database, tmp_path):
    report = evaluate([database], **options)
    baseline = scores_of(report)
    target = write_page(tmp_path / "out", Report.of([report], bootstrap=30, baseline=baseline))
    read = Reader(target.read_text(encoding="utf-8"))
    assert all(value.startswith(("data:", "#")) for value in read.loaded)
    words = "".join(read.words)
    assert "A & <b>" in words
    assert "2_2.tif: broken" in words
    assert "Compared with the baseline" in words
    assert "no change" in words
    assert "pooled" not in words


def test_two_matchers_stand_side_by_side_and_share_no_identifier(bench, options, database):
    class Other(bench.Fake):
        name = "other"

        def prepare(self, template):
            return min(super().prepare(template), 250.0)

    reports = evaluate_matchers(
        [database], [bench.MATCHER, Other()], extractor=bench.extractor, workers=1
    )
    page = page_of(Report.of(reports, bootstrap=30))
    words = "".join(Reader(page).words)
    assert "Matchers side by side" in words
    assert "other against fake, pair by pair" in words
    identifiers = re.findall(r'\bid="([^"]+)"', page)
    assert len(identifiers) == len(set(identifiers))


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("paper", "Where more than a share rho = 0.6 of the minutiae must be paired, "),
        ("unit-circle", "At the default threshold of 40, "),
        ("fake", ""),
    ],
)
def test_the_decisions_are_those_of_verify(report, name, rule):
    page = page_of(Report.of([replace(report, matcher=name)], bootstrap=0))
    words = "".join(Reader(page).words)
    assert "<small>" not in page  # no intervals
    assert ("genuine pairs do not match" in words) == bool(rule)
    assert rule in words


def test_a_database_of_genuine_pairs_alone(options, make_database):
    alone = evaluate([make_database("db", 1, 3)], **options)
    assert "No curves" in page_of(Report.of([alone], bootstrap=10))
    twice = Report.of([alone, alone], bootstrap=10)
    assert twice.comparisons == ()
    assert "side by side" in page_of(twice)


def test_no_error_has_a_limit_on_the_page_and_its_method_is_named(report):
    scores = unnamed_set(np.ones(50), np.linspace(0.0, 0.5, 99))
    words = "".join(Reader(page_of(Report.of([summarise_scores([scores])], bootstrap=10))).words)
    assert "0.00 %at most 5.82 % (0 of 50)" in words
    assert "95 % bound by Clopper-Pearson, one-sided; n counts comparisons as if" in words
    assert "Clopper-Pearson" not in page_of(Report.of([report], bootstrap=10))


def test_a_page_that_cannot_be_is_refused(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot be made a folder"):
        prepare_page(tmp_path / "file" / "below")
    (tmp_path / "index.html").mkdir()
    with pytest.raises(OutputError, match="it is a folder"):
        prepare_page(tmp_path)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(OutputError, match=r"^a report needs matplotlib: pip install 'fpmatch\[plo"):
        prepare_page(tmp_path)
