"""The page in a real browser: what a person would do on it, and what they would see.

Screenshots are kept in the folder that FPMATCH_SCREENSHOTS names, else in a temporary one;
docs/figures/serve.png is match.png, its colours reduced to 128.
"""

import json
import os
import re
import shutil
from pathlib import Path

import pytest
from PIL import Image

pytest.importorskip("selenium", reason="the extra `browser` is not installed")

from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from fpmatch.server.settings import Role

from .conftest import clients, serving, token_of

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
PATIENCE_S = 60  # uncompiled, and with other tests beside
OPTIONS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1400,1000"),
    *("--hide-scrollbars", "--disable-dev-shm-usage"),  # containers have little of it
)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (CHROMIUM and DRIVER), reason="chromium and its driver are not installed"
    ),
]


@pytest.fixture(scope="module")
def downloads(tmp_path_factory):
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="module")
def browser(downloads):
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for word in OPTIONS:
        options.add_argument(word)
    options.add_experimental_option("prefs", {"download.default_directory": str(downloads)})
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    service = webdriver.ChromeService(executable_path=DRIVER)
    with webdriver.Chrome(options=options, service=service) as driver:
        yield driver


class Page:
    """The page, as hands and eyes have it."""

    def __init__(self, browser, address, screenshots):
        self.browser, self._screenshots = browser, screenshots
        browser.get_log("browser")
        browser.get("about:blank")
        browser.get(address)

    def until(self, done):
        return WebDriverWait(self.browser, PATIENCE_S, 0.05).until(lambda _: done())

    def one(self, selector):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        return self.browser.find_elements(By.CSS_SELECTOR, selector)

    def shown(self, selector):
        return any(element.is_displayed() for element in self.all(selector))

    def text(self, selector):
        return str(self.one(selector).text)

    def by_hand(self):
        return webdriver.ActionChains(self.browser)

    def give(self, slot, *files):
        self.one(f"#{slot}-slot-file").send_keys("\n".join(map(str, files)))

    def idle(self):
        return self.one("main").get_attribute("aria-busy") is None

    def compare(self, probe, reference):
        self.give("probe", SAMPLES / probe)
        self.give("reference", SAMPLES / reference)
        self.until(lambda: self.shown("#badge") and self.idle())

    def set(self, selector, value):
        self.browser.execute_script(
            "arguments[0].value = arguments[1];"
            "arguments[0].dispatchEvent(new Event('input', {bubbles: true}));",
            self.one(selector),
            value,
        )

    def keep(self, name):
        self.browser.save_screenshot(str(self._screenshots / f"{name}.png"))


@pytest.fixture
def open_page(browser, tmp_path_factory):
    folder = Path(os.environ.get("FPMATCH_SCREENSHOTS") or tmp_path_factory.mktemp("screenshots"))
    folder.mkdir(parents=True, exist_ok=True)
    yield lambda address: Page(browser, str(address), folder)
    said = [str(entry["message"]) for entry in browser.get_log("browser")]
    assert [line for line in said if "Failed to load resource" not in line] == []


@pytest.fixture
def page(open_page, gallery):
    """Yield the page of a server with an empty gallery, opened without a token."""
    with serving(gallery=gallery, workers=2) as client:
        page = open_page(client.base_url)
        page.until(lambda: page.shown("#probe-slot .drop"))
        yield page


