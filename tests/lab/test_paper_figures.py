"""The paper's figures: their numbers are the library's, their files always the same."""

import io
import math
import sys
from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from fpmatch.errors import OutputError, PointSetError
from fpmatch.lab.paper_figures.figures import draw_point_figures, numbers_drawn
from fpmatch.lab.paper_figures.flow_chart import flow_chart
from fpmatch.lab.paper_figures.meshes import one_rings
from fpmatch.lab.paper_figures.pair import (
    EASY_SEED,
    MOST_POINTS,
    PointPair,
    matched_point_pair,
    random_point_pair,
    rotated_point_pair,
)
from fpmatch.lab.paper_figures.rings import Ring, choose_ring_pair
from fpmatch.lab.paper_figures.rotation import rotation, two_circles
from fpmatch.lab.paper_figures.sheet import PX, STYLE
from fpmatch.lab.paper_figures.unit_circle import (
    shares_table,
    sub_triangles,
    unit_circle,
    weights,
)
from fpmatch.lab.plots.style import plain_style
from fpmatch.lab.plots.words import degrees, number
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper.matcher import fit_rings
from fpmatch.pointset.paper.one_rings import map_to_unit_circle
from fpmatch.pointset.paper.parametrize import shape_preserving_weights

Floats = NDArray[np.float64]
SVG = "{http://www.w3.org/2000/svg}"
LEAST_LETTERS_PX = 11.0
SPIRAL = np.array([[k**0.5 * math.cos(2.4 * k), k**0.5 * math.sin(2.4 * k)] for k in range(30)])


@pytest.fixture(scope="module")
def pair():
    return random_point_pair(EASY_SEED)


@pytest.fixture(scope="module")
def rings(pair):
    return choose_ring_pair(pair)


@pytest.fixture(scope="module")
def figures(pair, rings):
    """Return all figures by the number in their names, such as 6a."""
    pytest.importorskip("matplotlib")
    return {figure.file_name.split("_")[1]: figure for figure in draw_point_figures(pair, rings)}


def texts_of(svg):
    texts = ElementTree.fromstring(svg).iter(f"{SVG}text")
    return ["".join(text.itertext()) for text in texts]


# Numbers


@pytest.mark.parametrize("side", ["p", "q"])
def test_the_ring_is_the_one_that_the_matcher_maps(rings, side):
    ring: Ring = getattr(rings, side)
    mapped = map_to_unit_circle(ring.side.mesh)
    i = mapped.centre.tolist().index(ring.centre)
    entries = slice(mapped.start[i], mapped.start[i + 1])
    np.testing.assert_array_equal(mapped.vertex[entries], ring.vertex)
    np.testing.assert_allclose(mapped.weight[entries], ring.circle.weights, atol=1e-12)
    np.testing.assert_allclose(mapped.image[:, i], ring.circle.image, atol=1e-12)
    np.testing.assert_allclose(mapped.circle[:, entries].T, ring.circle.boundary, atol=1e-12)
    assert mapped.area[i] == pytest.approx(ring.circle.area) == ring.sectors.sum()
    assert ring.circle.weights.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(ring.circle.weights @ ring.points, ring.middle, atol=1e-12)
    np.testing.assert_allclose(ring.arcs / ring.sides, 2 * math.pi / ring.sides.sum())


def test_the_move_is_the_one_that_the_matcher_proposes(pair, rings):
    p, q = pair.p.prepared, pair.q.prepared
    i = p.rings.centre.tolist().index(rings.p.centre)
    j = q.rings.centre.tolist().index(rings.q.centre)
    a, b, tx, ty = fit_rings(p, q, np.array([[i, j]], np.int32))[0]
    move = rings.move
    assert (a, b) == pytest.approx((move.matrix[0, 0], move.matrix[1, 0]))
    assert (tx, ty) == pytest.approx((move.tx, move.ty))


def test_the_default_ring_is_easy_to_read_and_truly_paired(pair, rings):
    assert 5 <= len(rings.p) == len(rings.q) <= 7
    assert rings.shift == rings.true_shift
    partners = dict(pair.pairs.tolist())
    assert partners[rings.p.centre] == rings.q.centre
    for place, vertex in enumerate(rings.p.vertex.tolist()):
        assert partners[vertex] == rings.q.vertex[rings.partner[place]]
    assert np.hypot(*rings.p.circle.image) > 0.1


