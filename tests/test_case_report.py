"""The case report: complete, safe against markup in what it shows, and able to be printed."""

import re
from datetime import UTC, datetime
from pathlib import Path

import pytest
from click.testing import CliRunner

from fpmatch import load_template, save_template
from fpmatch.case_report.page import (
    CaseFile,
    CaseMark,
    CaseReportError,
    case_report,
    settings_of,
)
from fpmatch.cli.group import fpmatch
from fpmatch.pair import PairOptions, compare_pair
from fpmatch.reading import PrintReader, make_given_print

SAMPLES = Path(__file__).parents[1] / "sample_data"
MADE = datetime(2026, 1, 2, 3, 4, tzinfo=UTC)


def pair_of(*paths: Path):
    return compare_pair(*(make_given_print(PrintReader()(p), p.name) for p in paths), PairOptions())


@pytest.fixture(scope="module")
def match():
    return pair_of(SAMPLES / "101_1.tif", SAMPLES / "101_3.tif")


def page(pair, **options) -> str:
    files = CaseFile.of("a.tif", b"probe"), CaseFile.of("b.tif", b"reference")
    settings = settings_of(PairOptions(), pair.verification, (500.0, None), "learned")
    return case_report(pair, files, settings=settings, made=MADE, **options)


def test_it_states_files_settings_evidence_and_limits(match):
    html = page(match, title="Case 7", notes="one scar", marks=[CaseMark("probe", 10, 20, "scar")])
    for words in (
        "<title>Comparison: Case 7</title>",
        "2026-01-02 03:04 UTC",
        CaseFile.of("", b"probe").sha256,
        CaseFile.of("", b"reference").sha256,
        "500 dpi (probe)",
        "MATCH",
        f"{match.verification.score:.1f} of 100",
        "not a likelihood ratio",
        "one scar",
        "<td>10, 20</td><td>scar</td>",
        "@page",
    ):
        assert words in html
    assert html.count("data:image/png;base64,") == 5
    assert "cell by cell on the reference" in html
    assert "for looking" not in html
    assert len(re.findall(r'<tr><td class="n">\d+</td>', html)) == len(match.verification.pairs)
    assert page(match) == page(match)


def test_the_warped_overlay_says_what_it_is(match):
    html = page(match, warp=True)
    assert html.count("data:image/png;base64,") == 6
    words = f"warped through {len(match.verification.pairs)} pairs: for looking, not for measuring"
    assert words in html
    assert "moved by the similarity transform" in html


def test_a_print_compared_with_itself_is_called_identical(match):
    itself = pair_of(SAMPLES / "101_1.tif", SAMPLES / "101_1.tif")
    assert "the two images have the same pixels" in page(itself)
    assert "the same pixels" not in page(match)


def test_no_match_states_the_reason_and_has_no_pairs():
    pair = pair_of(SAMPLES / "101_1.tif", SAMPLES / "103_1.tif")
    html = page(pair)
    assert "NO MATCH" in html
    assert pair.verification.reason in html


def test_templates_have_no_quality(tmp_path):
    path = tmp_path / "a.json"
    image = make_given_print(PrintReader()(SAMPLES / "101_1.tif"), "a")
    save_template(path, image.template)
    assert load_template(path) == image.template
    html = page(pair_of(path, SAMPLES / "101_3.tif"))
    assert "a template, without an image" in html
    assert "not known of a template" in html


def test_nothing_that_is_shown_becomes_markup(match):
    evil = "<script>alert(1)</script>"
    mark = CaseMark("reference", 1, 2, evil)
    html = page(match, title=evil, notes=evil, marks=[mark])
    assert "<script" not in html
    assert html.count("&lt;script&gt;") == 4


def test_bad_marks_and_long_notes_are_refused(match):
    for mark in (("left", 0, 0), ("probe", float("nan"), 0)):
        with pytest.raises(CaseReportError):
            CaseMark(*mark)
    with pytest.raises(CaseReportError):
        page(match, notes="x" * 20_001)


def test_the_command_writes_it(tmp_path):
    target = tmp_path / "case.html"
    words = ["verify", str(SAMPLES / "101_1.tif"), str(SAMPLES / "101_3.tif"), "--dpi", "500"]
    result = CliRunner().invoke(fpmatch, [*words, "--case-report", str(target), "--notes", "loop"])
    assert result.exit_code == 0, result.output
    html = target.read_text("utf-8")
    assert CaseFile.of("", (SAMPLES / "101_3.tif").read_bytes()).sha256 in html
    assert "500 dpi (probe), 500 dpi (reference)" in html
    assert "loop" in html
    refused = CliRunner().invoke(
        fpmatch, [*words, "--case-report", str(tmp_path / "no" / "a.html")]
    )
    assert refused.exit_code == 2
    assert "Traceback" not in refused.output
