"""The views of a comparison in a real browser: overlay, side by side, ridges."""

import re

import pytest

pytest.importorskip("selenium", reason="the extra `browser` is not installed")

from selenium import webdriver
from selenium.webdriver.common.keys import Keys

from .page import compare, needs_chromium

pytestmark = [pytest.mark.slow, needs_chromium]


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
