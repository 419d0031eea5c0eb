"""README and how-to guides: Python runs, commands do what they say, links lead to files."""

import re
import shlex
import shutil
import subprocess
import sys
from contextlib import chdir
from pathlib import Path

import pytest
from click.testing import CliRunner

from fpmatch.audit.log import AuditLog
from fpmatch.cli.group import SUMMARIES, fpmatch
from fpmatch.encryption.key_text import make_keys
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.rotation import rotate
from fpmatch.matching._local_kernel import COMPILED
from research import outputs
from research.outputs import documented_outputs, without_times

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
GUIDES = [path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("docs/how-to/*.md"))]
NOT_HERE = re.compile(
    r"\bfvc/|\b(probe|print|a|template|card)\.|\b(prints/\*|seized|hough|counted)"
    r"|\b(calibrate|fvc --baseline) theirs"
)
"""Files that are not part of the repository."""
SERVES = re.compile(r"^fpmatch serve\b")  # until it is stopped: tests/cli/test_serve.py
NEEDS_TRUTH = re.compile(r"^fpmatch evaluate prints\b")  # of the command before it
NOT_NEEDED = ("102_[2-9].tif", "103_*.tif", "104_*.tif", *(() if COMPILED else ("101_2.tif",)))
"""Prints that no command names; uncompiled, each takes seconds."""
GALLERY = "prints.db"  # that one command makes and others use
OTHER_GALLERIES = {"monday.db", "tuesday.db"}
OUR_SCORES = "ours.csv"  # likewise
TEMPLATES = "templates"  # likewise
KEYS = "keys.txt"  # likewise
AUDIT_LOG = "audit.jsonl"  # that `fpmatch serve` makes and others use
OUTPUTS = [one for one in documented_outputs() if COMPILED or len(one.commands) == 1]
SHOWN = {command for output in OUTPUTS for command in output.commands}
pytestmark = pytest.mark.docs


def blocks(language, page):
    return re.findall(rf"^```{language}\n(.*?)^```$", page, flags=re.DOTALL | re.MULTILINE)


def commands(*pages):
    """Return the command lines of `fpmatch`, comments taken off, each once."""
    lines = "\n".join(block for page in pages for block in blocks("sh", page)).splitlines()
    lines = [line.partition("#")[0].strip() for line in lines if line.startswith("fpmatch ")]
    return list(dict.fromkeys(lines))


def arguments(command, folder):
    """Split a command as a shell in `folder` would, file name patterns filled in."""
    words = []
    for word in shlex.split(command)[1:]:
        files = sorted(path.relative_to(folder).as_posix() for path in folder.glob(word))
        words += files or [word]
    return words


def run(folder, *words):
    """Run a command of `fpmatch` in a folder."""
    with chdir(folder):
        return CliRunner().invoke(fpmatch, [*words], prog_name="fpmatch")


@pytest.fixture(scope="module")
def enrolled(tmp_path_factory):
    """Return a folder with some of the sample prints, and a gallery of them."""
    folder = tmp_path_factory.mktemp("enrolled")
    prints = folder / "sample_data"
    shutil.copytree(ROOT / "sample_data", prints, ignore=shutil.ignore_patterns(*NOT_NEEDED))
    assert run(folder, "enrol", GALLERY, "sample_data", "--audit").exit_code == 0
    made = [str(prints / f"{name}.tif") for name in ("101_1", "101_3", "102_1")]
    assert run(folder, "extract", *made, "-o", TEMPLATES).exit_code == 0
    assert run(folder, "evaluate", "sample_data", "--scores", OUR_SCORES).exit_code == 0
    for path in map(Path, made):
        finger = folder / "people" / path.stem.partition("_")[0] / "right-index"
        finger.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, finger)
    return folder


@pytest.fixture
def clone(tmp_path, enrolled):
    """Return a folder with sample prints and scores that pages show, which may be written in."""
    for name in ("sample_data", "people"):
        shutil.copytree(enrolled / name, tmp_path / name)
    for page in GUIDES:
        for name, text in re.findall(r"`(theirs\.\w+)`:\n\n```text\n(.*?)```", page, re.DOTALL):
            (tmp_path / name).write_text(text)
    (tmp_path / "genuine.txt").write_text("0.9\n0.8\n")
    (tmp_path / "impostor.txt").write_text("0.1\n0.2\n0.3\n")
    return tmp_path


def make_keys_and_what_they_encrypt(words, clone, enrolled):
    """Make a file of keys, and a gallery or a template that is encrypted with one of them."""
    source = make_keys(f"file:{clone / KEYS}").source
    for name in set(words) & {"secret.db", "plain.db"}:
        if words[0] != "enrol":
            shutil.copy(enrolled / GALLERY, clone / name)
            if name == "secret.db" or "--decrypt" in words:
                with open_gallery(clone / name, key=source) as gallery:
                    rotate(gallery)
    if any(word.endswith(".sealed") for word in words):
        made = ("sample_data/101_1.tif", "-o", TEMPLATES, "--format", "sealed", "--key", source)
        assert run(clone, "extract", *made).exit_code == 0


def test_the_python_example_says_match_and_draws_the_overlay(clone):
    (example,) = blocks("python", README)
    command = [sys.executable, "-W", "error", "-c", example]
    done = subprocess.run(command, cwd=clone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("match ")
    assert (clone / "overlay.png").stat().st_size > 0


def test_every_command_has_its_example():
    assert {command.split()[1] for command in commands(README)} == set(SUMMARIES)


@pytest.mark.parametrize(
    "command",
    [
        line
        for line in commands(README, *GUIDES)
        if not any(pattern.search(line) for pattern in (NOT_HERE, SERVES, NEEDS_TRUTH))
        and line not in SHOWN
    ],
)
def test_a_command_on_sample_prints_exits_cleanly_and_writes_its_file(command, clone, enrolled):
    words = arguments(command, clone)
    for made in {GALLERY, OUR_SCORES} & {*words}:
        if words[0] != "enrol":
            shutil.copy(enrolled / made, clone)
    for other in OTHER_GALLERIES & {*words}:
        shutil.copy(enrolled / GALLERY, clone / other)
    if TEMPLATES in words and "-o" not in words:
        shutil.copytree(enrolled / TEMPLATES, clone / TEMPLATES)
    if AUDIT_LOG in words:
        AuditLog(clone / AUDIT_LOG).append("ada", "identify", {"candidates": [3]})
    if any(KEYS in word for word in words) and words not in (["key", "new", KEYS],):
        make_keys_and_what_they_encrypt(words, clone, enrolled)
    done = run(clone, *words)
    assert done.exit_code == 0, done.output
    for option in {"-o", "--report", "--curves", "--scores"} & {*words}:
        assert (clone / words[words.index(option) + 1]).exists()


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
