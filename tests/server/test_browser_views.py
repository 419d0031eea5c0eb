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
