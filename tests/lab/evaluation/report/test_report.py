"""The report as text, JSON, tables, curves, plots and page."""

import itertools
import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch.errors import OutputError
from fpmatch.lab.evaluation.rates.scores import split, unnamed_set
from fpmatch.lab.evaluation.report.figures import save_det
from fpmatch.lab.evaluation.report.page import hardest_pairs, prepare_page, write_page
from fpmatch.lab.evaluation.report.results import RatesReport, SetRates, report_document
from fpmatch.lab.evaluation.report.text import as_text, check_table, save_table
from fpmatch.lab.evaluation.run import evaluate
from fpmatch.templates.minutiae import Minutiae, Template
from tests.conftest import rows_of


def rates_of(genuine, impostor, **options):
    return RatesReport.of([SetRates.of(unnamed_set(genuine, impostor, **options))])


def test_points_have_the_definition_and_lie_in_their_intervals(report):
    document = report_document([report], bootstrap=200, fmrs=[0.01, 0.05])
    found = document["fnmr_at_fmr"]
    assert [(p["name"], p["fmr"]) for p in found[:2]] == [("set, one", 0.01), ("set, one", 0.05)]
    assert [p["name"] for p in found[4:]] == ["pooled", "pooled"]
    every = [split([one]) for one in report.trials]
    for point, (genuine, impostor) in zip(found[::2], every, strict=False):
        assert np.mean(impostor >= point["threshold"]) <= point["fmr"]
        assert point["fnmr"] == np.mean(genuine < point["threshold"])
        assert point["interval"][0] <= point["fnmr"] <= point["interval"][1]
    assert report.sets[0].rates.fmr100 == found[0]["fnmr"]
    assert json.loads(json.dumps(document)) == document
    text = as_text(document)
    assert "FNMR at FMR" in text
    assert "95 % intervals" in text


def test_points_that_are_none():
    scores = rates_of(np.zeros(12), np.zeros(12))
    low, high = report_document([scores], bootstrap=20, fmrs=[1e-6, 0.5])["fnmr_at_fmr"]
    assert (low["fnmr"], low["threshold"], low["interval"]) == (None, None, None)
    assert (high["fnmr"], high["threshold"], high["interval"]) == (1.0, None, None)
    far = rates_of(np.array([-1.0, -2.0, -9.0]), -np.arange(3.0, 13.0), distances=True)
    (point,) = report_document([far], bootstrap=0, fmrs=[0.1])["fnmr_at_fmr"]
    assert (point["fnmr"], point["threshold"]) == (pytest.approx(1 / 3), 3.0)


def test_too_few_fingers_are_said(report):
    unknown = rates_of(np.ones(50), np.zeros(99))
    assert "none, there are too few fingers" in as_text(report_document([unknown], bootstrap=10))
    assert "Clopper-Pearson" not in as_text(report_document([report], bootstrap=10))


@pytest.fixture
def two(report):
    """Return the report on two matchers, of which one has a parameter in its name."""
    return [report, replace(report, matcher="fake:a_b=1,c=50%")]


def test_the_table_has_a_row_a_matcher_and_database(two, tmp_path):
    document = report_document(two, bootstrap=20)
    save_table(tmp_path / "rates.csv", document)
    rows = rows_of(tmp_path / "rates.csv")
    assert [(row["matcher"], row["set"]) for row in rows] == [
        (one.matcher, name) for one in two for name in (*(row.name for row in one.sets), "pooled")
    ]
    known = document["matchers"][0]["intervals"]["sets"]
    for row, of, limits in zip(rows, two[0].as_json()["sets"], known, strict=False):
        assert float(row["eer"]) == of["eer"]
        assert float(row["eer_low"]) == limits["eer"][0]
        assert int(row["genuine"]) == of["genuine"]
    assert float(rows[2]["eer"]) == two[0].pooled.eer


