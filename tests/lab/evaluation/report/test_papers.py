import re
from dataclasses import replace
from pathlib import Path

import pytest

from fpmatch.errors import OutputError
from fpmatch.lab.evaluation.report.analysis import Report
from fpmatch.lab.evaluation.report.papers import prepare_files, save_det, save_table
from tests.conftest import rows_of


@pytest.fixture
def two(report):
    """Return the report on two matchers, of which one has a parameter in its name."""
    return Report.of([report, replace(report, matcher="fake:a_b=1,c=50%")], bootstrap=20)


def test_the_table_has_a_row_a_matcher_and_database(two, tmp_path):
    save_table(tmp_path / "rates.csv", two.analyses)
    rows = rows_of(tmp_path / "rates.csv")
    assert [(row["matcher"], row["set"]) for row in rows] == [
        (one.report.matcher, name)
        for one in two.analyses
        for name in (*(row.name for row in one.report.sets), "pooled")
    ]
    known = two.analyses[0]
    for row, of, limits in zip(rows, known.report.sets, known.intervals.sets, strict=False):
        assert float(row["eer"]) == of.rates.eer
        assert (float(row["eer_low"]), float(row["eer_high"])) == tuple(limits.eer)
        assert (int(row["genuine"]), float(row["rank_one"])) == (of.genuine, of.rank_one)
    assert float(rows[2]["eer"]) == known.report.pooled.eer


def test_latex_and_csv_have_the_same_rates(two, tmp_path):
    for suffix in ("tex", "csv"):
        save_table(tmp_path / f"rates.{suffix}", two.analyses)
    text = (tmp_path / "rates.tex").read_text()
    lines = [line.removesuffix(r" \\").split(" & ") for line in text.splitlines() if "&" in line]
    assert lines[0][:5] == ["matcher", "database", "genuine", "impostor", "EER"]
    columns = re.fullmatch(r"\\begin\{tabular\}\{(l+r+)\}", text.splitlines()[0])[1]
    assert {len(line) for line in lines} == {len(columns)}
    for cells, row in zip(lines[1:], rows_of(tmp_path / "rates.csv"), strict=True):
        eer, low, high = (f"{100 * float(row[f'eer{end}']):.2f}" for end in ("", "_low", "_high"))
        assert cells[4] == f"{eer} [{low}, {high}]"
        assert cells[2:4] == [row["genuine"], row["impostor"]]
    assert r"fake:a\_b=1,c=50\%" in text
    assert text.count("{") == text.count("}")


@pytest.mark.parametrize(
    ("suffix", "begins"), [("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")]
)
def test_a_det_is_drawn_in_the_format_of_its_name(two, tmp_path, suffix, begins):
    pytest.importorskip("matplotlib")
    path = tmp_path / f"det.{suffix}"
    save_det(path, [one.report for one in two.analyses])
    assert path.read_bytes().startswith(begins)


def test_a_name_of_another_format_is_refused_before_work(tmp_path):
    for det, table in ((tmp_path / "det.doc", None), (None, tmp_path / "rates.xls")):
        with pytest.raises(OutputError, match="name ends with"):
            prepare_files(det, table)
    with pytest.raises(OutputError, match="cannot be written"):
        prepare_files(None, Path("/dev/null/rates.tex"))
    prepare_files(None, Path(tmp_path / "rates.TEX"))