def test_two_prints_are_compared_and_the_result_is_exported(page, downloads):
    page.keep("empty")
    page.compare("101_1.tif", "101_3.tif")
    assert page.text("#badge") == "MATCH"
    score = float(page.text("#score"))
    assert score > 40
    assert "pairs of different fingers" in page.text("#why")
    assert "rotation" in page.text(".facts")
    assert len(page.all(".links line")) == len(page.all(".pairs li")) > 10
    page.keep("match")
    page.set("#threshold", min(score + 5, 100))
    assert page.text("#badge") == "INCONCLUSIVE"
    assert "Even two such prints of one finger usually score less than" in page.text("#why")
    page.set("#threshold", 30)
    assert page.text("#badge") == "MATCH"
    assert "1 in 1,000 (score 30.0)" in page.text("#threshold-words")
    for name in ("overlay.png", "overlay.svg", "result.json"):
        page.one(f"#export-{name.partition('.')[2]}").click()
        page.until((downloads / f"101_1-101_3-{name}").exists)
        page.until(lambda: not list(downloads.glob("*.crdownload")))
    with Image.open(downloads / "101_1-101_3-overlay.png") as picture:
        assert picture.size[0] >= 800
    drawing = (downloads / "101_1-101_3-overlay.svg").read_text(encoding="utf-8")
    assert drawing.startswith("<svg")
    result = json.loads((downloads / "101_1-101_3-result.json").read_text(encoding="utf-8"))
    assert (result["match"], result["threshold"]) == (True, 30)
    assert (result["probe"], result["reference"]) == ("101_1.tif", "101_3.tif")


def test_views_light_pairs_and_marks_go_into_the_case_report(page, downloads):
    page.compare("101_1.tif", "101_3.tif")
    page.one("#view-ridges").click()
    page.until(lambda: page.shown(".cells rect"))
    page.one("#view-beside").click()
    assert len(page.all(".viewer")) == 2
    page.by_hand().move_to_element(page.one(".mark.probe[data-pair='20'] .reach")).perform()
    page.until(lambda: len(page.all(".viewer .mark.lit")) == 2)
    assert {element.get_attribute("data-pair") for element in page.all(".lit")} == {"20"}
    assert page.text(".pair-info").startswith("Pair 20: probe ")
    page.keep("pair")
    page.one(".pair-list summary").send_keys(Keys.ENTER)
    page.until(lambda: page.shown(".pairs button"))
    page.by_hand().send_keys(Keys.TAB).perform()
    page.until(lambda: page.text(".pair-info").startswith("Pair 1: "))
    for k in range(28):
        page.one("#mark").click()
        viewer, by_hand = page.all(".viewer")[0], page.by_hand()
        by_hand.move_to_element_with_offset(viewer, 4 * k - 50, 20).click().perform()
        page.until(lambda: len(page.all(".own-marks li")) == k + 1)  # noqa: B023
    page.one(".own-marks input").send_keys("a small scar")
    page.one("#view-over").click()
    assert len(page.all(".own-mark.elsewhere")) == 28
    page.one("#view-beside").click()
    assert len(page.all(".own-mark")) == 56
    assert page.one(".own-marks input").get_property("value") == "a small scar"
    page.keep("marks")
    page.all(".own-marks button")[-1].click()
    letters = [one.text for one in page.all(".own-marks b")]
    assert letters[25:] == ["Z", "A2"]
    page.one("#case-number").send_keys("2026-17")
    page.one("#notes").send_keys("a scar" + Keys.ENTER + "below the core")
    case = downloads / "101_1-101_3-case.html"
    page.one("#export-report").click()
    page.until(case.exists)
    report = case.read_text("utf-8")
    assert re.findall(r"<tr><td><b>(\w+)</b>", report) == letters
    assert "a small scar" in report
    assert '<p class="notes">a scar\nbelow the core</p>' in report
    assert "<title>Case 2026-17: 101_1.tif and 101_3.tif</title>" in report


def test_a_broken_file_is_named_until_another_is_given(page, tmp_path):
    broken = tmp_path / "broken.tif"
    broken.write_bytes((SAMPLES / "101_1.tif").read_bytes()[:5000])
    page.give("probe", SAMPLES / "101_1.tif")
    page.give("reference", broken)
    page.until(lambda: page.text("#error").startswith("broken.tif: "))
    assert not page.shown("#badge")
    page.keep("broken")
    page.browser.execute_script(
        "const data = new DataTransfer(); data.items.add(new File(['x'], 'holiday.txt'));"
        "document.querySelector('#reference-slot')"
        ".dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true}));"
    )
    page.until(lambda: "holiday.txt" in page.text("#error"))
    page.give("reference", SAMPLES / "101_3.tif")
    page.until(lambda: page.shown("#badge"))
    assert page.text("#error") == ""


