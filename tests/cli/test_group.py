"""`fpmatch` itself: its help, its errors on one line, its exit statuses."""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from PIL import Image

import fpmatch
from fpmatch.cli.group import SUMMARIES
from fpmatch.errors import FpmatchError

FPMATCH = [sys.executable, "-m", "fpmatch"]


def test_version(run: Any) -> None:
    assert run("--version").output == f"fpmatch {fpmatch.__version__}\n"


def test_help_lists_every_command_with_its_summary(run: Any) -> None:
    output = run("--help").output
    for name, summary in SUMMARIES.items():
        assert name in output
        assert summary in output


@pytest.mark.parametrize("name", SUMMARIES)
def test_every_command_has_help_with_examples(run: Any, name: str) -> None:
    result = run(name, "--help")
    assert result.exit_code == 0
    assert f"Usage: fpmatch {name} [OPTIONS]" in result.output
    assert f"  fpmatch {name} " in result.output.split("Examples:")[1]


@pytest.mark.parametrize("name", SUMMARIES)
def test_the_summaries_are_those_of_the_commands(name: str) -> None:
    command = getattr(importlib.import_module(f"fpmatch.cli.{name}"), name)
    assert isinstance(command, click.Command)
    assert command.callback is not None


@pytest.mark.parametrize(
    "words", [["verifie"], ["verify", "only-one.png"], ["verify", "a", "b", "--dpi", "many"]]
)
def test_words_it_does_not_know_are_bad_input(run: Any, words: list[str]) -> None:
    result = run(*words)
    assert result.exit_code == 2
    assert "Error: " in result.stderr


def failing(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Make `fpmatch stages` raise `error`."""

    def fail(*_: object, **__: object) -> None:
        raise error

    stages = importlib.import_module("fpmatch.cli.stages").stages
    monkeypatch.setattr(stages, "callback", fail)


def test_an_error_of_ours_is_one_line(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, FpmatchError("odd\nname.png: no such file"))
    result = run("stages", "odd.png", "-o", "out")
    assert result.exit_code == 2
    assert result.stderr == "fpmatch: error: odd name.png: no such file\n"
    assert result.stdout == ""


def test_ctrl_c_is_quiet(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, KeyboardInterrupt())
    result = run("stages", "a.png", "-o", "out")
    assert result.exit_code == 130
    assert result.output == ""


def test_a_fault_of_ours_is_not_hidden(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, ZeroDivisionError())
    assert isinstance(run("stages", "a.png", "-o", "out").exception, ZeroDivisionError)


def start(command: list[str], **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a command in another process."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    return subprocess.run(command, text=True, check=False, timeout=60, **options)


def test_a_reader_that_leaves_is_met_in_silence() -> None:
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = start([*FPMATCH, "extract", "no-such-file.png", "-o", "."], stdout=write_end)
    os.close(write_end)
    assert done.returncode == 128 + signal.SIGPIPE
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr


@pytest.mark.parametrize("closed", [False, True], ids=["stderr open", "stderr closed"])
def test_decoders_keep_silent_about_a_damaged_file(tmp_path: Path, closed: bool) -> None:
    path = tmp_path / "print.tif"
    noise = np.random.default_rng(3).integers(0, 256, (90, 80), dtype=np.uint8)
    Image.fromarray(noise).save(path, compression="tiff_lzw")
    data = bytearray(path.read_bytes())
    data[200:400] = bytes(255 - byte for byte in data[200:400])
    path.write_bytes(data)
    words = f"{sys.executable} -m fpmatch stages {path} -o {tmp_path}/out"
    done = start(["/bin/sh", "-c", f"{words} 2>&-" if closed else words])
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == (0 if closed else 1)
    assert ("damaged TIFF image" in done.stderr) is not closed


def test_the_module_runs_as_the_command(tmp_path: Path) -> None:
    done = start([*FPMATCH, "verify", "gone.png", "gone.png"], cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "fpmatch: error: gone.png: no such file\n"
    assert done.stdout == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full here")
def test_output_that_cannot_be_written_is_one_line_and_status_2() -> None:
    with Path("/dev/full").open("w") as full:
        points = Path(__file__).parents[2] / "sample_data" / "stars.csv"
        done = start([*FPMATCH, "points", "match", str(points), str(points)], stdout=full)
    assert done.returncode == 2
    assert done.stderr.splitlines() == ["fpmatch: error: output: No space left on device"]