@pytest.mark.parametrize(
    ("suffix", "begins"), [("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")]
)
def test_a_det_is_drawn_in_the_format_of_its_name(two, tmp_path, suffix, begins):
    pytest.importorskip("matplotlib")
    path = tmp_path / f"det.{suffix}"
    save_det(path, two)
    assert path.read_bytes().startswith(begins)
    with pytest.raises(OutputError, match="a DET needs genuine and impostor pairs"):
        save_det(path, [rates_of(np.ones(3), np.empty(0))])


def test_what_cannot_be_written_is_refused_before_work(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot be made a folder"):
        prepare_page(tmp_path / "file" / "below")
    with pytest.raises(OutputError, match="name ends with"):
        check_table(tmp_path / "rates.xls")
    with pytest.raises(OutputError, match="cannot be written"):
        check_table(Path("/dev/null/rates.csv"))
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(OutputError, match=r"^a report needs matplotlib: pip install 'fpmatch\[plo"):
        prepare_page(tmp_path)


def test_a_page_loads_nothing_escapes_names_and_has_the_comparison(
    options, make_database, tmp_path
):
    pytest.importorskip("matplotlib")
    database = make_database("db", 6, 3, contents={"2_2": "broken"}, toml='name = "A & <b>"')
    report = evaluate([database], **options)
    results = [report, replace(report, matcher="other")]
    document = report_document(results, bootstrap=30, baseline=report.scores)
    page = prepare_page(tmp_path / "out")
    write_page(page, results, document)
    text = page.read_text(encoding="utf-8")
    loaded = re.findall(r"""(?:src|href)=["']?([^"' >]*)""", text)
    assert all(value.startswith("data:") for value in loaded)
    for shown in ("A &amp; &lt;b&gt;", "2_2.tif: ", "broken", "other compared with fake"):
        assert shown in text
    assert "fake compared with the baseline" in text
    assert "exact test: p = 1" in text


def test_a_database_of_genuine_pairs_alone(options, make_database, tmp_path):
    pytest.importorskip("matplotlib")
    alone = evaluate([make_database("db", 1, 3)], **options)
    twice = report_document([alone, alone], bootstrap=10)
    assert twice["against_first"] == []
    page = prepare_page(tmp_path)
    write_page(page, [alone, alone], twice)
    assert "No curves" in page.read_text(encoding="utf-8")


def test_the_worst_come_first_and_each_print_once(report):
    row = report.sets[0]
    report = replace(report, sets=(row,))
    for genuine in (True, False):
        worst = hardest_pairs(report, 4, genuine=genuine)
        values = [pair["similarity"] for pair in worst]
        assert values == sorted(values, reverse=not genuine)
        named = [name for pair in worst for name in pair["names"]]
        assert len(named) == len(set(named))
        assert "1_2.tif" not in named
        kept = (row.scores.trials.genuine == genuine) & row.scores.compared
        every = row.scores.trials.similarity[kept]
        assert values[0] == (every.min() if genuine else every.max())
        assert all(pair["note"].startswith("not drawn: ") for pair in worst)


def printed(path, dpi):
    """Extract minutiae that lie where a picture's name says, with nothing to look at."""
    finger, number = map(int, path.stem.split("_"))
    rng = np.random.default_rng(finger)
    moved = np.random.default_rng([finger, number]).normal(0, 1, (24, 2))
    xy = rng.uniform(20, 130, (24, 2)) + moved
    return Template(Minutiae(*xy.T, rng.uniform(0, 6, 24)), 150, 150)


def test_the_worst_are_drawn(tmp_path):
    for finger, number in itertools.product((1, 2, 3), (1, 2)):
        noise = np.random.default_rng([finger, number]).integers(0, 255, (150, 150), np.uint8)
        Image.fromarray(noise).save(tmp_path / f"{finger}_{number}.png")
    report = evaluate([tmp_path], extractor=printed, workers=1)
    (worst, *_) = hardest_pairs(report, 1, genuine=False)
    assert worst["picture"][8:12] == b"WEBP"
    assert worst["score"] > 0
    assert "of minutiae, overlap" in worst["note"]
    (tmp_path / worst["names"][0]).unlink()
    (again, *_) = hardest_pairs(report, 1, genuine=False)
    assert ("picture" in again, again["note"].startswith("not drawn: ")) == (False, True)
