from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.drawing.scene.items import Box, Circle, Group, Ink, Overprint, Path, Pen, Scene, Text
from fpmatch.drawing.scene.raster import paint
from fpmatch.drawing.scene.svg import shared_ink, svg_text

BLACK = (0, 0, 0)
SVG = "{http://www.w3.org/2000/svg}"


def parsed(*items):
    return ElementTree.fromstring(svg_text(Scene(80, 40, items, "a description & more")))


def test_says_its_size_and_what_it_shows():
    root = parsed()
    assert (root.get("width"), root.get("height")) == ("80", "40")
    assert root.get("viewBox") == "0 0 80 40"
    assert root.findtext(SVG + "title") == "a description & more"


@given(st.text(max_size=40))
def test_any_text_yields_xml(text):
    root = parsed(Text(1.0, 20.0, text, 12.0, BLACK), Circle((5, 5), 2, Pen(BLACK), title=text))
    assert len(list(root.iter(SVG + "text"))) == 1
    assert len(list(root.iter(SVG + "circle"))) == 1


def test_shapes_become_the_elements_of_their_kind():
    pen = Pen(BLACK, width=1.5, opacity=0.5, dash=(4.0, 2.0))
    root = parsed(
        Path(((0, 0), (1, 1)), pen, role="pair"),
        Path(((0, 0), (1, 1), (2, 0)), pen),
        Path(((0, 0), (1, 1), (2, 0)), Pen(fill=(255, 0, 0)), closed=True),
    )
    line = root.find(SVG + "line")
    assert line.get("class") == "pair"
    assert (line.get("stroke"), line.get("stroke-width")) == ("#000000", "1.5")
    assert (line.get("opacity"), line.get("stroke-dasharray")) == ("0.5", "4 2")
    assert root.find(SVG + "polyline").get("points") == "0,0 1,1 2,0"
    polygon = root.find(SVG + "polygon")
    assert (polygon.get("fill"), polygon.get("stroke")) == ("#ff0000", None)


def test_a_halo_is_a_wider_white_copy_beneath():
    halo, line = parsed(Path(((0, 0), (9, 9)), Pen(BLACK, width=2.0, halo=1.0))).iter(SVG + "line")
    found = halo.get("class"), halo.get("stroke"), halo.get("stroke-width")
    assert found == ("halo", "#ffffff", "4")
    assert line.get("stroke") == "#000000"


def test_a_group_is_clipped_to_its_box():
    root = parsed(Group((Circle((5, 5), 2, Pen(BLACK)),), Box(1, 2, 30, 20), "prints"))
    group = root.find(SVG + "g")
    name = group.get("clip-path").removeprefix("url(#").removesuffix(")")
    clip = next(e for e in root.iter(SVG + "clipPath") if e.get("id") == name)
    rect = clip.find(SVG + "rect")
    assert [rect.get(k) for k in ("x", "y", "width", "height")] == ["1", "2", "30", "20"]
    assert group.find(SVG + "circle") is not None


def test_an_image_is_placed_by_its_corner():
    matrix = np.array([[2.0, 0, 11.0], [0, 2.0, 21.0], [0, 0, 1]])  # first pixel covers 10 to 12
    image = parsed(Ink(np.zeros((3, 4), np.uint8), BLACK, matrix)).find(SVG + "image")
    assert image.get("transform") == "matrix(2 0 0 2 10 20)"
    assert (image.get("width"), image.get("height")) == ("4", "3")


@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_what_inks_share_lies_where_both_are_painted(turn):
    cosine, sine = np.cos(turn), np.sin(turn)
    upright = np.array([[1.0, 0, 0.5], [0, 1.0, 0.5], [0, 0, 1]])
    turned = np.array([[cosine, -sine, 8.5], [sine, cosine, 3.5], [0, 0, 1]])
    lower = Ink(np.full((30, 30), 255, np.uint8), (255, 150, 40), upright)
    upper = Ink(np.full((20, 20), 255, np.uint8), (60, 140, 250), turned)
    shared = paint(Scene(50, 50, (shared_ink(Overprint(lower, upper)),)))
    both = paint(Scene(50, 50, (Overprint(lower, upper),)))
    mixed = shared_ink(Overprint(lower, upper)).colour
    in_shared = np.abs(shared.astype(int) - mixed).max(axis=2) < 3
    in_both = np.abs(both.astype(int) - mixed).max(axis=2) < 3
    assert in_both.sum() > 150
    assert (in_shared != in_both).sum() <= 0.15 * in_both.sum()