@settings(max_examples=15)
@given(st.integers(0, 10_000), st.floats(-300, 300).map(lambda x: 2.0 ** (x / 2)))
def test_the_circles_of_a_rotated_copy_are_the_same_and_rotate_as_it_does(seed, unit):
    pair = rotated_point_pair(SPIRAL * unit, "spiral", seed)
    rings = choose_ring_pair(pair)
    angle = pair.transform.rotation
    assert rings.shift == rings.true_shift
    assert rings.q.circle.area == pytest.approx(rings.p.circle.area)
    assert rings.q.circle.weights[rings.partner] == pytest.approx(rings.p.circle.weights)
    assert rings.image_rotation is not None
    for found in (rings.transform.rotation, rings.circle_rotation, rings.image_rotation):
        assert math.remainder(found - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert rings.transform.scale == pytest.approx(1.0)
    numbers = numbers_drawn(pair, rings)
    assert numbers["matched"] == len(SPIRAL)
    assert numbers["q"]["centre"] == numbers["p"]["centre"]


@given(st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_sub_triangles_hold_the_centre_and_their_mean_is_the_weight(d, seed):
    rng = np.random.default_rng(seed)
    angle = (np.arange(d) + rng.uniform(-0.2, 0.2, d)) * 2 * math.pi / d
    ring = rng.uniform(0.5, 2.0, (d, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
    triangles = sub_triangles(ring, (0.0, 0.0))
    for triangle in triangles:
        assert min(triangle.shares) >= 0
        assert sum(triangle.shares) == pytest.approx(1.0)
        held = np.array(triangle.shares) @ ring[list(triangle.corners)]
        np.testing.assert_allclose(held, 0.0, atol=1e-12)
    mean = shares_table(triangles).mean(axis=1)
    np.testing.assert_allclose(mean, shape_preserving_weights(ring, (0.0, 0.0)), atol=1e-12)


def test_two_given_sets_are_paired_by_the_matcher_or_refused():
    p = np.random.default_rng(5).uniform(0, 10, (30, 2))
    move = Similarity(1.7, 0.9, 30.0, -8.0)
    pair = matched_point_pair(p, np.vstack([[[20.0, -14.0]], move.apply(p)]), "p.csv", "q.csv")
    rings = choose_ring_pair(pair)
    assert rings.q.centre == rings.p.centre + 1
    assert rings.transform.rotation == pytest.approx(0.9)
    assert rings.transform.scale == pytest.approx(1.7)
    assert numbers_drawn(pair, rings)["matched"] == len(p)
    unrelated = np.random.default_rng(3).uniform(0, 1, (20, 2))
    with pytest.raises(PointSetError, match=r"^p\.csv and q\.csv: they do not match"):
        matched_point_pair(SPIRAL[:20], unrelated, "p.csv", "q.csv")


def test_the_caption_of_a_regular_ring_has_the_true_partner():
    angle = np.arange(6) * math.pi / 3
    hexagon = np.vstack([np.column_stack([np.cos(angle), np.sin(angle)]), [[0.0, 0.0]]])
    pair = rotated_point_pair(hexagon, "hexagon", 1)
    rings = choose_ring_pair(pair)
    assert rings.image_rotation is None
    sixth = math.remainder(rings.circle_rotation - pair.transform.rotation, math.pi / 3)
    assert sixth == pytest.approx(0.0, abs=1e-9)
    pytest.importorskip("matplotlib")
    with plain_style(STYLE):
        words = two_circles(rings).caption
    assert ("true partner" in words) == (rings.shift != rings.true_shift)


# Figures


def test_there_are_seven_files_of_the_six_figures(figures):
    assert list(figures) == ["2", "3", "4", "5", "6a", "6b", "7"]
    for number_, figure in figures.items():
        root = ElementTree.fromstring(figure.content)
        assert root.tag == f"{SVG}svg"
        assert (root.get("width"), root.get("role")) == ("800", "img")
        assert root.findtext(f"{SVG}title") == figure.title
        assert figure.title.startswith(f"Figure {number_.rstrip('ab')}")
        shown = " ".join(texts_of(figure.content))
        assert all(word in shown for word in figure.caption.split())


def test_the_numbers_are_written_into_the_figures(figures, pair, rings):
    texts = {key: texts_of(figure.content) for key, figure in figures.items()}
    ring, circle = rings.p, rings.p.circle
    for weight, arc, sector in zip(circle.weights, ring.arcs, ring.sectors, strict=True):
        for text in (number(weight), degrees(arc), number(sector)):
            assert texts["4"].count(text) >= 2  # in the drawing and in the table
        assert texts["5"].count(number(weight)) >= 2
    assert {number(circle.area), "1.000", "360.0°"} <= set(texts["4"])
    assert {*rings.names, *map(degrees, rings.deviations)} <= set(texts["6a"])
    assert degrees(rings.transform.rotation) in texts["6b"]
    matched = numbers_drawn(pair, rings)["matched"]
    assert matched >= 0.9 * len(pair.p.mesh)
    assert f"{matched} of {len(pair.p.mesh)} points match" in " ".join(texts["6b"])
    decisions = sum("?" in text for text in texts["7"])
    assert decisions == texts["7"].count("yes") == texts["7"].count("no") == 5


def test_the_same_points_make_the_same_file_whatever_the_settings(figures, pair, rings):
    mpl = pytest.importorskip("matplotlib")
    with mpl.rc_context({"font.size": 31, "svg.fonttype": "path", "lines.linewidth": 9}):
        again = draw_point_figures(pair, rings)
        assert mpl.rcParams["font.size"] == 31
    assert again == list(figures.values())
    for figure in again:
        assert b"Matplotlib" not in figure.content
        assert b"<dc:date>" not in figure.content


def test_png_is_twice_as_large_and_always_the_same(rings):
    pytest.importorskip("matplotlib")
    with plain_style(STYLE):
        sheet = unit_circle(rings.p)
        content = sheet.encoded("png")
        assert content == unit_circle(rings.p).encoded("png")
    with Image.open(io.BytesIO(content)) as image:
        assert image.width == 1600
        assert image.info["Title"] == sheet.title


@pytest.mark.parametrize(
    "draw",
    [
        lambda _, rings: one_rings(rings), lambda _, rings: unit_circle(rings.p),
        lambda _, rings: weights(rings.p), lambda _, rings: two_circles(rings), rotation,
        lambda *_: flow_chart(),
    ],
    ids=["3", "4", "5", "6a", "6b", "7"],
)  # fmt: skip
def test_labels_are_large_and_do_not_overlap(pair, rings, draw):
    backend = pytest.importorskip("matplotlib.backends.backend_agg")
    annotation = pytest.importorskip("matplotlib.text").Annotation
    with plain_style(STYLE):
        figure = draw(pair, rings).figure
        renderer = backend.FigureCanvasAgg(figure).get_renderer()
        for axes in figure.axes:
            labels = [text for text in axes.texts if isinstance(text, annotation)]
            boxes = [text.get_window_extent(renderer) for text in labels]
            frame = axes.get_window_extent(renderer)
            for text, box in zip(labels, boxes, strict=True):
                assert text.get_fontsize() / PX > LEAST_LETTERS_PX
                assert frame.x0 < box.x0 < box.x1 < frame.x1, text
                assert frame.y0 < box.y0 < box.y1 < frame.y1, text
            for (one, a), (two, b) in combinations(zip(labels, boxes, strict=True), 2):
                apart = a.x1 <= b.x0 or b.x1 <= a.x0 or a.y1 <= b.y0 or b.y1 <= a.y0
                assert apart, (one.get_text(), two.get_text())


# Bad input


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        ([], "none of its 0 points has a closed one-ring"),
        ([[0, 0], [1, 1]], "none of its 2 points"),
        (np.column_stack([np.arange(9), np.arange(9)]), "none of its 9 points"),
        ([[1, 2, 3]], "expected an array of shape"),
        ([[0, math.nan]], "coordinates must be finite"),
        (SPIRAL * 1e200, "beyond 2"),
        (np.arange(2.0 * MOST_POINTS + 2).reshape(-1, 2), "at most 2000"),
    ],
)
def test_sets_of_which_there_is_nothing_to_draw(points, reason):
    with pytest.raises(PointSetError, match=f"^p.csv: {reason}|^p.csv: .*{reason}") as caught:
        rotated_point_pair(points, "p.csv", 1)
    assert "\n" not in str(caught.value)


def test_rings_that_cannot_be_shown_are_refused_by_name():
    pair = rotated_point_pair(SPIRAL, "p.csv", 1)
    outer = int(pair.p.mesh.hull[0])
    for index, reason in ((outer, "is not closed"), (30, "go from 0 to 29"), (-1, "from 0 to 29")):
        with pytest.raises(PointSetError, match=f"^p.csv: point {index}: .*{reason}"):
            choose_ring_pair(pair, index)
    inner = int(pair.p.mesh.interior.nonzero()[0][0])
    assert choose_ring_pair(pair, inner).p.centre == inner


def test_a_ring_without_its_partner_is_refused():
    pair = rotated_point_pair(SPIRAL, "p.csv", 1)
    i = choose_ring_pair(pair).p.centre
    lonely = PointPair(pair.p, pair.q, pair.pairs[:0], pair.transform, "", "")
    with pytest.raises(PointSetError, match="no partner in the other set"):
        choose_ring_pair(lonely, i)
    with pytest.raises(PointSetError, match=r"none of its closed one-rings recurs in p\.csv,"):
        choose_ring_pair(lonely)
    crossed = pair.pairs.copy()
    ring = pair.p.mesh.one_ring(i)
    crossed[ring[:2], 1] = crossed[ring[1::-1], 1]
    other = PointPair(pair.p, pair.q, crossed, pair.transform, "", "")
    with pytest.raises(PointSetError, match=f"partner, point {i} .* has other points"):
        choose_ring_pair(other, i)


def test_unknown_formats_and_a_missing_matplotlib_are_named(monkeypatch, pair, rings):
    with pytest.raises(OutputError, match="unknown format 'pdf': expected svg or png"):
        draw_point_figures(pair, rings, "pdf")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(OutputError, match="needs matplotlib: pip install"):
        draw_point_figures(pair, rings)
