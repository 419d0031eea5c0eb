"""The page in a real browser: what a person would do on it, and what they would see.

Screenshots are kept in the folder that FPMATCH_SCREENSHOTS names, else in a temporary one;
docs/figures/serve.png is match.png, its colours reduced to 128.
"""

import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("fastapi", reason="the extra `web` is not installed")
pytest.importorskip("uvicorn", reason="the extra `web` is not installed")
pytest.importorskip("httpx", reason="httpx is not installed")
pytest.importorskip("selenium", reason="the extra `browser` is not installed")

from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from fpmatch import extract, read_image, save_template
from fpmatch.gallery.gallery import open_gallery
from fpmatch.web.access import Client, Role, digest_of
from fpmatch.web.app import make_app
from fpmatch.web.settings import Settings

from .conftest import png, served

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
PATIENCE_S = 60  # uncompiled, and with other tests beside

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

pytestmark = pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason="chromium and its driver are not installed"
)


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    gallery = tmp_path_factory.mktemp("gallery") / "prints.db"
    with open_gallery(gallery, create=True):
        pass
    with served(make_app(Settings(workers=2, gallery=str(gallery)))) as client:
        yield client


@pytest.fixture(scope="module")
def downloads(tmp_path_factory):
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="module")
def browser(downloads):
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1400,1000"):
        options.add_argument(word)
    options.add_argument("--hide-scrollbars")
    options.add_argument("--disable-dev-shm-usage")  # containers have little of it
    options.add_experimental_option("prefs", {"download.default_directory": str(downloads)})
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    service = webdriver.ChromeService(executable_path=DRIVER)
    driver = webdriver.Chrome(options=options, service=service)
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def screenshots(tmp_path_factory):
    folder = os.environ.get("FPMATCH_SCREENSHOTS")
    if folder is None:
        return tmp_path_factory.mktemp("screenshots")
    Path(folder).mkdir(parents=True, exist_ok=True)
    return Path(folder)


class Page:
    """The page, as hands and eyes have it."""

    def __init__(self, browser, address, screenshots):
        self.browser = browser
        self._screenshots = screenshots
        browser.get_log("browser")
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
        browser.get(address)
        self.until(lambda: self.shown("#probe-slot .drop"))

    def until(self, done):
        return WebDriverWait(self.browser, PATIENCE_S, 0.05).until(lambda _: done())

    def one(self, selector):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        found: list[Any] = self.browser.find_elements(By.CSS_SELECTOR, selector)
        return found

    def shown(self, selector):
        return any(element.is_displayed() for element in self.all(selector))

    def text(self, selector):
        return str(self.one(selector).text)

    def give(self, slot, *files):
        self.one(f"#{slot}-slot-file").send_keys("\n".join(map(str, files)))

    def drop(self, selector, *names):
        """Drop empty files of these names, as from the desktop."""
        self.browser.execute_script(
            "const data = new DataTransfer();"
            "for (const name of arguments[1]) data.items.add(new File(['x'], name));"
            "document.querySelector(arguments[0])"
            ".dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true}));",
            selector,
            names,
        )

    def idle(self):
        return self.one("main").get_attribute("aria-busy") is None

    def set(self, selector, value):
        self.browser.execute_script(
            "arguments[0].value = arguments[1];"
            "arguments[0].dispatchEvent(new Event('input', {bubbles: true}));",
            self.one(selector),
            value,
        )

    def keep(self, name):
        self.browser.save_screenshot(str(self._screenshots / f"{name}.png"))

    def complaints(self):
        """Return what the browser has to say, but for answers that are no success."""
        said = [str(entry["message"]) for entry in self.browser.get_log("browser")]
        return [line for line in said if "Failed to load resource" not in line]


@pytest.fixture
def page(browser, server, screenshots):
    page = Page(browser, str(server.base_url), screenshots)
    yield page
    assert page.complaints() == []


def compare(page, probe, reference):
    page.give("probe", SAMPLES / probe)
    page.give("reference", SAMPLES / reference)
    page.until(lambda: page.shown("#badge") and page.idle())


def test_two_prints_that_match(page):
    page.keep("empty")
    compare(page, "101_1.tif", "101_3.tif")
    assert page.text("#badge") == "MATCH"
    assert float(page.text("#score")) > 40
    assert "pairs of different fingers" in page.text("#why")
    assert "rotation" in page.text(".facts")
    assert len(page.all(".links line")) == len(page.all(".pairs li")) > 10
    page.keep("match")


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


