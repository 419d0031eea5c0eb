"""The case report: complete, safe against markup in what it shows, and able to be printed."""

import re
from datetime import UTC, datetime
from pathlib import Path as File
from string import ascii_uppercase

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from fpmatch import save_template
from fpmatch.cli.group import fpmatch
from fpmatch.drawing.case_report import (
    CaseFile,
    CaseMark,
    CaseReportError,
    case_report,
    examiner_marks,
    settings_of,
)
from fpmatch.drawing.scene.items import Box, Circle, Text, zoomed
from fpmatch.prints.pair import PairOptions, compare_pair
from fpmatch.prints.reading import PrintReader, make_given_print

SAMPLES = File(__file__).parents[2] / "sample_data"
MADE = datetime(2026, 1, 2, 3, 4, tzinfo=UTC)


def pair_of(*paths):
    return compare_pair(*(make_given_print(PrintReader()(p), p.name) for p in paths), PairOptions())


@pytest.fixture(scope="module")
def match():
    return pair_of(SAMPLES / "101_1.tif", SAMPLES / "101_3.tif")


@pytest.fixture
def words_alone(monkeypatch):
    """Let pages have empty pictures, which take most of their time."""
    monkeypatch.setattr("fpmatch.drawing.case_report._picture", lambda *_: "")
    monkeypatch.setattr("fpmatch.drawing.case_report.png_bytes", lambda _: b"")


def page(pair, **options):
    files = CaseFile.of("a.tif", b"probe"), CaseFile.of("b.tif", b"reference")
    settings = settings_of(PairOptions(), pair, "learned")
    return case_report(pair, files, settings=settings, made=MADE, **options)


def test_it_states_files_settings_evidence_and_limits(match):
    marks = [CaseMark("probe", 10, 20, "scar"), *[CaseMark("reference", -1, 0)] * 27]
    html = page(match, case_number="7", notes="one scar", marks=marks)
    for words in (
        "<title>Case 7: a.tif and b.tif</title>",
        "2026-01-02 03:04 UTC",
        CaseFile.of("", b"probe").sha256,
        CaseFile.of("", b"reference").sha256,
        "MATCH",
        f"{match.verification.score:.1f} of 100",
        "not a likelihood ratio",
        "one scar",
        '<b>A</b></td><td>probe</td><td>10, 20</td><td class="notes">scar</td>',
        "outside the image",
        "@page",
    ):
        assert words in html
    letters = re.findall(r"<tr><td><b>(\w+)</b></td>", html)
    assert letters == [*ascii_uppercase, "A2", "B2"]
    assert html.count("data:image/png;base64,") == 5
    assert "cell by cell on the reference" in html
    assert len(re.findall(r'<tr><td class="n">\d+</td>', html)) == len(match.verification.pairs)
    assert page(match) == page(match)


@pytest.mark.usefixtures("words_alone")
def test_a_print_compared_with_itself_is_called_identical(match):
    itself = pair_of(SAMPLES / "101_1.tif", SAMPLES / "101_1.tif")
    html = page(itself)
    verdict = html.partition('<div class="verdict')[2].partition("</div>")[0]
    assert "MATCH, identical images" in verdict
    assert "The two images have the same pixels" in verdict
    assert "pairs of different fingers" not in html
    assert "the same pixels" not in page(match)


@pytest.mark.usefixtures("words_alone")
def test_what_is_not_known_is_stated(tmp_path):
    """The resolution of the probe, the quality of a template; a non-match has a reason."""
    template, untold = tmp_path / "a.json", tmp_path / "untold.png"
    save_template(template, make_given_print(PrintReader()(SAMPLES / "103_1.tif"), "a").template)
    Image.open(SAMPLES / "101_1.tif").save(untold)
    pair = pair_of(untold, template)
    html = page(pair)
    for words in (
        "NO MATCH",
        pair.verification.reason,
        "a template, without an image",
        "not known of a template",
        "at 500 dpi (assumed)",
    ):
        assert words in html


@pytest.mark.usefixtures("words_alone")
def test_nothing_that_is_shown_becomes_markup(match):
    evil = "<script>alert(1)</script>"
    mark = CaseMark("reference", 1, 2, evil)
    html = page(match, case_number=evil, notes=evil, marks=[mark])
    assert "<script" not in html
    assert html.count("&lt;script&gt;") == 4
    breaking = '"; } </style><b>\\"\n'
    html = page(match, case_number=breaking)
    assert html.count("</style>") == 1
    (line,) = re.findall(r'@top-left \{ content: "(.*?)";', html)
    assert re.fullmatch(r"([0-9A-Za-z]|\\[0-9a-f]+ )+", line)


def test_bad_marks_and_long_notes_are_refused(match):
    for mark in (("left", 0, 0), ("probe", float("nan"), 0), ("probe", 0, 1e300)):
        with pytest.raises(CaseReportError):
            CaseMark(*mark)
    refused = {"notes": "x" * 200_001, "case_number": "7" * 61, "marks": [CaseMark("probe", 1, 1)]}
    refused["marks"] *= 501
    for name, value in refused.items():
        with pytest.raises(CaseReportError, match="at most"):
            page(match, **{name: value})


BREAKS = ("\n", "\r\n", "\r", "\v", "\f", "\x85", "\u2028", "\u2029")


@pytest.mark.usefixtures("words_alone")
def test_line_breaks_and_tabs_in_notes_stay_and_control_characters_are_escaped(match):
    text = "".join(f"  {one!a}{one}{one}" for one in BREAKS) + "a\tb\x1b[2J\x00\u202ec"
    html = page(match, notes=text, marks=[CaseMark("probe", 1, 1, text)])
    lines = "\n\n".join(f"  {one!a}" for one in BREAKS).replace("'", "&#39;")
    lines += "\n\n" + r"a&#9;b\x1b[2J\x00\u202ec"
    assert f'<p class="notes">{lines}</p>' in html
    assert f'<td class="notes">{lines}</td>' in html


def test_marks_are_where_they_were_set_and_none_is_off_its_print():
    own = [CaseMark("probe", 30, 40), CaseMark("reference", 50, 60), CaseMark("probe", 700, 1)]
    sides = (
        (np.eye(3), Box(0, 0, 600, 600)),
        (zoomed(2.0, (0, 0), (600, 0)), Box(600, 0, 600, 600)),
    )
    drawn = examiner_marks(own, sides)
    assert [item.centre for item in drawn if isinstance(item, Circle)] == [(30, 40), (700, 120)]
    assert [item.text for item in drawn if isinstance(item, Text)] == ["A", "B"]


def test_the_command_writes_it(tmp_path):
    target = tmp_path / "case.html"
    words = ["verify", str(SAMPLES / "101_1.tif"), str(SAMPLES / "101_3.tif"), "--dpi", "500"]
    report = ["--case-report", str(target)]
    about = ["--notes", "loop\r\nscar", "--case-number", "2026-17"]
    result = CliRunner().invoke(fpmatch, [*words, *report, *about])
    assert result.exit_code == 0, result.output
    html = target.read_text("utf-8")
    assert CaseFile.of("", (SAMPLES / "101_3.tif").read_bytes()).sha256 in html
    assert '<p class="notes">loop\nscar</p>' in html
    assert "<title>Case 2026-17: 101_1.tif and 101_3.tif</title>" in html
    target.unlink()
    for wrong in (about, [*report, "--case-number", "7" * 61]):
        stopped = CliRunner().invoke(fpmatch, [*words, *wrong])
        assert stopped.exit_code == 2
        assert "case" in stopped.output
        assert not target.exists()
