"""The case report: complete, safe against markup in what it shows, and able to be printed."""

import base64
import io
import re
import shutil
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from string import ascii_uppercase

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from fpmatch import load_template, save_template
from fpmatch.cli.group import fpmatch
from fpmatch.drawing.case_report import (
    CaseFile,
    CaseMark,
    CaseReportError,
    case_report,
    settings_of,
)
from fpmatch.drawing.scene.palette import EXAMINER_MARK
from fpmatch.prints.pair import PairOptions, compare_pair
from fpmatch.prints.reading import PrintReader, make_given_print

SAMPLES = Path(__file__).parents[2] / "sample_data"
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
    settings = settings_of(PairOptions(), pair, (500.0, None), "learned")
    return case_report(pair, files, settings=settings, made=MADE, **options)


def test_it_states_files_settings_evidence_and_limits(match):
    mark = CaseMark("probe", 10, 20, "scar")
    html = page(match, case_number="7", notes="one scar", marks=[mark])
    for words in (
        "<title>Case 7: a.tif and b.tif</title>",
        "2026-01-02 03:04 UTC",
        CaseFile.of("", b"probe").sha256,
        CaseFile.of("", b"reference").sha256,
        "probe 500 dpi, as given; reference 500 dpi, of the file",
        "MATCH",
        f"{match.verification.score:.1f} of 100",
        "not a likelihood ratio",
        "one scar",
        '<b>A</b></td><td>probe</td><td>10, 20</td><td class="notes">scar</td>',
        "@page",
    ):
        assert words in html
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
def test_no_match_states_the_reason_and_has_no_pairs():
    pair = pair_of(SAMPLES / "101_1.tif", SAMPLES / "103_1.tif")
    html = page(pair)
    assert "NO MATCH" in html
    assert pair.verification.reason in html


@pytest.mark.usefixtures("words_alone")
def test_templates_have_no_quality(tmp_path):
    path = tmp_path / "a.json"
    image = make_given_print(PrintReader()(SAMPLES / "101_1.tif"), "a")
    save_template(path, image.template)
    assert load_template(path) == image.template
    html = page(pair_of(path, SAMPLES / "101_3.tif"))
    assert "a template, without an image" in html
    assert "not known of a template" in html


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


def shown_lines(html):
    (notes,) = re.findall(r'<p class="notes">(.*?)</p>', html, re.DOTALL)
    return notes.split("\n")


@pytest.mark.usefixtures("words_alone")
def test_every_line_break_in_notes_begins_a_line(match):
    text = "".join(f"  {one!a}{one}{one}" for one in BREAKS)
    html = page(match, notes=text, marks=[CaseMark("probe", 1, 1, text)])
    lines = "\n\n".join(f"  {one!a}" for one in BREAKS).replace("'", "&#39;")
    assert "\n".join(shown_lines(html)) == lines
    assert f'<td class="notes">{lines}</td>' in html


@pytest.mark.usefixtures("words_alone")
def test_tabs_in_notes_stay_and_other_control_characters_are_escaped(match):
    html = page(match, notes="a\tb\x1b[2J\x00\x1c\u202ec")
    assert shown_lines(html) == [r"a&#9;b\x1b[2J\x00\x1c\u202ec"]


@pytest.mark.slow
def test_marks_keep_their_letters_and_are_drawn(match):
    marks = [CaseMark("probe" if k % 2 else "reference", 60 + 9 * k, 150) for k in range(28)]
    html = page(match, marks=marks)
    letters = re.findall(r"<tr><td><b>(\w+)</b></td>", html)
    assert letters == [*ascii_uppercase, "A2", "B2"]
    without = page(match)
    drawn, clean = pictures(html), pictures(without)
    assert len(drawn) == len(clean) == 5
    for (name, picture), other in zip(drawn.items(), clean.values(), strict=True):
        differ = np.flatnonzero(np.any(picture != other, axis=-1)) if picture.ndim == 3 else []
        assert (len(differ) > 500) == (name not in {"probe", "reference"}), name
    purple = np.all(drawn["The probe over the reference"] == EXAMINER_MARK, axis=2)
    assert purple.sum() > 500
    assert "outside the image" not in html
    assert "outside the image" in page(match, marks=[CaseMark("probe", -1, 0)])


