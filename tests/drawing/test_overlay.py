from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fpmatch import extract, read_image, verify
from fpmatch.drawing.overlay.draw import draw, overlay_scene
from fpmatch.drawing.overlay.page import LARGEST_PANEL_SIDE, MARGIN
from fpmatch.drawing.overlay.views import agreement, place_numbers
from fpmatch.drawing.scene.items import Box, text_width
from fpmatch.drawing.scene.palette import PROBE_MARK, REFERENCE_MARK, hexadecimal
from fpmatch.drawing.scene.svg import svg_text
from fpmatch.errors import ImageError, OutputError
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template

PANEL = Box(0, 0, 600, 600)
RIGHT = (1.0, 0.0)
SVG = "{http://www.w3.org/2000/svg}"
NO_PAIRS = np.empty((0, 2), dtype=np.int32)


def without_minutiae(verification):
    sides = (verification.probe, verification.reference)
    probe, reference = (replace(side, minutiae=Minutiae.empty()) for side in sides)
    return replace(replace(verification, probe=probe, reference=reference), pairs=NO_PAIRS)


def panel_of(picture):
    """Return the part of a page below its header and above its legend."""
    return picture[200:-80].astype(int)


def svg_of(sides, verification, view="superposed"):
    return ElementTree.fromstring(svg_text(overlay_scene(*sides, verification, view)))


def of_class(root, tag, *words):
    return [e for e in root.iter(SVG + tag) if set(words) <= set(e.get("class", "").split())]


def prints_of(sides, verification):
    """Return the part of an overlay that shows the prints, without caption and legend."""
    return of_class(svg_of(sides, verification), "g", "prints")[0]


def test_draws_what_has_pixels_the_same_every_time_and_changes_nothing(sides, compared):
    before = [image.copy() for image in sides]
    holders = (SimpleNamespace(pixels=image) for image in sides)
    np.testing.assert_array_equal(draw(*sides, compared()), draw(*holders, compared()))
    assert all((old == new).all() for old, new in zip(before, sides, strict=True))


def test_ridges_that_agree_turn_dark_and_others_do_not(sides, compared):
    right = without_minutiae(compared())
    off = replace(right.transform, tx=right.transform.tx + 4.5)
    half_a_ridge_off = replace(right, transform=off)

    def dark_share(verification):
        panel = panel_of(draw(*sides, verification))
        inked = panel.min(axis=2) < 150
        return (panel.max(axis=2) < 110).sum() / inked.sum()

    assert dark_share(right) > 0.6
    assert dark_share(half_a_ridge_off) < 0.5 * dark_share(right)


def test_marks_of_a_pair_lie_where_picture_and_transform_say(sides, compared):
    root, picture = prints_of(sides, compared()), draw(*sides, compared())
    centres = []
    for side, colour in (("probe", PROBE_MARK), ("reference", REFERENCE_MARK)):
        (ring,) = of_class(root, "circle", side, "paired", "ending")
        x, y, radius = (float(ring.get(k)) for k in ("cx", "cy", "r"))
        np.testing.assert_allclose(picture[int(y - radius), int(x)], colour, atol=40)
        centres.append((x, y))
    # The reference is at (1, -2) from the moved probe, at the zoom of 3 that so small a print gets.
    assert np.subtract(*centres[::-1]) == pytest.approx((3.0, -6.0), abs=0.05)


@pytest.mark.parametrize(("view", "numbers"), [("superposed", 0), ("side-by-side", 2)])
def test_svg_joins_every_pair_once(sides, compared, view, numbers):
    root = svg_of(sides, compared(), view)
    assert len(of_class(root, "line", "pair")) == 3
    assert [e.text for e in of_class(root, "text", "number")] == ["1", "2", "3"] * numbers


def test_svg_embeds_both_prints_and_multiplies_them(sides, compared):
    root = svg_of(sides, compared())
    assert "image{mix-blend-mode:multiply}" in root.findtext(SVG + "style")
    classes = [image.get("class") for image in root.iter(SVG + "image")]
    assert classes == ["reference ridges", "probe ridges"]


