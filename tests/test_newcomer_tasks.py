"""The page of first tasks: its commands do what they say, changes of the matcher have effect."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from fpmatch import extract, verify
from fpmatch.matching.matchers.reference import ReferenceMatcher
from fpmatch.matching.prints import prepared as prepare
from fpmatch.matching.reference import match
from fpmatch.matching.reference import prepare as prepared

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = ROOT / "sample_data"
PAGE = (ROOT / "docs" / "tutorial" / "newcomer_tasks.md").read_text("utf-8")
TASKS = dict(
    re.findall(r"^### ([^\n]+)$(?:(?!^###).)*?^```sh\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
)
MADE = {  # what the commands of each task write or print
    "See the method explained on two prints": ("steps/index.html", ".svg"),
    "See the method explained on two point sets": ("star_steps/index.html", ".svg"),
    "Change a parameter and measure it": ("output", "place_tolerance=0.15"),
    "Change a kernel, build it and measure it": ("output", "before"),
    "Measure a matcher that compares images": ("output", "sift"),
    "Draw DET curves and write tables of two systems": ("rates.tex", "paper"),
    "Compare prints in raw files": ("output", "MATCH"),
    "Match stars by right ascension and declination": ("output", "match"),
    "Run a server in a container": ("output", "ready"),
    "Print a case report": ("case.html", "2026-17"),
    "Give a client the right to verify, and no more": ("refused.json", "role"),
    "Complete commands in the shell": ("fpmatch.bash", "complete"),
}
LONG = ("Change a kernel, build it and measure it", "Run a server in a container")
NEEDED = ("chromium", "curl")


@pytest.fixture
def clone(tmp_path):
    for name in ("sample_data", "docs/how-to/one_file"):
        shutil.copytree(ROOT / name, tmp_path / name)
    return tmp_path


def container_can_be_made():
    for engine in filter(shutil.which, ("docker", "podman")):
        if subprocess.run([engine, "info"], capture_output=True, check=False).returncode == 0:
            return True
    return shutil.which("mmdebstrap") is not None and os.geteuid() == 0


def test_each_task_has_its_commands():
    assert list(TASKS) == list(MADE)


@pytest.mark.parametrize(
    "task",
    [
        pytest.param(one, marks=pytest.mark.slow if one in LONG else pytest.mark.docs)
        for one in MADE
    ],
)
def test_the_commands_of_a_task_do_it(task, clone):
    commands = TASKS[task]
    for name in NEEDED:
        if name in commands and shutil.which(name) is None:
            pytest.skip(f"{name} is not installed")
    if "check_container" in commands and not container_can_be_made():
        pytest.skip("there is no engine, nor mmdebstrap for root")
    if task in LONG:
        if not (ROOT / ".git").exists():
            pytest.skip("this is no clone")
        clone /= "whole"
        subprocess.run(["git", "clone", "-q", ROOT, clone], check=True)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", commands],
        cwd=clone,
        env=os.environ | {"PATH": path},
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    file, text = MADE[task]
    assert text in (done.stdout if file == "output" else (clone / file).read_text("utf-8"))


@pytest.fixture(scope="module")
def templates():
    return [extract(SAMPLES / f"101_{number}.tif") for number in (1, 3)]


def test_eq_3_enters_by_the_places_on_the_circle_and_has_a_weight(templates):
    prints = [*map(prepared, templates)]
    _, before = match(*prints)
    _, after = match(*prints, ReferenceMatcher(place_tolerance=0.15).parameters)
    assert after.places < before.places
    assert after.total != before.total


def test_ridges_are_ignored_where_the_area_or_the_template_has_none(templates, monkeypatch):
    assert verify(*templates).compared.ridge_agreement > 0
    bare = [replace(one, field=replace(one.field, ridges=None)) for one in templates]
    area_of_field = prepare.area_of_field
    monkeypatch.setattr(
        prepare, "area_of_field", lambda *given: replace(area_of_field(*given), ridges=None)
    )
    ignored, without = verify(*templates), verify(*bare)
    assert ignored.compared.ridge_agreement is without.compared.ridge_agreement is None
    assert ignored.score == without.score
