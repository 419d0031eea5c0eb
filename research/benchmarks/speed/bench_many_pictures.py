"""`evaluate` and `enrol` of many pictures: with two workers against one, and without a compiler.

Beside two workers stands what two processes gain that share nothing but the machine: no more is to
be had. Without a compiler, kernels run as Python.
"""

from __future__ import annotations

import compileall
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from in_turn import OURS, cpu_of_processes, in_turn, wall
from PIL import Image
from two_processes import gain_of_two_processes

import fpmatch

PACKAGE = Path(fpmatch.__file__).parent
SAMPLE = Path(__file__).resolve().parents[3] / "sample_data"
BLOCKS = 5
TURNS_DEG = (0.0, 4.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of 20 fingers with 8 impressions: the sample prints, turned a little."""
    return turned_prints(tmp_path_factory.mktemp("prints"))


def turned_prints(made: Path, turns_deg: tuple[float, ...] = TURNS_DEG) -> Path:
    """Write the sample prints of five times as many fingers into a folder; return it."""
    for block in range(BLOCKS):
        for source in sorted(SAMPLE.glob("*.tif")):
            finger, impression = source.stem.split("_")
            for k, turn in enumerate(turns_deg):
                with Image.open(source) as picture:
                    turned = picture.convert("L").rotate(turn - 7 * block, fillcolor=255)
                name = f"{int(finger) + 10 * block}_{int(impression) + 4 * k}.png"
                turned.save(made / name, dpi=(500, 500))
    return made


@wall("two cores, evaluate")
@in_turn(4)
def test_evaluate(
    benchmark: Any, side: str, folder: Path, command: list[str], environment: dict[str, str]
) -> None:
    """Extract the prints and compare all pairs."""
    benchmark.extra_info["two processes"] = gain_of_two_processes(environment)
    words = [*command, "evaluate", str(folder), "--workers", "2" if side == OURS else "1"]
    benchmark.pedantic(_run, (words, environment), rounds=1)


@wall("two cores, enrol")
@in_turn(4)
def test_enrol(
    benchmark: Any,
    side: str,
    folder: Path,
    command: list[str],
    environment: dict[str, str],
    tmp_path: Path,
) -> None:
    """Enrol the prints in an empty gallery."""
    benchmark.extra_info["two processes"] = gain_of_two_processes(environment)
    gallery = str(tmp_path / "prints.db")
    workers = "2" if side == OURS else "1"
    words = [*command, "enrol", gallery, str(folder), "--workers", workers]
    benchmark.pedantic(_run, (words, environment), rounds=1)


def _run(words: list[str], environment: dict[str, str]) -> None:
    subprocess.run(words, env=environment, capture_output=True, check=True)


@pytest.fixture(scope="module")
def few_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of 20 fingers with 4 impressions: the sample prints, turned a little."""
    return turned_prints(tmp_path_factory.mktemp("prints"), turns_deg=(0.0,))


@pytest.fixture(scope="module")
def without_kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a copy of the package in which no kernel is compiled."""
    made = tmp_path_factory.mktemp("interpreted")
    left_out = shutil.ignore_patterns("*.so", "*.pyd", "__pycache__")
    shutil.copytree(PACKAGE, made / "fpmatch", ignore=left_out)
    compileall.compile_dir(made, quiet=1)
    return made


@cpu_of_processes("evaluate, kernels interpreted")
@in_turn(2)
def test_interpreted(
    benchmark: Any, side: str, few_folder: Path, without_kernels: Path, environment: dict[str, str]
) -> None:
    """Extract the prints and compare all pairs, in one process."""
    path = without_kernels if side == OURS else PACKAGE.parent
    words = [sys.executable, "-m", "fpmatch", "evaluate", str(few_folder), "--workers", "1"]

    def run() -> str:
        done = subprocess.run(
            words,
            env=environment | {"PYTHONPATH": str(path)},
            cwd=few_folder,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stderr

    noted = benchmark.pedantic(run, rounds=1)
    assert ("kernels are not compiled" in noted) is (side == OURS)
