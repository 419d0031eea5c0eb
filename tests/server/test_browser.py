"""The page in a real browser: what a person would do on it, and what they would see.

Screenshots are kept in the folder that FPMATCH_SCREENSHOTS names, else in a temporary one;
docs/figures/serve.png is match.png, its colours reduced to 128.
"""

import json
import re

import pytest
from PIL import Image

pytest.importorskip("selenium", reason="the extra `browser` is not installed")

from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from fpmatch.server.settings import Client, Role, digest_of

from .conftest import served_gallery, serving
from .page import PATIENCE_S, SAMPLES, Page, compare, needs_chromium

pytestmark = [pytest.mark.slow, needs_chromium]


def test_two_prints_that_match(page):
    page.keep("empty")
    compare(page, "101_1.tif", "101_3.tif")
    assert page.text("#badge") == "MATCH"
    assert float(page.text("#score")) > 40
    assert "pairs of different fingers" in page.text("#why")
    assert "rotation" in page.text(".facts")
    assert len(page.all(".links line")) == len(page.all(".pairs li")) > 10
    page.keep("match")


def test_another_threshold_another_decision(page):
    compare(page, "101_1.tif", "101_3.tif")
    score = float(page.text("#score"))
    page.set("#threshold", min(score + 5, 100))
    assert page.text("#badge") == "INCONCLUSIVE"
    assert "Even two such prints of one finger usually score less than" in page.text("#why")
    page.set("#threshold", 30)
    assert page.text("#badge") == "MATCH"
    assert "1 in 1,000 (score 30.0)" in page.text("#threshold-words")


def test_a_broken_file_and_an_empty_one(page, tmp_path):
    broken = tmp_path / "broken.tif"
    broken.write_bytes((SAMPLES / "101_1.tif").read_bytes()[:5000])
    page.give("probe", SAMPLES / "101_1.tif")
    page.give("reference", broken)
    page.until(lambda: page.text("#error"))
    assert page.text("#error").startswith("broken.tif: ")
    assert not page.shown("#badge")
    page.keep("broken")
    page.drop("#reference-slot", "holiday.txt")
    page.until(lambda: "holiday.txt" in page.text("#error"))
    page.give("reference", SAMPLES / "101_3.tif")
    page.until(lambda: page.shown("#badge"))
    assert page.text("#error") == ""


def test_what_is_exported_is_what_was_shown(page, downloads):
    compare(page, "101_1.tif", "101_2.tif")
    for name in ("overlay.png", "overlay.svg", "result.json"):
        page.one(f"#export-{name.partition('.')[2]}").click()
        page.until((downloads / f"101_1-101_2-{name}").exists)
        page.until(lambda: not list(downloads.glob("*.crdownload")))
    with Image.open(downloads / "101_1-101_2-overlay.png") as picture:
        assert picture.size[0] >= 800
    drawing = (downloads / "101_1-101_2-overlay.svg").read_text(encoding="utf-8")
    assert drawing.startswith("<svg")
    result = json.loads((downloads / "101_1-101_2-result.json").read_text(encoding="utf-8"))
    assert result["match"]
    assert f"{result['score']:.1f}" == page.text("#score")
    assert (result["probe"], result["reference"]) == ("101_1.tif", "101_2.tif")


def test_enrol_and_identify(page, tmp_path, downloads):
    page.one("#tab-enrol").click()
    nameless = tmp_path / "nameless.tif"
    nameless.write_bytes(b"x")
    names = ("101_2.tif", "101_3.tif", "102_1.tif", "102_2.tif", "103_1.tif")
    assert not page.one("#enrol-start").is_enabled()
    page.give("enrol", *(SAMPLES / name for name in names), nameless)
    assert not page.shown("#enrol-run")  # nothing is enrolled before the button is pressed
    page.one("#enrol-start").click()
    page.until(lambda: page.text("#enrol-words").startswith("6 of 6"))
    page.until(page.idle)
    assert page.text("#enrol-words") == "6 of 6 files: 5 enrolled, 1 failed"
    assert "holds 5 impressions of 3 subjects" in page.text("#enrol-gallery")
    page.keep("enrol")

    page.one("#tab-identify").click()
    page.give("identify", SAMPLES / "101_1.tif")
    page.until(lambda: page.shown("#badge") and page.idle())
    cards = page.all("#candidates li")
    assert len(cards) == 3  # a card for each finger
    assert page.shown("#identify-words")
    words = r"1\. 101_[23]\nfinger: score .*\nbest of 2 impressions: score ([\d.]+)"
    best = re.match(words, cards[0].text)
    assert best
    assert best[1] == page.text("#score")
    assert page.text("#badge") == "MATCH"
    page.keep("identify")
    page.all("#candidates button")[2].click()
    page.until(lambda: page.text("#badge") == "NO MATCH")
    page.one("#export-report").click()
    page.until(lambda: list(downloads.glob("101_1-*-case.html")))


