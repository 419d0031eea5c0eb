#!/usr/bin/env python3
"""Measure the page in a browser: its weight, and the time from the drop to the first result.

    .venv/bin/python research/benchmarks/serve_page.py [--runs 9]

Needs chromium, chromedriver and the extra `browser`. Starts `fpmatch serve` on two processes, opens
the page again for each run, drops two sample prints on it at once, and waits for the decision. The
first run is of a server without any earlier request.
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

SAMPLES = Path(__file__).resolve().parent.parent / "sample_data"
PRINTS = ("101_1.tif", "101_3.tif")
PATIENCE_S = 60
# Files cannot be dropped by a driver: they are chosen, kept aside, and dropped by a script.
DROP = """
const [done] = [arguments[arguments.length - 1]];
const data = new DataTransfer();
for (const file of document.querySelector('#aside').files) data.items.add(file);
const start = performance.now();
new MutationObserver((_, observer) => {
  const badge = document.querySelector('#badge');
  if (!badge?.textContent) return;
  observer.disconnect();
  requestAnimationFrame(() => setTimeout(() => done(performance.now() - start)));
}).observe(document.querySelector('#result'), {childList: true, subtree: true, attributes: true});
document.querySelector('#probe-slot')
  .dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true}));
"""
ASIDE = """
const aside = document.createElement('input');
aside.type = 'file'; aside.multiple = true; aside.id = 'aside';
document.body.append(aside);
"""
WEIGHT = """
return performance.getEntriesByType('resource').concat(performance.getEntriesByType('navigation'))
  .reduce((sum, entry) => sum + entry.transferSize, 0);
"""


def first_result_ms(browser: Any, address: str) -> float:
    """Return the milliseconds from the drop of two prints until their result is painted."""
    browser.get(address)
    WebDriverWait(browser, PATIENCE_S).until(
        lambda _: browser.find_elements(By.CSS_SELECTOR, "#probe-slot .drop")
    )
    browser.execute_script(ASIDE)
    files = "\n".join(str(SAMPLES / name) for name in PRINTS)
    browser.find_element(By.ID, "aside").send_keys(files)
    return float(browser.execute_async_script(DROP))


def main() -> int:
    """Start server and browser, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=9)
    runs = parser.parse_args().runs
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or "chromium"
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu"):
        options.add_argument(word)
    service = webdriver.ChromeService(executable_path=shutil.which("chromedriver"))
    command = [sys.executable, "-m", "fpmatch", "serve", "--port", "0", "--workers", "2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = server.stdout.readline().split()[-1]
            browser = webdriver.Chrome(options=options, service=service)
            browser.set_script_timeout(PATIENCE_S)
            browser.get(address)
            print(f"page: {browser.execute_script(WEIGHT) / 1000:.0f} kB")
            times = [first_result_ms(browser, address) for _ in range(runs)]
            browser.quit()
        finally:
            server.terminate()
    print(
        f"from the drop to the result: first {times[0]:.0f} ms, "
        f"median of {runs} {statistics.median(times):.0f} ms, slowest {max(times):.0f} ms"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
