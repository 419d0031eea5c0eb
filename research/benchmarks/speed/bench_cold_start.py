"""Cold start: whole processes, from the shell's point of view."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from in_turn import OURS, cpu_of_processes, in_turn, wall

SAMPLE = Path(__file__).resolve().parents[3] / "sample_data"
HEAVY = ("scipy", "cv2", "skimage")


def _run(words: list[str], environment: dict[str, str]) -> None:
    subprocess.run(words, env=environment, stdout=subprocess.DEVNULL, check=True)


@cpu_of_processes("cold start of verify")
@in_turn(5)
def test_verify(benchmark: Any, side: str, command: list[str], environment: dict[str, str]) -> None:
    """Verify two image files; the yardstick imports what no decision can do without."""
    prints = [str(SAMPLE / name) for name in ("101_1.tif", "101_3.tif")]
    bare = [sys.executable, "-c", "import numpy, cv2"]
    words = [*command, "verify", *prints] if side == OURS else bare
    benchmark.pedantic(_run, (words, environment), rounds=3, warmup_rounds=1)


@cpu_of_processes("cold start of help")
@in_turn(5)
def test_help(benchmark: Any, side: str, command: list[str], environment: dict[str, str]) -> None:
    """Show the help; the yardstick imports the library of the command line."""
    bare = [sys.executable, "-c", "import click"]
    words = [*command, "--help"] if side == OURS else bare
    benchmark.pedantic(_run, (words, environment), rounds=5, warmup_rounds=1)


@wall("heavy modules after import")
def test_import(benchmark: Any, environment: dict[str, str]) -> None:
    """Count the heavy modules that `import fpmatch` alone loads."""
    code = f"import sys, fpmatch; print(sum(name in sys.modules for name in {HEAVY}))"

    def count() -> int:
        words = [sys.executable, "-c", code]
        return int(subprocess.run(words, env=environment, capture_output=True, check=True).stdout)

    benchmark.extra_info["value"] = benchmark.pedantic(count, rounds=1)
    benchmark.extra_info["yardstick"] = len(HEAVY)
