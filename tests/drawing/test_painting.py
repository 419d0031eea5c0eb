import math
from urllib.request import urlopen
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from fpmatch.drawing.scene.items import (
    Box,
    Circle,
    Group,
    Ink,
    Path,
    Pen,
    Scene,
    Text,
    text_width,
)
from fpmatch.drawing.scene.raster import paint
from fpmatch.drawing.scene.svg import svg_text

BLACK = (0, 0, 0)


def covered(*items, size=60):
    """Return the area, in pixels, that black items cover on a white page."""
    page = paint(Scene(size, size, items))
    return float((255 - page[:, :, 0].astype(float)).sum() / 255)


def line_to(x, y):
    return Path(((10.0, 30.0), (x, y)), Pen(BLACK, width=3.0))


@pytest.mark.parametrize(
    ("item", "area"),
    [
        *((Circle((30.3, 29.6), r, Pen(fill=BLACK)), math.pi * r**2) for r in (3.0, 7.5, 20.25)),
        (Circle((30.0, 30.0), 15.0, Pen(BLACK, width=3.0)), 2 * math.pi * 15 * 3),
        *(
            (line_to(*end), 3 * math.dist((10.0, 30.0), end) + math.pi * 1.5**2)  # round ends
            for end in ((50.0, 30.0), (45.0, 45.0), (10.0, 48.0))
        ),
        (Circle((30.0, 30.0), 10.0, Pen(fill=BLACK, opacity=0.5)), math.pi * 10**2 / 2),
    ],
)
def test_a_shape_covers_its_area(item, area):
    assert covered(item) == pytest.approx(area, rel=0.13)


def test_a_halo_is_white_around_the_line():
    black = np.zeros((40, 40, 3), np.uint8)
    line = Path(((5.0, 20.0), (35.0, 20.0)), Pen((255, 0, 0), width=2.0, halo=4.0))
    page = paint(Scene(40, 40, (line,)), black)
    np.testing.assert_allclose(page[20, 20], (255, 0, 0), atol=20)
    assert tuple(page[17, 20]) == (255, 255, 255)
    assert tuple(page[12, 20]) == BLACK


def test_a_group_stays_inside_its_clip():
    disc = Circle((30.0, 30.0), 25.0, Pen(fill=BLACK))
    page = paint(Scene(60, 60, (Group((disc,), Box(0, 0, 30, 60)),)))
    assert (page[:, 30:] == 255).all()
    assert (page[30, 10:29] == 0).all()


@pytest.mark.parametrize(
    "item",
    [
        Circle((1e7, -1e7), 5.0, Pen(BLACK, BLACK)),
        Path(((-1e7, -1e7), (-1e6, -1e7)), Pen(BLACK, halo=2.0)),
        Text(500.0, 500.0, "far away", 12.0, BLACK),
        Text(5.0, 20.0, "", 12.0, BLACK),
        Path(((10.0, 10.0), (10.0, 10.0)), Pen(BLACK, width=0.0, opacity=0.0, dash=(2.0, 2.0))),
    ],
)
def test_what_lies_off_the_page_leaves_it_bare(item):
    assert covered(item) == 0


def test_a_line_across_a_huge_distance_is_drawn_where_it_passes_and_dashes_leave_gaps():
    line = Path(((-1e7, 30.0), (1e7, 30.0)), Pen(BLACK, width=2.0))
    assert (paint(Scene(60, 60, (line,)))[29:31, :, 0] < 40).all()
    assert 20 < covered(Path(line.points, Pen(BLACK, width=2.0, dash=(4.0, 8.0)))) < 90


def inked(text, axis, anchor="start"):
    """Return the columns, or the rows, in which a text at (80, 30) has ink."""
    page = paint(Scene(160, 40, (Text(80.0, 30.0, text, 24.0, BLACK, anchor),)))
    return np.flatnonzero((page[:, :, 0] < 128).any(axis=axis))


@pytest.mark.parametrize(("anchor", "before"), [("start", 0.0), ("middle", 0.5), ("end", 1.0)])
def test_a_text_lies_at_its_anchor(anchor, before):
    columns, width = inked("HHHH", 0, anchor), text_width("HHHH", 24.0)
    left = 80 - before * width
    assert (columns[0], columns[-1]) == pytest.approx((left, left + width), abs=4)


