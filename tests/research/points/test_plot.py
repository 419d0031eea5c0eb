"""The plot of time against the number of points."""

import sys

import numpy as np
import pytest
from PIL import Image

from fpmatch.errors import OutputError
from fpmatch.lab.plots.style import check_plot
from research.points.conditions import conditions
from research.points.plot import save_bench_plot
from research.points.results import BenchResults, PointCell

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
        ("nowhere/bench.png", r"bench\.png: cannot be written: "),
        ("bench.png", r"bench\.png: needs matplotlib: .*fpmatch\[plot\]"),
    ):
        with pytest.raises(OutputError, match=reason):
            check_plot(tmp_path / name)
