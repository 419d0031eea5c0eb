"""Without a compiler: `evaluate` of 80 pictures by kernels that run as Python, beside compiled."""

from __future__ import annotations

import compileall
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from bench_two_cores import turned_prints
from in_turn import OURS, cpu_of_processes, in_turn

import fpmatch

PACKAGE = Path(fpmatch.__file__).parent


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
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
    benchmark: Any, side: str, folder: Path, without_kernels: Path, environment: dict[str, str]
) -> None:
    """Extract the prints and compare all pairs, in one process."""
    path = without_kernels if side == OURS else PACKAGE.parent
    words = [sys.executable, "-m", "fpmatch", "evaluate", str(folder), "--workers", "1"]

    def run() -> str:
        done = subprocess.run(
            words,
            env=environment | {"PYTHONPATH": str(path)},
            cwd=folder,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stderr

    noted = benchmark.pedantic(run, rounds=1)
    assert ("kernels are not compiled" in noted) is (side == OURS)