def test_a_chosen_pair_stays_lit_on_ridges_and_on_the_warped_probe(page):
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
    assert page.text("#drawn") == "Picture of probe: similarity transform."
    still = marks_on_screen(page)
    page.one("#warp").click()
    page.until(lambda: "warped through 21 pairs" in page.text("#drawn"))
    assert "for looking, not for measuring" in page.text("#drawn")
    page.until(lambda: len(page.all(".viewer .mark.lit")) == 2)
    assert marks_on_screen(page) != still
    page.keep("warped")
    page.one("#warp").click()
    assert page.text("#drawn") == "Picture of probe: similarity transform."


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
    for view in ("#view-over", "#warp", "#view-ridges", "#view-beside"):
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


def test_marks_of_an_examiner_follow_the_warped_probe(page):
    compare(page, "101_1.tif", "101_3.tif")
    page.one("#view-beside").click()
    page.one("#mark").click()
    webdriver.ActionChains(page.browser).move_to_element(page.all(".viewer")[0]).click().perform()
    page.one("#view-over").click()

    def place():
        return page.one(".own-mark.elsewhere").get_attribute("style").partition("scale")[0]

    rigid = place()
    page.one("#warp").click()
    page.until(lambda: "warped" in page.text("#drawn"))
    apart = np.subtract(*(np.array(re.findall(r"-?[\d.]+", at), float) for at in (rigid, place())))
    assert 0.1 < np.hypot(*apart[:2]) < 15


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
    page.one("#warp").click()
    page.until(lambda: "warped through" in page.text("#drawn"))


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


