"""`docs/how-to/other_scores.md`: its commands do what they say with the files that it shows."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "other_scores.md"
TEXT = PAGE.read_text(encoding="utf-8")
COMMANDS = [
    line.partition("#")[0].split()[1:]
    for block in re.findall(r"^```sh\n(.*?)^```$", TEXT, flags=re.DOTALL | re.MULTILINE)
    for line in block.splitlines()
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with the files that the page shows or makes."""
    for name in ("theirs.txt", "theirs.csv"):
        shown = TEXT.partition(f"`{name}`:")[2].partition("```text\n")[2].partition("```")[0]
        (tmp_path / name).write_text(shown)
    (tmp_path / "genuine.txt").write_text("0.9\n0.8\n")
    (tmp_path / "impostor.txt").write_text("0.1\n0.2\n0.3\n")
    (tmp_path / "sample_data").symlink_to(PAGE.parents[2] / "sample_data")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.docs
@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_a_command_of_the_page(folder, run, words):
    if "--report" in words:
        pytest.importorskip("matplotlib")
    if "ours.csv" in words and "sample_data" not in words:
        assert run("evaluate", "sample_data", "--scores", "ours.csv").exit_code == 0
    done = run(*words)
    assert done.exit_code == 0, done.stderr
    for option in ("--report", "--curves", "--scores"):
        if option in words:
            assert (folder / words[words.index(option) + 1]).exists()


def test_our_matcher_and_theirs_are_compared_pair_by_pair(folder, run):
    run("evaluate", "sample_data", "--scores", "ours.csv")
    done = run("evaluate", "--scores-in", "ours.csv", "--scores-in", "theirs.txt")
    assert "theirs compared with unit-circle: 3 pairs in both" in done.stdout
