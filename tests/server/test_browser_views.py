"""The views of a comparison in a real browser: overlay, side by side, ridges."""

import re

import numpy as np
import pytest

pytest.importorskip("selenium", reason="the extra `browser` is not installed")

from selenium import webdriver
from selenium.webdriver.common.keys import Keys

from .page import compare, needs_chromium

# Returns left, top, right and bottom of all ink in the first viewer, as shares of its size.
INKED = """
const done = arguments[0], viewer = document.querySelector('.viewer');
const box = viewer.getBoundingClientRect(), ends = [9, 9, -9, -9];
const images = [...viewer.querySelectorAll('.ink image')];
Promise.all(images.map(async (shown) => {
  const picture = new Image();
  picture.src = shown.getAttribute('href');
  await picture.decode();
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [picture.width, picture.height];
  const pen = canvas.getContext('2d');
  pen.drawImage(picture, 0, 0);
  const { data } = pen.getImageData(0, 0, canvas.width, canvas.height);
  const [x, y, w, h] = ['x', 'y', 'width', 'height'].map((name) => shown[name].baseVal.value);
  for (let k = 0; k < canvas.width * canvas.height; k += 1) {
    if (data[4 * k + 3] < 160) continue;
    const [column, row] = [k % canvas.width + 0.5, Math.floor(k / canvas.width) + 0.5];
    const place = new DOMPoint(x + w * column / canvas.width, y + h * row / canvas.height);
    const at = place.matrixTransform(shown.getScreenCTM());
    const [u, v] = [(at.x - box.left) / box.width, (at.y - box.top) / box.height];
    [ends[0], ends[1]] = [Math.min(ends[0], u), Math.min(ends[1], v)];
    [ends[2], ends[3]] = [Math.max(ends[2], u), Math.max(ends[3], v)];
  }
})).then(() => done(ends));
"""


pytestmark = [pytest.mark.slow, needs_chromium]


def test_the_prints_fade_into_one_another(page):
    compare(page, "101_1.tif", "101_3.tif")

    def opacity(side):
        return float(page.one(f".viewer .ink.{side}").value_of_css_property("opacity"))

    assert (opacity("probe"), opacity("reference")) == (1, 1)
    page.set("#fade", -100)
    assert (opacity("probe"), opacity("reference")) == (1, 0)
    page.keep("faded")
    page.set("#fade", 50)
    assert (opacity("probe"), opacity("reference")) == (0.5, 1)


def test_a_pair_is_lit_on_both_prints_at_once(page):
    compare(page, "101_1.tif", "101_3.tif")
    page.one("#view-beside").click()
    assert len(page.all(".viewer")) == 2
    mark = page.one(".viewer .mark.probe[data-pair='20'] .reach")
    webdriver.ActionChains(page.browser).move_to_element(mark).perform()
    page.until(lambda: len(page.all(".viewer .mark.lit")) == 2)
    assert {element.get_attribute("data-pair") for element in page.all(".lit")} == {"20"}
    assert page.text(".pair-info").startswith("Pair 20: probe ")
    page.keep("pair")
    page.one(".pair-list summary").send_keys(Keys.ENTER)
    page.until(lambda: page.shown(".pairs button"))
    webdriver.ActionChains(page.browser).send_keys(Keys.TAB).perform()
    page.until(lambda: page.text(".pair-info").startswith("Pair 1: "))


def test_minutiae_are_rings_that_hide_no_ridge_in_both_prints(page):
    compare(page, "101_1.tif", "101_3.tif")
    for view in ("over", "beside"):
        page.one(f"#view-{view}").click()
        for side in ("probe", "reference"):
            shapes = page.all(f".viewer .mark.paired.{side} g > :not(line)")
            assert len(shapes) > 10
            assert {shape.value_of_css_property("fill") for shape in shapes} == {"none"}


def test_a_chosen_pair_stays_lit_in_every_view(page):
    compare(page, "101_1.tif", "101_3.tif")
    page.one(".pair-list summary").click()
    page.one(".pairs [data-pair='7']").click()
    page.one("#view-beside").click()
    page.browser.execute_script("document.activeElement.blur()")
    webdriver.ActionChains(page.browser).move_to_element(page.one("h1")).perform()
    page.until(lambda: len(page.all(".viewer .mark.lit")) == 2)
    page.one("#view-over").click()
    webdriver.ActionChains(page.browser).move_to_element(page.one("h1")).perform()
    assert {element.get_attribute("data-pair") for element in page.all(".lit")} == {"7"}


