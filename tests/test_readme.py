"""README and how-to guides: Python runs, commands do what they say and print what is shown."""

import re
import shlex
import shutil
import subprocess
import sys
from contextlib import chdir
from pathlib import Path

import pytest
from click.testing import CliRunner

from fpmatch.cli.group import fpmatch, summaries
from fpmatch.gallery.store.audit_log import AuditLog
from fpmatch.matching.pipeline._kernels._local_kernel import COMPILED
from research import outputs
from research.outputs import documented_outputs, without_times

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"
PAGES = [README, *sorted(ROOT.glob("docs/how-to/*.md"))]
LEFT_OUT = re.compile(
    r"\bfvc/|\b(probe|print|a|template|card)\.|\b(prints/\*|seized|hough|counted)"
    r"|\b(calibrate|fvc --baseline) theirs"  # these files are not part of the repository
    r"|^fpmatch serve\b"  # until it is stopped: tests/server/cli/test_serve.py
    r"|101_1.tif sample_data/102_1.tif"  # no match: its output is compared below
)
NOT_NEEDED = ("102_[2-9].tif", "103_*.tif", "104_*.tif", *(() if COMPILED else ("101_2.tif",)))
"""Prints that no command names; uncompiled, each takes seconds."""
WRITTEN = {"-o", "--report", "--curves", "--scores"}  # options before a file or folder
OUTPUTS = [one for one in documented_outputs() if COMPILED or len(one.commands) == 1]
pytestmark = pytest.mark.docs


def blocks(language, page):
    text = page.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)


def commands(page):
    """Return the command lines of `fpmatch`, comments taken off, each once."""
    lines = [line.partition("#")[0].strip() for line in "".join(blocks("sh", page)).splitlines()]
    return [one for one in dict.fromkeys(lines) if one.startswith("fpmatch ")]


def run(folder, command):
    """Run a command in a folder, with patterns of names filled in; return its words."""
    words = []
    for word in shlex.split(command)[1:]:
        files = sorted(path.relative_to(folder).as_posix() for path in folder.glob(word))
        words += files or [word]
    with chdir(folder):
        done = CliRunner().invoke(fpmatch, words, prog_name="fpmatch")
    assert done.exit_code == 0, f"{command}: {done.output}"
    return words


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a folder with some of the sample prints, and what pages take for granted."""
    folder = tmp_path_factory.mktemp("made")
    prints = folder / "sample_data"
    shutil.copytree(ROOT / "sample_data", prints, ignore=shutil.ignore_patterns(*NOT_NEEDED))
    for finger, number in ((101, 1), (101, 3), (102, 1)):
        person = folder / "people" / str(finger) / "right-index"
        person.mkdir(parents=True, exist_ok=True)
        shutil.copy(prints / f"{finger}_{number}.tif", person)
    run(folder, "fpmatch enrol prints.db sample_data")
    for name in ("monday.db", "tuesday.db"):
        shutil.copy(folder / "prints.db", folder / name)
    run(folder, "fpmatch extract sample_data/101_[13].tif sample_data/102_1.tif -o templates")
    for page in PAGES:
        shown = re.findall(
            r"`(theirs\.\w+)`:\n\n```text\n(.*?)```", page.read_text("utf-8"), re.DOTALL
        )
        for name, text in shown:
            (folder / name).write_text(text)
    (folder / "genuine.txt").write_text("0.9\n0.8\n")
    (folder / "impostor.txt").write_text("0.1\n0.2\n0.3\n")
    AuditLog(folder / "audit.jsonl").append("ada", "identify", {"candidates": [3]})
    return folder


@pytest.fixture
def clone(tmp_path, made):
    """Return a copy of that folder, in which files may be written."""
    return Path(shutil.copytree(made, tmp_path / "clone"))


def test_the_python_example_says_match_and_draws_the_overlay(clone):
    (example,) = blocks("python", README)
    command = [sys.executable, "-W", "error", "-c", example]
    done = subprocess.run(command, cwd=clone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("match ")
    assert (clone / "overlay.png").stat().st_size > 0


def test_every_command_has_its_example():
    assert {command.split()[1] for command in commands(README)} == set(summaries())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_commands_of_a_page_exit_cleanly_and_write_their_files(page, clone):
    for command in commands(page):
        if LEFT_OUT.search(command):
            continue
        words = run(clone, command)
        for option in WRITTEN & {*words}:
            assert (clone / words[words.index(option) + 1]).exists(), command


@pytest.mark.parametrize("output", OUTPUTS, ids=str)
def test_the_output_shown_is_what_the_commands_print(output):
    """If not, `python -m research outputs` writes it."""
    assert without_times(output.shown) == without_times(output.printed())


def test_an_output_of_another_version_is_found_and_written(tmp_path, monkeypatch):
    page = tmp_path / "README.md"
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    (tmp_path / "docs").mkdir()
    start = "```sh\nfpmatch inspect sample_data/101_1.tif  # one line\n```\n\n"
    old = "<!-- one-output:start -->\n```text\n59.1 in 3 s\n```\n<!-- one-output:end -->\n"
    page.write_text(start + old, encoding="utf-8")
    monkeypatch.setattr(outputs, "ROOT", tmp_path)
    (output,) = outputs.documented_outputs()
    assert (output.mark, output.shown) == ("one-output", "59.1 in 3 s\n")
    for words, status, state in (
        (["--check"], 1, "differs"),
        ([], 0, "written"),
        (["--check"], 0, ""),
    ):
        done = CliRunner().invoke(outputs.command, words)
        assert (done.exit_code, state in done.output) == (status, True)
    assert output.shown.startswith("sample_data/101_1.tif: TIFF image, 388 x 374 px")