def test_a_square_of_a_unit_is_a_small_raised_two():
    """The font lacks ², and would draw a box for it."""
    small, two = inked("²", 1), inked("2", 1)
    assert small[0] <= two[0] + 1
    assert len(small) < 0.75 * len(two)
    assert np.diff(inked("HH² HH", 0)).max() >= 5  # the space after it stays


def test_inks_multiply():
    matrix = np.array([[1.0, 0, 0.5], [0, 1.0, 0.5], [0, 0, 1]])
    full = np.full((10, 10), 255, np.uint8)
    orange, blue = Ink(full, (250, 150, 50), matrix), Ink(full, (50, 150, 250), matrix)
    page = paint(Scene(10, 10, (orange, blue)))
    assert tuple(page[5, 5]) == (49, 88, 49)


def test_an_ink_lies_where_its_matrix_puts_it_in_pixels_and_in_svg():
    coverage = np.zeros((5, 6), np.uint8)
    coverage[2, 3] = 255
    ink = Ink(coverage, BLACK, np.array([[3.0, 0, 10.5], [0, 3.0, 4.5], [0, 0, 1]]))
    page = paint(Scene(40, 40, (ink,)))
    row, column = np.unravel_index(page[:, :, 0].argmin(), page.shape[:2])
    assert (row, column) == (10, 19)  # pixel (3, 2) at (19.5, 10.5), the centre of that page pixel
    image = parsed(ink).find(SVG + "image")
    assert image.get("transform") == "matrix(3 0 0 3 9 3)"  # the first pixel covers 9 to 12
    assert (image.get("width"), image.get("height")) == ("6", "5")
    with urlopen(image.get("href")) as stored:
        pixels = np.asarray(Image.open(stored))
    assert (pixels[..., 3] == coverage).all()
    assert not pixels[..., :3].any()


SVG = "{http://www.w3.org/2000/svg}"


def parsed(*items):
    return ElementTree.fromstring(svg_text(Scene(80, 40, items, "this & that")))


@given(st.text(max_size=40))
def test_any_text_yields_xml(text):
    root = parsed(Text(1.0, 20.0, text, 12.0, BLACK), Circle((5, 5), 2, Pen(BLACK)))
    assert (root.get("viewBox"), root.findtext(SVG + "title")) == ("0 0 80 40", "this & that")
    assert len(list(root.iter(SVG + "text"))) == 1
    assert len(list(root.iter(SVG + "circle"))) == 1


def test_shapes_become_the_elements_of_their_kind():
    pen = Pen(BLACK, width=1.5, opacity=0.5, dash=(4.0, 2.0))
    halo = Pen(BLACK, width=2.0, halo=1.0)
    root = parsed(
        Path(((0, 0), (1, 1)), pen, role="pair"),
        Path(((0, 0), (9, 9)), halo),
        Path(((0, 0), (1, 1), (2, 0)), pen),
        Path(((0, 0), (1, 1), (2, 0)), Pen(fill=(255, 0, 0)), closed=True),
    )
    line, white, black = root.iter(SVG + "line")
    assert (white.get("class"), white.get("stroke-width")) == ("halo", "4")
    assert (white.get("stroke"), black.get("stroke")) == ("#ffffff", "#000000")
    assert line.get("class") == "pair"
    assert (line.get("stroke"), line.get("stroke-width")) == ("#000000", "1.5")
    assert (line.get("opacity"), line.get("stroke-dasharray")) == ("0.5", "4 2")
    assert root.find(SVG + "polyline").get("points") == "0,0 1,1 2,0"
    polygon = root.find(SVG + "polygon")
    assert (polygon.get("fill"), polygon.get("stroke")) == ("#ff0000", None)


def test_a_group_is_clipped_to_its_box():
    root = parsed(Group((Circle((5, 5), 2, Pen(BLACK)),), Box(1, 2, 30, 20), "prints"))
    group = root.find(SVG + "g")
    name = group.get("clip-path").removeprefix("url(#").removesuffix(")")
    clip = next(e for e in root.iter(SVG + "clipPath") if e.get("id") == name)
    rect = clip.find(SVG + "rect")
    assert [rect.get(k) for k in ("x", "y", "width", "height")] == ["1", "2", "30", "20"]
    assert group.find(SVG + "circle") is not None
