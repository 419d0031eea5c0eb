#!/usr/bin/env python3
"""Measure the times of the stages of an extraction, of a comparison and of `verify`.

    .venv/bin/python research/benchmarks/stages.py [--json FILE]

They are CPU times, medians of many runs: of the stages of the extraction, on one thread; of the
steps before and after it; and of one `fpmatch verify` in a process of its own, where everything
runs for the first time.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING
from unittest.mock import patch

from fpmatch.base.output import atomic_write_bytes
from fpmatch.gallery.engine.worker import single_threaded
from fpmatch.image.enhancement.enhancers import ENHANCERS
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.matching.matchers.unit_circle import MATCHER

if TYPE_CHECKING:
    from collections.abc import Callable

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data"
PRINTS = (SAMPLE / "101_1.tif", SAMPLE / "101_3.tif")
ROUNDS = 25
RIDGES = "find ridges, mask and orientation"
# What has been done when the function of that name in `fpmatch.image.extract` returns.
STAGES = {
    "normalize": "normalise",
    "binarize": "binarise",
    "remove_spurs_and_islands": "thin, remove spurs",
    "minutia_quality": "minutiae and their quality",
}
PROCESS = """
import json, time
parts = [("start Python", time.process_time())]
def done(name):
    parts.append((name, time.process_time()))
import click
done("import click")
import numpy, cv2
done("import numpy, cv2")
from PIL import Image, TiffImagePlugin
done("import PIL")
import fpmatch.cli.verify, fpmatch.prints.report, fpmatch.image.extract, fpmatch.matching.scale
import fpmatch.matching.verify, fpmatch.matching.matchers.unit_circle
done("import fpmatch")
from fpmatch.image.io.read import read_image
images = [read_image(path) for path in {paths!r}]
done("read two images")
templates = [fpmatch.image.extract.extract(image) for image in images]
done("extract two templates")
fpmatch.matching.verify.verify(*templates)
done("compare them")
took = [(name, end - start) for (_, start), (name, end) in zip([("", 0.0), *parts], parts)]
print(json.dumps(took))
"""


class _Clock:
    """Note when each stage has been done."""

    def __init__(self) -> None:
        self.last = time.process_time()
        self.took: dict[str, float] = {}

    def note(self, stage: str) -> None:
        now = time.process_time()
        self.took[stage] = now - self.last
        self.last = now

    def noting(self, stage: str, function: Callable[..., object]) -> Callable[..., object]:
        """Return the function, which notes its stage when it returns."""

        def timed(*arguments: object) -> object:
            result = function(*arguments)
            self.note(stage)
            return result

        return timed


def extraction() -> dict[str, float]:
    """Return the milliseconds of each stage of an extraction."""
    image = read_image(PRINTS[0])
    module = sys.modules["fpmatch.image.extract"]
    runs = []
    for _ in range(ROUNDS):
        clock = _Clock()
        timed = {name: clock.noting(stage, getattr(module, name)) for name, stage in STAGES.items()}
        learned = clock.noting(RIDGES, ENHANCERS["learned"])
        with patch.multiple(module, **timed), patch.dict(ENHANCERS, learned=learned):
            clock.last = time.process_time()
            extract(image)
            clock.note("ridges for the template")
        runs.append(clock.took)
    return {name: 1e3 * median(run[name] for run in runs) for name in runs[0]}


def matching() -> dict[str, float]:
    """Return the milliseconds of reading, preparing and comparing."""
    templates = [extract(path) for path in PRINTS]
    prepared = [MATCHER.prepare(template) for template in templates]
    return {
        "read an image": _milliseconds(lambda: read_image(PRINTS[0])),
        "prepare a template": _milliseconds(lambda: MATCHER.prepare(templates[0])),
        "compare two prepared": _milliseconds(lambda: MATCHER.compare(*prepared)),
    }


def process() -> dict[str, float]:
    """Return the milliseconds of the parts of one `fpmatch verify`."""
    code = PROCESS.format(paths=[str(path) for path in PRINTS])
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    runs = []
    for _ in range(ROUNDS // 2):
        words = [sys.executable, "-c", code]
        done = subprocess.run(words, env=environment, capture_output=True, check=True, text=True)
        parts = dict(json.loads(done.stdout))
        before = os.times()
        words = [sys.executable, "-m", "fpmatch", "verify", *map(str, PRINTS)]
        subprocess.run(words, env=environment, capture_output=True, check=True)
        after = os.times()
        whole = after.children_user - before.children_user
        whole += after.children_system - before.children_system
        parts["all else"] = whole - sum(parts.values())
        runs.append(parts)
    return {name: 1e3 * median(run[name] for run in runs) for name in runs[0]}


def _milliseconds(work: Callable[[], object]) -> float:
    took = []
    for _ in range(ROUNDS):
        start = time.process_time()
        for _ in range(5):
            work()
        took.append((time.process_time() - start) / 5)
    return 1e3 * median(took)


def main() -> int:
    """Run the script; return its exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the times to this file")
    options = parser.parse_args()
    with single_threaded():
        found = {"extraction": extraction(), "matching": matching(), "process": process()}
    for title, parts in found.items():
        print(title)
        for name, milliseconds in parts.items():
            print(f"  {name:<36}{milliseconds:8.2f} ms")
        print(f"  {'together':<36}{sum(parts.values()):8.2f} ms")
    if options.json:
        rounded = {t: {k: round(v, 3) for k, v in parts.items()} for t, parts in found.items()}
        atomic_write_bytes(options.json, f"{json.dumps(rounded, indent=1)}\n".encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
