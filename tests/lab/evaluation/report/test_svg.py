import re
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from fpmatch.lab.evaluation.report import svg
from fpmatch.lab.evaluation.report.det import Curve
from fpmatch.lab.evaluation.report.figures import det_plot, rank_plot, roc_plot, score_plot

pytest.importorskip("matplotlib")
STYLE = Path(svg.__file__).with_name("style.css.j2").read_text(encoding="utf-8")
COLOURS = Counter(re.findall(r"--([a-z0-9-]+): #", STYLE))


def curve(label="db", seed=0, gap=3.0, **options):
    rng = np.random.default_rng(seed)
    return Curve(label, rng.standard_normal(60) + gap, rng.standard_normal(900), **options)


def plots():
    curves = [curve(), curve("other", 1, 2.0), curve("both", 2, bold=True)]
    yield "det", det_plot(curves, "det")
    yield "roc", roc_plot(curves, "roc")
    yield "scores", score_plot(curve(), "scores", "score", 1.0)
    yield "ranks", rank_plot([("a", np.array([0.5, 0.9, 1.0])), ("b", np.ones(12))], "ranks")


@pytest.fixture(scope="module")
def drawn():
    return dict(plots())


def test_every_plot_is_xml_in_the_pages_colours(drawn):
    for name, text in drawn.items():
        root = ElementTree.fromstring(text)
        assert root.tag.endswith("svg")
        assert root.get("aria-label"), name
        assert root.get("width") is None
        assert not re.search(r"#0000[0-9a-f]{2}", text)
        named = set(re.findall(r"var\(--([a-z0-9-]+)\)", text))
        assert named <= set(COLOURS)
        assert "ink" in named


def test_no_identifier_occurs_in_two_plots(drawn):
    seen = [set(re.findall(r'\bid="([^"]+)"', text)) for text in drawn.values()]
    assert all(seen)
    assert len(set().union(*seen)) == sum(map(len, seen))
    for text, own in zip(drawn.values(), seen, strict=True):
        used = re.findall(r'url\(#([^)]+)\)|href="#([^"]+)"', text)
        assert {a or b for a, b in used} <= own


def test_the_same_plot_has_the_same_bytes(drawn):
    assert dict(plots()) == drawn


def test_det_axes_are_normal_deviates():
    # Normal scores of one width give a straight line: here FNMR and FMR have z-scores that sum
    # to minus the gap.
    n = np.linspace(0.0005, 0.9995, 1000)
    from scipy.special import ndtri

    text = det_plot([Curve("normal", ndtri(n) + 2.0, ndtri(n))], "det")
    (path, *_) = re.findall(r'<path d="([^"]+)"[^>]*style="[^"]*var\(--series-0\)', text)
    xy = np.array(re.findall(r"[ML] ([\d.]+) ([\d.]+)", path), float)
    inner = xy[(xy[:, 0] > 150) & (xy[:, 1] < 200)]
    slope, offset = np.polyfit(inner[:, 0], inner[:, 1], 1)
    assert np.abs(inner[:, 1] - slope * inner[:, 0] - offset).max() < 2


def test_tied_and_perfect_scores_can_be_drawn():
    tied = Curve("tied", np.zeros(3), np.zeros(5))
    perfect = Curve("perfect", np.full(3, 9.0), np.zeros(5))
    assert (tied.separates, perfect.separates) == (False, True)
    for index, one in enumerate((tied, perfect)):
        for plot in (det_plot, roc_plot):
            ElementTree.fromstring(plot([one], f"p{index}"))
        ElementTree.fromstring(score_plot(one, f"s{index}", "similarity"))


def test_light_and_dark_name_the_same_colours():
    assert STYLE.count("prefers-color-scheme: dark") == 1
    assert set(COLOURS.values()) == {2}
    assert {svg.colour_name(svg.series_colour(k)) for k in range(20)} <= set(COLOURS)