def pictures(html):
    """Return the pictures of a page by their descriptions."""
    found = re.findall(r'<img src="data:image/png;base64,(.*?)" alt="(.*?)">', html)
    return {alt: np.asarray(Image.open(io.BytesIO(base64.b64decode(data)))) for data, alt in found}


@pytest.mark.usefixtures("words_alone")
def test_an_assumed_resolution_is_named_as_one(tmp_path):
    path = tmp_path / "untold.png"
    Image.open(SAMPLES / "101_1.tif").save(path)
    pair = pair_of(path, SAMPLES / "101_3.tif")
    html = page(pair)
    assert "at 500 dpi (assumed)" in html
    settings = settings_of(PairOptions(), pair, (None, None), "learned")
    assert settings["Resolution"] == (
        "probe 500 dpi, assumed: the file does not state it; reference 500 dpi, of the file"
    )


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PAPERS = {"a4": (8.27, 11.69), "letter": (8.5, 11.0)}


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
@pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="poppler's tools are not installed")
@pytest.mark.parametrize("paper", sorted(PAPERS))
@pytest.mark.parametrize("other", ["101_3.tif", "102_1.tif"])
def test_it_prints_on_few_full_and_numbered_pages(tmp_path, paper, other):
    width, height = PAPERS[paper]
    pair = pair_of(SAMPLES / "101_1.tif", SAMPLES / other)
    html = page(pair, case_number="2026-17", notes="one\r\ntwo")
    html = html.replace("@page {", f"@page {{ size: {width}in {height}in;", 1)
    texts, pages = printed(html, tmp_path)
    assert len(pages) <= 4
    for number, (text, pixels) in enumerate(zip(texts, pages, strict=True), start=1):
        assert f"Page {number} of {len(pages)}" in text
        assert "Case 2026-17" in text
        if number < len(pages):  # the last page ends where the report ends
            used = np.flatnonzero((pixels < 200).any(axis=1))
            inner = used[used < 0.94 * len(pixels)]  # without the line below
            assert np.diff(inner).max() < 0.15 * len(pixels)
            assert inner[-1] > 0.75 * len(pixels)
    assert any("one\ntwo" in text for text in texts)


def printed(html, folder):
    """Return text and grey pixels of each page that Chromium prints."""
    (folder / "case.html").write_text(html, "utf-8")
    quiet = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage")
    pdf = folder / "case.pdf"
    address = (folder / "case.html").as_uri()
    work = [CHROMIUM, *quiet, f"--user-data-dir={folder}", f"--print-to-pdf={pdf}", address]
    subprocess.run(work, check=True, capture_output=True, timeout=120)
    text = subprocess.run(["pdftotext", pdf, "-"], check=True, capture_output=True, text=True)
    subprocess.run(["pdftoppm", "-r", "50", "-gray", pdf, folder / "page"], check=True)
    pages = [np.asarray(Image.open(path)) for path in sorted(folder.glob("page-*.pgm"))]
    return text.stdout.split("\f")[: len(pages)], pages


def test_the_command_writes_it(tmp_path):
    target = tmp_path / "case.html"
    words = ["verify", str(SAMPLES / "101_1.tif"), str(SAMPLES / "101_3.tif"), "--dpi", "500"]
    report = ["--case-report", str(target)]
    about = ["--notes", "loop\r\nscar", "--case-number", "2026-17"]
    result = CliRunner().invoke(fpmatch, [*words, *report, *about])
    assert result.exit_code == 0, result.output
    html = target.read_text("utf-8")
    assert CaseFile.of("", (SAMPLES / "101_3.tif").read_bytes()).sha256 in html
    assert "probe 500 dpi, as given; reference 500 dpi, as given" in html
    assert '<p class="notes">loop\nscar</p>' in html
    assert "<title>Case 2026-17: 101_1.tif and 101_3.tif</title>" in html
    target.unlink()
    for wrong in (about, [*report, "--case-number", "7" * 61]):
        stopped = CliRunner().invoke(fpmatch, [*words, *wrong])
        assert stopped.exit_code == 2
        assert "case" in stopped.output
        assert not target.exists()
    refused = CliRunner().invoke(
        fpmatch, [*words, "--case-report", str(SAMPLES / "101_1.tif" / "a.html")]
    )
    assert refused.exit_code == 2
    assert "Traceback" not in refused.output