def test_a_chosen_pair_stays_lit_on_ridges_and_on_the_overlay(page):
    compare(page, "101_1.tif", "101_3.tif")
    page.one(".pair-list summary").click()
    page.one(".pairs [data-pair='7']").click()
    page.one("#view-ridges").click()
    page.until(lambda: page.all(".cells rect"))
    webdriver.ActionChains(page.browser).move_to_element(page.one("h1")).perform()
    page.browser.execute_script("document.activeElement.blur()")
    page.until(lambda: len(page.all(".viewer .mark.lit")) == 1)
    assert {element.get_attribute("data-pair") for element in page.all(".lit")} == {"7"}
    assert "Ridge agreement 0.57" in page.text("#drawn")
    page.keep("ridges")
    page.one("#view-over").click()
    assert page.text("#drawn") == "The probe, moved by the similarity transform."
    page.until(lambda: len(page.all(".viewer .mark.lit")) == 2)


def marks_on_screen(page):
    """Return where the marks in the first viewer are, in shares of its width and height."""
    return page.browser.execute_script(
        """const viewer = document.querySelector('.viewer');
           const box = viewer.getBoundingClientRect();
           return [...viewer.querySelectorAll('.mark')].map((mark) => {
             const at = mark.getCTM();
             return [at.e / box.width, at.f / box.height];
           })"""
    )


def test_no_corner_of_a_print_is_cut_off_in_any_view(page):
    compare(page, "101_1.tif", "101_3.tif")
    for view in ("#view-over", "#view-ridges", "#view-beside"):
        page.one(view).click()
        page.until(lambda: page.one(".stage").get_attribute("aria-busy") is None)
        places = np.array(marks_on_screen(page))
        assert len(places) > 20
        assert ((places > 0) & (places < 1)).all(), view
        left, top, right, bottom = page.browser.execute_async_script(INKED)
        if view != "#view-beside":
            assert min(left, top) > 0, view
            assert max(right, bottom) < 1, view
            assert max(right - left, bottom - top) > 0.7, view


def test_the_zoom_stays_between_overlay_and_ridges(page):
    compare(page, "101_1.tif", "101_3.tif")
    viewer = page.one(".viewer")
    viewer.send_keys("++]" + Keys.ARROW_RIGHT)
    near = viewer.get_dom_attribute("viewBox")
    page.one("#view-ridges").click()
    page.until(lambda: page.all(".cells rect"))
    assert page.one(".viewer").get_dom_attribute("viewBox") == near
    page.one("#view-over").click()
    assert page.one(".viewer").get_dom_attribute("viewBox") == near


def test_prints_whose_ridges_were_not_compared_have_no_map(page):
    compare(page, "101_1.tif", "102_3.tif")
    assert page.one("#view-ridges").get_dom_attribute("disabled") is not None


def test_linked_prints_show_the_same_place(page):
    """Zoomed, moved and rotated on one side, the middles of both views correspond."""
    compare(page, "101_1.tif", "101_3.tif")
    page.one("#view-beside").click()
    left, right = page.all(".viewer")

    def apart_px(number):
        """Return how far a pair lies apart on the screen, as seen from the middles of the views."""
        return page.browser.execute_script(
            """return Math.hypot(...(([a, b]) => [a[0] - b[0], a[1] - b[1]])(
                [...document.querySelectorAll(`.viewer .mark[data-pair='${arguments[0]}']`)].map(
                    (mark) => {
                        const box = mark.ownerSVGElement.getBoundingClientRect();
                        const at = mark.getCTM();
                        return [at.e - box.width / 2, at.f - box.height / 2];
                    })))""",
            number,
        )

    for keys in ("", "+++", Keys.ARROW_RIGHT * 2, "]]"):
        left.send_keys(keys)
        assert max(map(apart_px, (1, 10, 20))) < 30
    assert page.browser.execute_script("return arguments[0].clientHeight", right) > 250
    page.one("#link").click()
    assert max(map(apart_px, (1, 10, 20))) > 60
    page.keep("unlinked")


