"""Extraction: against another extractor, over the area of the print, and in memory."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from in_turn import OURS, cpu, in_turn, wall

from fpmatch.image.extract import extract
from fpmatch.image.io.grey import GreyImage

# The peak of the process's own memory; that of `resource` includes its parent process.
PEAK = """
{}
with open("/proc/self/status") as status:
    (peak,) = (line.split()[1] for line in status if line.startswith("VmHWM"))
print(int(peak) * 1024 / 1e6)
"""  # megabytes


@cpu("extraction")
@in_turn(5)
def test_extraction(benchmark: Any, side: str, image: GreyImage) -> None:
    """Extract the minutiae of one print that is in memory."""
    if side == OURS:
        benchmark.pedantic(lambda: extract(image), rounds=7, warmup_rounds=1)
        return
    other = pytest.importorskip("fingerprint_recognition", reason="extra fpmatch[bench]")
    find = lambda: other.extract_minutiae(other.enhance(image.pixels))  # noqa: E731
    benchmark.pedantic(find, rounds=3, warmup_rounds=1)


@cpu("extraction of four times the foreground")
@in_turn(5)
def test_extraction_of_four_times_the_foreground(
    benchmark: Any, side: str, image: GreyImage
) -> None:
    """Extract four prints in one image; the yardstick is the one print."""
    pixels = np.tile(image.pixels, (2, 2)) if side == OURS else image.pixels
    benchmark.pedantic(lambda: extract(GreyImage(pixels), 500), rounds=5, warmup_rounds=1)


@wall("extraction, peak memory")
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="peak on Linux alone")
def test_peak_memory(benchmark: Any, environment: dict[str, str]) -> None:
    """Extract the minutiae of one print in a process of its own; beside it, the bare imports."""
    path = Path(__file__).resolve().parents[3] / "sample_data" / "101_1.tif"
    ours = PEAK.format(f"import fpmatch; fpmatch.extract({str(path)!r})")
    bare = PEAK.format("import numpy, cv2")

    def megabytes(code: str) -> float:
        words = [sys.executable, "-c", code]
        done = subprocess.run(words, env=environment, capture_output=True, check=True)
        return float(done.stdout)

    benchmark.extra_info["yardstick"] = megabytes(bare)
    benchmark.extra_info["value"] = benchmark.pedantic(megabytes, (ours,), rounds=1)