def test_it_works_by_keyboard_alone(page):
    def focused():
        return page.browser.switch_to.active_element

    compare(page, "101_1.tif", "101_3.tif")
    wanted = {"probe-slot-file", "swap", "view-beside", "fade", "threshold", "export-json"}
    page.one("body").send_keys("")
    page.browser.execute_script("document.activeElement.blur()")
    met = set()
    for _ in range(60):
        webdriver.ActionChains(page.browser).send_keys(Keys.TAB).perform()
        met.add(focused().get_attribute("id"))
    assert wanted <= met
    page.one("#tab-compare").send_keys(Keys.ARROW_RIGHT)
    assert focused().get_attribute("id") == "tab-identify"
    assert page.shown("#panel-identify")


def test_everything_has_a_name_for_screen_readers(page):
    compare(page, "101_1.tif", "101_3.tif")
    for element in page.all("button, input, img, [role=tab], svg.viewer, progress"):
        if element.is_displayed():
            named = element.accessible_name or element.get_attribute("alt") == ""
            assert named, element.get_attribute("outerHTML")
    assert page.one("#badge").get_attribute("role") == "status"
    assert page.one("html").get_attribute("lang") == "en"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_phone(page, scheme):
    compare(page, "101_1.tif", "101_3.tif")
    feature = {"name": "prefers-color-scheme", "value": scheme}
    page.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    page.until(lambda: page.browser.execute_script("return innerWidth") == 390)
    assert page.browser.execute_script("return document.documentElement.scrollWidth") <= 390
    height = page.browser.execute_script("return document.documentElement.scrollHeight")
    page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size | {"height": height})
    page.keep(f"phone_{scheme}")


def test_a_token_is_asked_for(browser, screenshots):
    token = "a-long-enough-token"
    clients = {digest_of(token): Client("ada", Role.VERIFY)}
    with serving(clients=clients) as client:
        address = f"{client.base_url}/"
        browser.get(address)
        wait = WebDriverWait(browser, PATIENCE_S, 0.05)
        form = wait.until(lambda _: browser.find_element(By.ID, "token"))
        wait.until(lambda _: form.is_displayed())
        browser.save_screenshot(str(screenshots / "token.png"))
        form.send_keys(token, Keys.ENTER)
        wait.until(lambda _: browser.find_elements(By.CSS_SELECTOR, "#probe-slot .drop"))
        browser.execute_script("sessionStorage.clear()")
        browser.get("about:blank")
        browser.get(f"{address}#token={token}")
        wait.until(lambda _: browser.find_elements(By.CSS_SELECTOR, "#probe-slot .drop"))
        assert token not in browser.current_url


@pytest.mark.parametrize(
    ("role", "tabs"),
    [
        (Role.READ, []),
        (Role.VERIFY, ["Compare", "Identify"]),
        (Role.ADMIN, ["Compare", "Identify", "Enrol"]),
    ],
)
def test_a_role_sees_what_it_may_do(browser, gallery, screenshots, role, tabs):
    token = "a-long-enough-token"
    with served_gallery(gallery, clients={digest_of(token): Client("ada", role)}) as client:
        ready = "#probe-slot .drop" if tabs else "#status"
        page = Page(browser, f"{client.base_url}/#token={token}", screenshots, ready)
        assert page.text("#about").endswith(f", role {role.name.lower()}")
        assert [tab.text for tab in page.all("[role=tab]") if tab.is_displayed()] == tabs
        assert page.shown("#panel-compare") == bool(tabs)
        if not tabs:
            assert "compares no prints. prints.db holds 0 impressions" in page.text("#status")
        page.keep(f"role_{role.name.lower()}")
