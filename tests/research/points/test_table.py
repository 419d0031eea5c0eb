import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from fpmatch.errors import OutputError
from fpmatch.lab.plots.style import check_plot
from research.points.conditions import PAPER_ROWS, Condition, conditions
from research.points.matchers import MATCHER_NAMES
from research.points.plot import save_bench_plot
from research.points.results import BenchResults, PointCell, SkippedCell
from research.points.summary import geometric_mean, speed_ups, summarise
from research.points.table import format_bench, format_ms

CELL = PointCell(Condition("patch", 5, 2), "triangles", "1" * 9 + "0", 1, 100, 0.5, 1.0, 2.0, 3.0)


def table_of(*cells):
    """Return the lines of the tables, and their cells."""
    lines = format_bench(BenchResults({}, list(cells))).splitlines()
    return [
        [c.strip() for c in line.strip("|").split("|")] if "|" in line else line for line in lines
    ]


def summary_of(*cells):
    return summarise(BenchResults({}, list(cells)))


def at(row, factor=2, **changes):
    return replace(CELL, condition=Condition("patch", row, factor), **changes)


def test_a_cell_stands_in_its_column_beside_the_papers_time():
    title, _, head, _, row, _, answers, _, counts, _, found, *_ = table_of(at(5, 4, mean_ms=0.75))
    assert title == "### triangles, patch model: times in ms, beside the paper's Table 2"
    names = [f"n = 2m: {name}" for name in ("median", "mean", "paper", "indep.")]
    assert head[:8] == ["m", "rho", "eta", "lambda", *names]
    assert row == [
        *("50", "0.6", "0.25", "0.61"),
        *("-", "-", "0.58", "-"),
        *("0.50", "0.75", "1.21", "2.00"),
        *("-", "-", "2.19", "-"),
    ]
    assert answers == "### triangles, patch model: answers"
    assert counts[4:6] == ["n = 2m: TP", "n = 2m: FP"]
    assert found[4:] == ["-", "-", "9/10", "1/100", "-", "-"]
    assert table_of(CELL)[4][4:8] == ["0.50", "-", "0.58", "2.00"]  # without a mean


def test_each_matcher_stands_beside_its_own_table_and_astroalign_beside_none():
    for matcher, source, published in (("paper", 2, "0.58"), ("van-wamelen", 1, "504")):
        title, _, _, _, row, *_ = table_of(replace(CELL, matcher=matcher))
        assert title.endswith(f"Table {source}")
        assert published in row
    title, _, head, _, row, *_ = table_of(replace(CELL, matcher="astroalign"))
    assert title.startswith("### astroalign, patch model: ")
    assert "n = 2m: paper" not in head
    assert "0.58" not in row


@pytest.fixture(scope="module")
def everything():
    """Return a cell of each matcher at each condition, with the longest words there can be."""
    counts = {"outcomes": "1" * 100, "independent_trials": 100, "false_positives": 100}
    times = dict.fromkeys(("time_ms", "mean_ms", "independent_time_ms"), 20345.6)
    cells = [
        replace(CELL, condition=condition, matcher=name, **counts, **times)
        for condition in conditions()
        for name in MATCHER_NAMES
    ]
    skipped = [SkippedCell(condition, "astroalign", "long") for condition in conditions()]
    steps = {"genuine_steps": 10**9, "independent_steps": 10**9, "budget_s": 20.0}
    return BenchResults(steps, cells, skipped)


def test_there_is_a_block_a_model_and_matcher(everything):
    text = format_bench(everything)
    lines = text.splitlines()
    titles = [line[4:].split(" model:")[0] for line in lines if line.startswith("### ")]
    blocks = [f"{name}, {model}" for model in ("patch", "clutter") for name in MATCHER_NAMES]
    assert titles == [block for block in blocks for _ in ("times", "answers")]
    tables = [line for line in lines if line.startswith("|")]
    assert len(tables) == 2 * 4 * 2 * (13 + 2)
    assert {line.count("|") for line in tables} == {17, 14, 11}
    summary = summarise(everything)
    assert lines[-len(summary) :] == [f"- {line}" for line in summary]
    *_, steps, patch, clutter = summary
    assert "1,000,000,000 points" in steps
    assert patch.startswith("astroalign, patch: 39 cells not run")
    assert patch.endswith("over 20 s")
    assert clutter.startswith("astroalign, clutter: 39 cells not run")


@given(st.floats(1e-4, 1e7))
def test_a_time_is_short_and_nearly_what_it_was(milliseconds):
    text = format_ms(milliseconds)
    assert len(text) <= max(5, len(str(round(milliseconds))))
    assert math.isclose(float(text), milliseconds, rel_tol=0.051, abs_tol=5e-4)


def test_times_at_the_edges_of_their_digits():
    times = (0.62, 0.09996, 9.996, 99.96, 999.7)
    assert [*map(format_ms, times)] == ["0.62", "0.10", "10.0", "100", "1000"]


