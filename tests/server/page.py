"""The page in a real browser, as hands and eyes have it, and the browser itself."""

import shutil
from pathlib import Path

import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
needs_chromium = pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason="chromium and its driver are not installed"
)
PATIENCE_S = 60  # uncompiled, and with other tests beside


def start_browser(downloads):
    """Return a driver of Chromium, which keeps what it downloads in a folder."""
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1400,1000"):
        options.add_argument(word)
    options.add_argument("--hide-scrollbars")
    options.add_argument("--disable-dev-shm-usage")  # containers have little of it
    options.add_experimental_option("prefs", {"download.default_directory": str(downloads)})
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    service = webdriver.ChromeService(executable_path=DRIVER)
    return webdriver.Chrome(options=options, service=service)


class Page:
    """The page, as hands and eyes have it."""

    def __init__(self, browser, address, screenshots, ready="#probe-slot .drop"):
        self.browser = browser
        self._screenshots = screenshots
        browser.get_log("browser")
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
        browser.get(address)
        self.until(lambda: self.shown(ready))

    def until(self, done):
        return WebDriverWait(self.browser, PATIENCE_S, 0.05).until(lambda _: done())

    def one(self, selector):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        found = self.browser.find_elements(By.CSS_SELECTOR, selector)
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


def compare(page, probe, reference):
    page.give("probe", SAMPLES / probe)
    page.give("reference", SAMPLES / reference)
    page.until(lambda: page.shown("#badge") and page.idle())