def test_stands_side_by_side_where_there_is_no_transform(sides, compared):
    nothing = compared(match=False, transform=None, pairs=NO_PAIRS, reason="no common region")
    beside = draw(*sides, nothing, side_by_side=True)
    np.testing.assert_array_equal(draw(*sides, nothing), beside)
    blank = draw(*(np.full_like(image, 200) for image in sides), without_minutiae(nothing))
    assert (blank[blank.shape[0] // 2, 60 : blank.shape[1] // 2 - 60] == 255).all()


@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    scale=st.sampled_from([1e-300, 1e-6, 0.01, 0.5, 3.0, 500.0, 1e7, 1e300]),
    rotation=st.floats(-10, 10),
    tx=st.sampled_from([0.0, -400.0, 1e5, -1e12, 1e300]),
    ty=st.sampled_from([0.0, 333.3, -1e6, 1e300]),
)
def test_any_transform_yields_a_page_of_bounded_size(sides, compared, scale, rotation, tx, ty):
    verification = compared(transform=Similarity(scale, rotation, tx, ty))
    height, width, _ = draw(*sides, verification).shape
    assert max(height, width) <= LARGEST_PANEL_SIDE + 2 * MARGIN + 400
    root = svg_of(sides, verification)
    numbers = [e.get(k) for e in root.iter() for k in ("cx", "cy", "x1", "y2", "transform")]
    assert not any("nan" in n or "inf" in n for n in numbers if n)


@pytest.mark.parametrize("shape", [(1, 1), (2, 300), (300, 2), (20, 5000)])
@pytest.mark.parametrize("side_by_side", [False, True])
def test_images_of_any_shape_are_drawn(shape, side_by_side, compared):
    image = np.random.default_rng(3).integers(0, 256, shape, dtype=np.uint8)
    template = Template(Minutiae([0.0], [0.0], [1.0]), width=shape[1], height=shape[0])
    verification = compared(
        probe=template, reference=template, pairs=np.array([[0, 0]], np.int32),
        transform=Similarity(),
    )  # fmt: skip
    picture = draw(image, image, verification, side_by_side=side_by_side)
    assert max(picture.shape) <= 2 * LARGEST_PANEL_SIDE + 200


@pytest.mark.parametrize(
    "image",
    [
        np.full((170, 180), np.nan), np.zeros((170, 180, 3), np.uint8),
        np.zeros((0, 180), np.uint8), np.zeros((180, 170), np.uint8), None, "101_1.tif",
    ],
    ids=["float", "rgb", "empty", "other-size", "none", "path"],
)  # fmt: skip
def test_refuses_what_is_not_the_image_of_the_template(image, reference_image, compared):
    with pytest.raises(ImageError, match="probe image: "):
        draw(image, reference_image, compared())


def boxes_of(marks, obstacles=()):
    """Return the extents of the numbers of marks that point to the right."""
    numbers = place_numbers([(mark, RIGHT) for mark in marks], obstacles, PANEL, (0, 0, 0))
    return [Box(n.x, n.y - 10, text_width(n.text, n.size), 10) for n in numbers]


def test_numbers_keep_off_ticks_obstacles_and_the_edge():
    (lone,) = boxes_of([(300.0, 300.0)])
    assert lone.right < 300
    wall = Box(0, 280, 299, 40)
    (beside,) = boxes_of([(300.0, 300.0)], [wall])
    assert beside.overlap(wall) < 1
    (cornered,) = boxes_of([(1.0, 1.0)])
    assert cornered.x >= 0
    assert cornered.y >= -1


def test_numbers_of_neighbours_do_not_cover_each_other(rng):
    grid = np.stack(np.meshgrid(np.arange(60, 540, 40), np.arange(60, 540, 40)), -1).reshape(-1, 2)
    points = [(float(x), float(y)) for x, y in grid + rng.uniform(-8, 8, grid.shape)]
    boxes = boxes_of(points)
    assert len(boxes) == len(points)
    assert not [1 for i, a in enumerate(boxes) for b in boxes[:i] if a.overlap(b) > 1]


@pytest.fixture(scope="module")
def sample_pair():
    """Return the pixels of two sample prints, and their verification."""
    samples = Path(__file__).parents[2] / "sample_data"
    images = [read_image(samples / f"101_{k}.tif") for k in (1, 3)]
    return [image.pixels for image in images], verify(*map(extract, images))


def texts_of(root):
    return " | ".join(element.text or "" for element in root.iter(SVG + "text"))


def test_ridges_colour_each_cell_that_was_compared(sample_pair):
    sides, found = sample_pair
    root = svg_of(sides, found, "ridges")
    cells = of_class(root, "polygon", "cell")
    for cell, value in zip(cells, found.ridge_map.correlation, strict=True):
        assert cell.get("fill") == hexadecimal(agreement(value))
    corners = np.array([[xy.split(",") for xy in cell.get("points").split()] for cell in cells])
    corners = corners.astype(float)
    sides_px = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert sides_px == pytest.approx(np.full((len(cells), 4), sides_px.mean()), rel=1e-2)
    area = f"{found.compared.ridge_area_mm2:.0f} mm²"
    assert f"{found.compared.ridge_agreement:.2f} on {area}" in texts_of(root)
    assert draw(*sides, found, ridges=True).shape[2] == 3


def test_colours_of_agreement_grow_lighter():
    """Readers who do not see the colours distinguish the values by lightness."""
    lightness = [np.dot(agreement(value), (0.3, 0.59, 0.11)) for value in np.linspace(0, 1, 21)]
    assert (np.diff(lightness) > 1).all()
    assert agreement(-0.5) == agreement(0.0)


def test_ridges_that_were_not_compared_leave_the_overlay(sides, compared):
    expected = draw(*sides, compared())
    np.testing.assert_array_equal(draw(*sides, compared(), ridges=True), expected)


def test_views_exclude_each_other(sides, compared):
    with pytest.raises(OutputError, match="exclude"):
        draw(*sides, compared(), ridges=True, side_by_side=True)