def test_the_speed_up_is_over_the_rows_that_both_ran_at_n_2m():
    cells = [at(0, time_ms=1.0), at(1, time_ms=2.0), at(0, 4, time_ms=1.0)]
    for row, factor, ms in ((0, 2, 8.0), (1, 2, 4.0), (2, 2, 1000.0), (0, 4, 1000.0)):
        cells.append(at(row, factor, matcher="van-wamelen", time_ms=ms))
    results = BenchResults({}, cells)
    assert speed_ups(results, "patch") == [8.0, 2.0]
    assert speed_ups(results, "clutter") == []
    assert geometric_mean([8.0, 2.0]) == pytest.approx(4.0)
    assert summarise(results)[0] == (
        "triangles over van-wamelen at n = 2m, patch: 4.0 times as fast (geometric mean of 2 rows, "
        "2.0 to 8.0)"
    )


def test_the_summary_names_the_worst_cell_and_counts_false_positives():
    lines = summary_of(CELL, at(0, 8, outcomes="10", stopped=3))
    assert lines[:2] + lines[4:] == [
        "triangles over scipy's two triangulations, patch: rho 0.6: 0.50 to 0.50, "
        "rho 0.95: 0.50 to 0.50 times its time",
        "triangles on independent pairs, patch: 4.0 times the time of a genuine pair (median of 2 "
        "cells, 4.0 to 4.0)",
        "triangles, patch: recognised 10 of 12, at worst 1 of 2 (rho 0.95, m 50, n 400); "
        "false positives 2 of 200; stopped for taking too long 3",
    ]
    first, second = lines[2:4]
    assert first.startswith("the paper's Table 1, n = 2m: 1411 ms on average; time grows as m^")
    assert first.endswith("differ by a factor of 32 at most")
    assert second.startswith("the paper's Table 2, n = 2m: 2.215 ms on average; time grows as m^")
    assert second.endswith("differ by a factor of 1.24 at most")


def test_growth_averages_and_times_on_independent_pairs():
    cells = [at(row, time_ms=3e-4 * PAPER_ROWS[row].m ** 1.5) for row in range(5)]
    line = "triangles, patch, n = 2m: time grows as m^1.50 (rho 0.95)"
    assert line in summary_of(*cells)
    assert not any("time grows" in line for line in summary_of(*cells[:2])[:-3])
    cells = [at(row, mean_ms=float(row)) for row in range(13)]  # only where all rows ran
    assert "average time at n = 2m, patch, over all 13 rows: triangles 6 ms" in summary_of(*cells)
    assert not any("average time" in line for line in summary_of(*cells[1:]))
    lines = summary_of(CELL, replace(CELL, matcher="paper", independent_time_ms=1.0))
    assert [line.endswith("in 1 of 1 cells") for line in lines if "independent pairs" in line] == [
        1
    ]


def test_of_nothing_there_is_only_the_legend():
    assert table_of()[0].startswith("- median, mean: ")
    assert summary_of() == []


COLOURS = {"triangles": (0x00, 0x72, 0xB2), "paper": (0x00, 0x9E, 0x73)}


def results(models=("patch", "clutter")):
    cells = [
        PointCell(where, name, "1", 0, 1, where.n * factor / 100, where.n / 50, 1.0, 1.0)
        for where in conditions(models)
        for name, factor in (("triangles", 1), ("paper", 4))
    ]
    return BenchResults({}, cells)


def test_the_lines_of_the_matchers_are_in_the_picture(tmp_path):
    pytest.importorskip("matplotlib")
    save_bench_plot(tmp_path / "bench.png", results())
    with Image.open(tmp_path / "bench.png") as image:
        pixels = np.asarray(image.convert("RGB"))
    for colour in COLOURS.values():
        assert (np.abs(pixels.astype(int) - colour).max(axis=2) < 8).sum() > 500
    assert pixels.shape[:2] == (1050, 1800)


@pytest.mark.slow
def test_a_model_that_did_not_run_has_no_panels_and_the_svg_is_always_the_same(tmp_path):
    pytest.importorskip("matplotlib")
    one, two = tmp_path / "one.svg", tmp_path / "two.svg"
    for path in (one, two):
        save_bench_plot(path, results(("clutter",)))
    assert one.read_bytes() == two.read_bytes()
    assert "clutter model" in one.read_text()
    assert "patch model" not in one.read_text()
    save_bench_plot(tmp_path / "bench.PDF", BenchResults({}))
    assert (tmp_path / "bench.PDF").read_bytes().startswith(b"%PDF")


def test_a_plot_that_cannot_be_written_is_refused_at_once(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for name, reason in (
        ("bench.gif", r"bench\.gif: a plot's name ends with \.png, \.svg, \.pdf"),
        ("bench", "bench: a plot's name ends with"),
        ("/dev/null/bench.png", r"bench\.png: cannot be written: "),
        ("bench.png", r"bench\.png: needs matplotlib: .*fpmatch\[plot\]"),
    ):
        with pytest.raises(OutputError, match=reason):
            check_plot(tmp_path / name)
