"""Ten tasks of a newcomer, each done by the commands of its page, as a shell runs them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "tutorial" / "newcomer_tasks.md").read_text(encoding="utf-8")
TASKS = dict(re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", PAGE, flags=re.MULTILINE | re.DOTALL))
PRINTS = [f"{finger}_{n}.tif" for finger in (101, 102) for n in (1, 2, 3)] + ["101_4.tif"]
OWN = {"ada/1.tif": "101_1.tif", "ada/2.tif": "101_3.tif", "bob/scan.tif": "102_1.tif"}
pytestmark = pytest.mark.docs

# What the task prints, and what it leaves.
SHOWN = {
    "Prints in folders of your own": (["EER", r"\w +1 +2 "], []),
    "Prints that a table lists": (["EER", r"\w +1 +2 ", "enrolled 3 of 3"], ["people.db"]),
    "A matcher of your own": ([r"sizes", r"unit-circle", "side by side"], []),
    "Scores of another program": ([r"EER", r"\b3 +3\b"], []),
    "A gallery with three impressions of each finger": (
        ["enrolled 6 of 6", r"1 +\d+\.\d .+ 101_"],
        [],
    ),
    "A claimed identity": (["MATCH"], ["prints.db"]),
    "A report": (["EER", "MATCH"], ["report/index.html", "case.html"]),
    "Points from numpy": (["MATCH", r"Pairs +40"], ["pairs.csv"]),
}
ELSEWHERE = {"A notebook", "A server in a container"}  # the last two tests


def commands(task: str) -> list[str]:
    """Return the commands of a task; a line that ends in a backslash goes on."""
    (block,) = re.findall(r"^```sh\n(.*?)^```$", TASKS[task], flags=re.MULTILINE | re.DOTALL)
    return [line for line in block.replace("\\\n", "").splitlines() if line[:1] not in {"", "#"}]


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with some sample prints, the same in folders of persons, and the command."""
    folder = tmp_path_factory.mktemp("newcomer")
    (folder / "sample_data").mkdir()
    for name in [*PRINTS, "dataset.toml"]:
        shutil.copy(ROOT / "sample_data" / name, folder / "sample_data")
    for name, source in OWN.items():
        (folder / "people" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "sample_data" / source, folder / "people" / name)
    (folder / "bin").mkdir()
    for name, words in {"fpmatch": "-P -m fpmatch", "python": ""}.items():
        program = folder / "bin" / name
        program.write_text(f'#!/bin/sh\nexec "{sys.executable}" {words} "$@"\n')
        program.chmod(0o755)
    return folder


def test_every_task_is_tested_and_a_page_has_more() -> None:
    assert set(TASKS) == {*SHOWN, *ELSEWHERE}
    for task, text in TASKS.items():
        assert re.search(r"\]\(\.\./[\w/-]+\.md[)#]", text), f"{task}: no page has more"


@pytest.mark.skipif(sys.platform == "win32", reason="the commands are those of a POSIX shell")
@pytest.mark.parametrize("task", SHOWN)
def test_a_task_is_done_by_its_commands(task: str, samples: Path, tmp_path: Path) -> None:
    shutil.copytree(samples, tmp_path, dirs_exist_ok=True)
    for name, content in re.findall(
        r"^`([\w./]+)`[^\n]*:\n\n```\w+\n(.*?)^```$", TASKS[task], flags=re.MULTILINE | re.DOTALL
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(content, encoding="utf-8")
    environment = os.environ | {"PYTHONUTF8": "1"}
    environment["PATH"] = os.pathsep.join([str(tmp_path / "bin"), environment["PATH"]])
    found = [environment["PYTHONPATH"]] if environment.get("PYTHONPATH") else []
    printed = ""
    for command in commands(task):
        line = command.replace(
            "PYTHONPATH=matchers", os.pathsep.join(["PYTHONPATH=matchers", *found])
        )
        done = subprocess.run(
            line,
            shell=True,
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            encoding="utf-8",
            check=False,
            timeout=300,
        )
        assert done.returncode == 0, f"{command}: {done.stderr}"
        printed += done.stdout
    patterns, files = SHOWN[task]
    for pattern in patterns:
        assert re.search(pattern, printed), f"{pattern} is not in: {printed}"
    for file in files:
        assert (tmp_path / file).stat().st_size > 0


def test_the_notebook_is_the_one_that_the_tests_run() -> None:
    names = [word for line in commands("A notebook") for word in line.split() if ".ipynb" in word]
    assert names == ["examples/quick_tour.ipynb"]
    assert f'"{Path(names[0]).name}"' in (ROOT / "tests" / "test_examples.py").read_text("utf-8")


def test_the_container_gets_the_secrets_that_it_needs(tmp_path: Path) -> None:
    secrets, start, _ = commands("A server in a container")
    compose = (ROOT / "compose.yaml").read_text("utf-8")
    assert set(re.findall(r"([A-Z_]+)=%s", secrets)) == set(re.findall(r"\$\{(\w+):\?", compose))
    deploy = (ROOT / "docs" / "how-to" / "deploy.md").read_text("utf-8")
    assert all(line in deploy for line in commands("A server in a container"))
    if shutil.which("docker") is None or docker("info").returncode:
        pytest.skip("no container engine answers; the files are checked in test_packaging.py")
    if docker("compose", "version").returncode:
        pytest.skip("docker has no compose here")
    environment = os.environ | {"POSTGRES_PASSWORD": "0" * 48, "FPMATCH_TOKEN": "1" * 48}
    checked = docker("compose", "config", "--quiet", env=environment)
    assert checked.returncode == 0, checked.stderr
    assert start.startswith("docker compose up ")


def docker(*words: str, env: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    """Run docker in the root of the repository."""
    return subprocess.run(
        ["docker", *words],
        cwd=ROOT,
        env=env,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