def test_the_picture_is_above_the_fold(page):
    size = {"width": 1360, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    compare(page, "101_1.tif", "101_3.tif")
    for view in ("#view-over", "#view-beside", "#view-ridges"):
        page.one(view).click()
        page.until(lambda: page.one(".stage").get_attribute("aria-busy") is None)
        bottom = page.browser.execute_script(
            "return document.querySelector('.below').getBoundingClientRect().bottom + scrollY"
        )
        assert bottom <= 900


def test_the_view_zooms_and_moves_by_keys(page):
    compare(page, "101_1.tif", "101_3.tif")
    viewer = page.one(".viewer")
    whole = [float(part) for part in viewer.get_dom_attribute("viewBox").split()]
    viewer.send_keys("+++")
    near = [float(part) for part in viewer.get_dom_attribute("viewBox").split()]
    assert near[2] < whole[2] / 1.8
    viewer.send_keys(Keys.ARROW_RIGHT)
    assert float(viewer.get_dom_attribute("viewBox").split()[0]) > near[0]
    page.keep("zoomed")
    viewer.send_keys("0")
    assert [float(part) for part in viewer.get_dom_attribute("viewBox").split()] == whole


def test_another_threshold_another_decision(page):
    compare(page, "101_1.tif", "101_3.tif")
    score = float(page.text("#score"))
    page.set("#threshold", min(score + 5, 100))
    assert page.text("#badge") == "NO MATCH"
    assert "does not reach" in page.text("#why")
    page.set("#threshold", 30)
    assert page.text("#badge") == "MATCH"
    assert "1 in 1,000 (score 30.0)" in page.text("#threshold-words")


def test_two_prints_that_do_not_match(page):
    compare(page, "101_1.tif", "103_1.tif")
    assert page.text("#badge") == "NO MATCH"
    assert page.text("#why")
    page.keep("no_match")


def test_prints_that_nothing_lays_over_one_another_stand_side_by_side(page, tmp_path):
    blank = tmp_path / "blank.png"
    blank.write_bytes(png(np.full((300, 300), 255, np.uint8)))
    page.give("probe", SAMPLES / "101_1.tif")
    page.give("reference", blank)
    page.until(lambda: page.shown("#badge") and page.idle())
    assert page.text("#badge") == "NO MATCH"
    assert len(page.all(".viewer")) == 2
    assert not page.one("#view-over").is_enabled()
    assert "Nearly all pairs" in page.text("#why")
    page.keep("blank")


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


def test_a_huge_file_and_a_huge_picture(page, tmp_path):
    huge = tmp_path / "huge.tif"
    with huge.open("wb") as stream:
        stream.truncate(40_000_000)
    page.give("probe", SAMPLES / "101_1.tif")
    page.give("reference", huge)
    page.until(lambda: page.text("#error"))
    assert page.text("#error") == ("huge.tif: 40.0 MB are more than this server takes: 32.0 MB.")
    page.keep("huge")
    wide = tmp_path / "wide.png"
    wide.write_bytes(png(np.full((5000, 5000), 255, np.uint8)))
    page.give("reference", wide)
    page.until(lambda: "wide.png" in page.text("#error"))
    assert "4 megapixels" in page.text("#error")


def test_what_is_exported_is_what_was_shown(page, downloads):
    compare(page, "101_1.tif", "101_2.tif")
    page.one("#warp").click()
    page.until(lambda: "warped" in page.text("#drawn"))
    for name in ("overlay.png", "overlay.svg", "result.json"):
        (downloads / name).unlink(missing_ok=True)
        page.one(f"#export-{name.partition('.')[2]}").click()
        page.until((downloads / name).exists)
        page.until(lambda: not list(downloads.glob("*.crdownload")))
    with Image.open(downloads / "overlay.png") as picture:
        assert picture.size[0] >= 800
    drawing = (downloads / "overlay.svg").read_text(encoding="utf-8")
    assert drawing.startswith("<svg")
    assert "for looking, not for measuring" in drawing
    result = json.loads((downloads / "result.json").read_text(encoding="utf-8"))
    assert result["match"]
    assert f"{result['score']:.1f}" == page.text("#score")
    assert (result["probe"], result["reference"]) == ("101_1.tif", "101_2.tif")


def test_the_stages_of_a_print(page):
    page.give("probe", SAMPLES / "101_4.tif")
    page.one("#probe-slot .more button").click()
    page.until(lambda: page.shown("#stages"))
    assert "minutiae" in page.text("#stage-words")
    page.keep("stages")
    before = page.text("#stage-words")
    page.one("#stage-slider").send_keys(Keys.ARROW_LEFT)
    page.until(lambda: page.text("#stage-words") != before)
    page.one("#stage-slider").send_keys(Keys.ESCAPE)
    page.until(lambda: not page.shown("#stages"))


def test_enrol_and_identify(page, tmp_path):
    page.one("#tab-enrol").click()
    nameless = tmp_path / "nameless.tif"
    nameless.write_bytes(b"x")
    names = ("101_2.tif", "101_3.tif", "102_1.tif", "102_2.tif", "103_1.tif")
    page.give("enrol", *(SAMPLES / name for name in names), nameless)
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
    assert re.match(r"1\. 101_[23]\nscore ", cards[0].text)
    assert len(page.all("#candidates .thumb svg .ink.probe")) >= 2
    assert page.text("#badge") == "MATCH"
    page.keep("identify")
    page.all("#candidates button")[2].click()
    page.until(lambda: page.text("#badge") == "NO MATCH")


def test_templates_without_ridges_are_shown_by_their_minutiae(page, tmp_path):
    template = extract(read_image(SAMPLES / "104_1.tif"))
    path = tmp_path / "104_1.iso"
    save_template(path, template)
    page.give("probe", path)
    page.give("reference", SAMPLES / "104_2.tif")
    page.until(lambda: page.shown("#badge") and page.idle())
    drawn = page.all("#probe-slot span.preview svg .mark")
    assert len(drawn) == len(template.minutiae)
    assert page.shown("#probe-slot span.preview")
    assert not page.shown("#probe-slot img.preview")
    assert page.shown("#reference-slot img.preview")
    page.keep("template")

    page.one("#tab-enrol").click()
    page.give("enrol", path)
    page.until(lambda: page.text("#enrol-words").startswith("1 of 1"))
    page.until(page.idle)
    page.one("#tab-identify").click()
    page.give("identify", SAMPLES / "104_2.tif")
    page.until(lambda: page.shown("#badge") and page.idle())
    page.until(lambda: page.all("#candidates .thumb .mark.reference"))
    assert len(page.all("#candidates li:first-child .thumb .mark.reference")) == len(drawn)
    page.keep("template_enrolled")


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


def test_the_page_of_the_api(page):
    page.one(".about a").click()
    page.until(lambda: len(page.all("#operations section")) > 8)
    assert "POST /verify" in page.text("#operations")
    page.keep("api")


def test_a_token_is_asked_for(browser, screenshots):
    token = "a-long-enough-token"
    clients = {digest_of(token): Client("ada", Role.VERIFY)}
    with served(make_app(Settings(workers=1, clients=clients))) as client:
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
