"""The plot of two point sets: marks are in their places, and the words are those of the result."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.palette import PROBE_MARK, hexadecimal
from fpmatch.errors import OutputError
from fpmatch.lab.plots.style import check_plot, save_point_plot
from fpmatch.pointset.geometry.point_match import PointMatch
from fpmatch.pointset.geometry.similarity import Similarity

pytest.importorskip("matplotlib", reason="the plot extra is not installed")

MOVE = Similarity(2.0, 0.5, 300.0, -40.0)
PAIRED = 8


@pytest.fixture
def sets(rng):
    """Return 10 points and 12, of which the first eight of both are partners."""
    p = rng.uniform(0, [100, 60], (10, 2))
    return p, np.vstack([MOVE.apply(p[:PAIRED]), rng.uniform(300, 400, (4, 2))])


@pytest.fixture
def match():
    pairs = np.column_stack([np.arange(PAIRED)] * 2).astype(np.int32)
    return PointMatch(MOVE, pairs, 0.8, 0.0, 1, 1e-9)


def drawn(path, *given, **named):
    """Return the text of the SVG that is drawn."""
    save_point_plot(path, *given, **named)
    return path.read_text(encoding="utf-8")


def words_of(svg):
    root = ElementTree.fromstring(svg)
    return [node.text or "" for node in root.iter("{http://www.w3.org/2000/svg}text")]


def marks_of(svg, colour):
    """Return the places of all marks of a colour, in SVG's units, those of the legend left out."""
    legend = svg.index('<g id="legend_')
    found = re.findall(
        rf'<use xlink:href="#\w+" x="([-\d.]+)" y="([-\d.]+)" style="[^"]*{hexadecimal(colour)}',
        svg[:legend],
    )
    return np.array(found, dtype=np.float64).reshape(-1, 2)


def test_every_point_has_its_mark(tmp_path, sets, match):
    p, q = sets
    svg = drawn(tmp_path / "plot.svg", p, q, match)
    rings, dots = marks_of(svg, palette.REFERENCE_MARK), marks_of(svg, PROBE_MARK)
    np.testing.assert_allclose(rings, dots, atol=1e-3)  # an exact match: dots amid their rings
    squares, crosses = marks_of(svg, palette.REFERENCE_INK), marks_of(svg, palette.PROBE_INK)
    places = np.vstack([rings, squares, crosses])
    truth = np.vstack([q[:PAIRED], q[PAIRED:], MOVE.apply(p[PAIRED:])])
    truth[:, 1] *= -1  # in SVG, y points down
    fit = Similarity.fit(truth, places)  # the same scale along x and y, and no turn
    np.testing.assert_allclose(fit.apply(truth), places, atol=1e-3)
    assert abs(fit.rotation) < 1e-6


def test_sets_that_do_not_match_are_drawn_side_by_side(tmp_path, sets):
    words = words_of(drawn(tmp_path / "plot.svg", *sets, PointMatch.none(), names=("a", "b")))
    assert "NO MATCH" in words
    assert "P (a): 10 points" in words
    assert "Q (b): 12 points" in words


@pytest.mark.parametrize("name", ["$x_1$ & <b>", "two\nlines\x01", "日本", "\udcff"])
def test_any_name_can_be_written(tmp_path, sets, match, name):
    words = words_of(drawn(tmp_path / "plot.svg", *sets, match, names=(name, "Q")))
    shown = re.sub("[\n\x01\udcff]", " ", name)
    assert f"P ({shown}), moved, on Q (Q)" in words
    save_point_plot(tmp_path / "plot.png", *sets, match, names=(name, "Q"))


@pytest.mark.parametrize("factor", [1e-310, 1e-40, 1e12, 1e40, 1e80])
@pytest.mark.parametrize("move", [Similarity(), None])
def test_points_of_any_magnitude_are_drawn(tmp_path, sets, factor, move):
    pairs = np.array([[0, 0]] if move else np.empty((0, 2)), np.int32)
    match = PointMatch(move, pairs, 0.1, 0.0, 1)
    p, q = (points * factor for points in sets)
    assert words_of(drawn(tmp_path / "plot.svg", p, q, match))
    save_point_plot(tmp_path / "plot.png", p, q, match)


def test_where_no_plot_can_go(tmp_path, sets, match):
    (tmp_path / "a.png").mkdir()
    for name, reason in (("a.gif", "a plot's name ends with .png"), ("a.png", "it is a folder")):
        for refuse in (check_plot, lambda path: save_point_plot(path, *sets, match)):
            with pytest.raises(OutputError, match=reason):
                refuse(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