def test_contrast_and_inversion_change_the_pictures(page):
    compare(page, "101_1.tif", "101_3.tif")
    page.one("#view-beside").click()
    page.one("#contrast").send_keys(Keys.ARROW_RIGHT)
    page.one("#invert").click()
    drawn = page.browser.execute_script(
        "return getComputedStyle(document.querySelector('.viewer .picture')).filter"
    )
    assert drawn == "contrast(1.05) invert(1)"


def test_marks_and_notes_stay_while_views_change(page):
    compare(page, "101_1.tif", "101_3.tif")
    page.one("#view-beside").click()
    page.one("#mark").click()
    webdriver.ActionChains(page.browser).move_to_element(page.all(".viewer")[0]).click().perform()
    page.until(lambda: page.shown(".own-marks input"))
    page.one(".own-marks input").send_keys("a scar")
    page.one("#view-over").click()
    assert len(page.all(".own-mark.elsewhere")) == 1
    page.one("#view-beside").click()
    assert len(page.all(".own-mark")) == 2
    assert page.one(".own-marks input").get_property("value") == "a scar"
    page.keep("marks")
    page.one(".own-marks button").click()
    assert not page.all(".own-mark")


def box(page, selector):
    """Return the left, top, right and bottom of an element in the window."""
    return page.browser.execute_script(
        "const { left, top, right, bottom } = arguments[0].getBoundingClientRect();"
        "return [left, top, right, bottom]",
        page.one(selector),
    )


@pytest.mark.parametrize(("width", "height"), [(1366, 768), (1920, 1080)])
def test_the_picture_fills_the_window_and_stays_with_its_tools(page, width, height):
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    compare(page, "101_1.tif", "101_3.tif")
    places = []
    for view in ("over", "beside", "ridges"):
        page.one(f"#view-{view}").click()
        page.until(lambda: page.one(".stage").get_attribute("aria-busy") is None)
        shared = ("#view-over", ".zooms", "#mark", "#full", "#show-lone", ".panes", ".below")
        places.append([box(page, selector) for selector in shared])
        page.keep(f"{view}_{width}")
    assert places[0] == places[1] == places[2]
    left, top, right, bottom = box(page, ".panes")
    assert (right - left) * (bottom - top) > 0.45 * width * height
    assert box(page, ".below")[3] <= height
    assert box(page, "#badge")[3] <= height
    page.one(".pair-list summary").click()
    page.one(".examination summary").click()
    page.browser.execute_script("scrollTo(0, 1e6)")
    assert box(page, "#export-json")[3] <= height
    assert box(page, ".panes") == pytest.approx([left, top, right, bottom], abs=1)
    page.keep(f"scrolled_{width}")


def test_the_picture_is_shown_on_the_full_screen(page):
    compare(page, "101_1.tif", "101_3.tif")
    before = box(page, ".panes")
    page.one("#full").click()
    page.until(lambda: page.one("#full").get_attribute("aria-pressed") == "true")
    width, height = page.browser.execute_script("return [innerWidth, innerHeight]")
    page.until(lambda: box(page, ".panes")[2] > width - 20)
    assert box(page, ".below")[3] <= height
    page.keep("full_screen")
    page.one("#full").click()
    page.until(lambda: box(page, ".panes") == before)


def test_the_case_report_contains_what_the_examiner_entered(page, downloads):
    compare(page, "101_1.tif", "101_3.tif")
    for view in range(28):
        page.one("#mark").click()
        viewer = page.all(".viewer")[0]
        by = webdriver.ActionChains(page.browser)
        by.move_to_element_with_offset(viewer, 4 * view - 50, 20).click().perform()
        page.until(lambda: len(page.all(".own-marks li")) == view + 1)  # noqa: B023
    letters = [one.text for one in page.all(".own-marks b")]
    page.one("#case-number").send_keys("2026-17")
    page.one("#notes").send_keys("a scar" + Keys.ENTER + "below the core")
    case = downloads / "101_1-101_3-case.html"
    page.one("#export-report").click()
    page.until(case.exists)
    report = case.read_text("utf-8")
    assert re.findall(r"<tr><td><b>(\w+)</b>", report) == letters
    assert '<p class="notes">a scar\nbelow the core</p>' in report
    assert "<title>Case 2026-17: 101_1.tif and 101_3.tif</title>" in report