def test_enrol_and_identify(page, tmp_path, downloads):
    page.one("#tab-enrol").click()
    nameless = tmp_path / "nameless.tif"
    nameless.write_bytes(b"x")
    names = ("101_2.tif", "101_3.tif", "102_1.tif", "102_2.tif", "103_1.tif")
    assert not page.one("#enrol-start").is_enabled()
    page.give("enrol", *(SAMPLES / name for name in names), nameless)
    assert not page.shown("#enrol-run")  # nothing is enrolled before the button is pressed
    page.one("#enrol-start").click()
    page.until(lambda: page.text("#enrol-words").startswith("6 of 6") and page.idle())
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
    assert re.match(words, cards[0].text)[1] == page.text("#score")
    assert page.text("#badge") == "MATCH"
    page.keep("identify")
    page.all("#candidates button")[2].click()
    page.until(lambda: page.text("#badge") == "NO MATCH")
    page.one("#export-report").click()
    page.until(lambda: list(downloads.glob("101_1-10[23]_*-case.html")))


def test_it_is_for_keyboards_screen_readers_and_phones(page):
    page.compare("101_1.tif", "101_3.tif")
    page.browser.execute_script("document.activeElement.blur()")
    met = set()
    for _ in range(60):
        page.by_hand().send_keys(Keys.TAB).perform()
        met.add(page.browser.switch_to.active_element.get_attribute("id"))
    assert {"probe-slot-file", "view-beside", "fade", "threshold", "export-json"} <= met
    for element in page.all("button, input, img, svg.viewer, progress"):
        if element.is_displayed():
            named = element.accessible_name or element.get_attribute("alt") == ""
            assert named, element.get_attribute("outerHTML")
    assert page.one("#badge").aria_role == "status"
    assert page.one("html").get_attribute("lang") == "en"
    send, size = page.browser.execute_cdp_cmd, {"width": 390, "height": 844}
    send("Emulation.setDeviceMetricsOverride", size | {"deviceScaleFactor": 1, "mobile": True})
    for scheme in ("light", "dark"):
        feature = {"name": "prefers-color-scheme", "value": scheme}
        send("Emulation.setEmulatedMedia", {"features": [feature]})
        page.until(lambda: page.browser.execute_script("return innerWidth") == 390)
        assert page.browser.execute_script("return document.documentElement.scrollWidth") <= 390
        page.keep(f"phone_{scheme}")
    send("Emulation.clearDeviceMetricsOverride", {})
    send("Emulation.setEmulatedMedia", {"features": []})
    page.one("#tab-compare").send_keys(Keys.ARROW_RIGHT)
    assert page.shown("#panel-identify")


@pytest.mark.parametrize(
    ("role", "tabs"), [(Role.READ, 0), (Role.VERIFY, 2), (Role.ENROL, 3), (Role.ADMIN, 3)]
)
def test_a_token_is_asked_for_and_its_role_is_seen(open_page, gallery, role, tabs):
    with serving(gallery=gallery, clients=clients()) as client:
        page = open_page(client.base_url)
        page.until(lambda: page.shown("#token"))
        page.keep("token")
        page.one("#token").send_keys(token_of(role), Keys.ENTER)
        page.until(lambda: page.shown("#probe-slot .drop" if tabs else "#status"))
        page.browser.execute_script("sessionStorage.clear()")
        page = open_page(f"{client.base_url}/#token={token_of(role)}")
        page.until(lambda: page.shown("#probe-slot .drop" if tabs else "#status"))
        assert token_of(role) not in page.browser.current_url
        assert page.text("#about").endswith(f", role {role.name.lower()}")
        shown = [name for name in ("compare", "identify", "enrol") if page.shown(f"#tab-{name}")]
        assert shown == ["compare", "identify", "enrol"][:tabs]
        assert page.shown("#panel-compare") == bool(tabs)
        if not tabs:
            assert "compares no prints. prints.db holds 0 impressions" in page.text("#status")
        page.keep(f"role_{role.name.lower()}")
